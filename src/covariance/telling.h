// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "covariance/inverse_normal.h"
#include "covariance/joint_functions.h"
#include "sheaf/covariance.h"

namespace sheaf {

/// Fills what `options` ask for from the inverse, with sigma and loss_factor of `out` as they
/// stand. factored: the inverse, where it is by a factor; null: by single solves, for what is
/// named.
void tell(const Problem& problem, const CovarianceOptions& options, NormalEquations& equations,
          const Inverse& inverse, const InverseNormal* factored, const JointFunctions& joint,
          Threads& threads, Covariance& out);

}  // namespace sheaf
