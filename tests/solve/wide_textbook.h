// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "solve/textbook.h"

// The textbook's step of problems with rigs, terms, points' own rows and sigmas: the normal
// equations of free images and points, dense, and the terms' rows by automatic differentiation.
namespace sheaf {

/// Twice what the terms of a problem cost, points' own rows included, each with its loss.
double cost_of_terms(const Problem& problem);

/// The poses of images of rigs are what frames and sensors say, bit for bit.
void expect_rigid(const Problem& problem);

/// One step of `solve` without inner iterations against M^T A M, with D = lambda sum M^2 diag(A).
/// The loss's floor must be 1: none, or the first step.
void expect_wide_step(const Problem& start, const Fixed& fixed, CameraSolverKind solver,
                      const Loss& loss = {});

}  // namespace sheaf
