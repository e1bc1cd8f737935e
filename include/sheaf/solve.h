// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/error.h"
#include "sheaf/options.h"
#include "sheaf/photometric.h"
#include "sheaf/problem.h"
#include "sheaf/summary.h"

namespace sheaf {

/// Refines the problem in place. The best state found is stored even when the run was stopped.
/// Throws Error (ErrorCode::usage) for a problem that `validate` refuses or options that
/// contradict it; `try_solve` returns it instead.
Summary solve(Problem& problem, const SolveOptions& options = {});
Result<Summary> try_solve(Problem& problem, const SolveOptions& options = {});

/// Refines poses, points and brightness from the pixels, in place. Errors: ErrorCode::usage for a
/// problem that `validate` refuses or options that contradict it.
Result<PhotometricSummary> refine_photometric(PhotometricProblem& problem,
                                              const PhotometricOptions& options = {});

}  // namespace sheaf
