// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/shared_ptr.h>

#include "held_problem.h"

namespace sheaf {

namespace nb = nanobind;

using ProblemClass = nb::class_<HeldProblem>;

/// Parts of the module, each in a file of its own.
void bind_errors(nb::module_& module);
void bind_iteration(nb::module_& module);
ProblemClass bind_problem(nb::module_& module);
void bind_views(ProblemClass& problem);
void bind_forms(ProblemClass& problem);
void bind_pickling(ProblemClass& problem);
void bind_terms(ProblemClass& problem);
void bind_files(nb::module_& module, ProblemClass& problem);
void bind_solve(nb::module_& module);
void bind_solver(nb::module_& module);
void bind_scenes(nb::module_& module);
void bind_reports(nb::module_& module);
void bind_covariance(nb::module_& module);
void bind_photometric(nb::module_& module);
void bind_command(nb::module_& module);

/// A problem that Python did not have yet.
ProblemHandle handle_of(Problem problem);

}  // namespace sheaf
