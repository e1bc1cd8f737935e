// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// What is wrong with the terms of a problem, or nothing.
std::optional<std::string> wrong_terms(const Problem& problem);

/// The points that are kept, ascending: those that Terms says and those that its terms tie.
std::vector<std::uint32_t> kept_points(const Terms& terms);

/// The parameters that stand at one of their bounds.
std::vector<BoundReached> bounds_reached(const Problem& problem);

/// U of a symmetric positive definite C with U^T U = C^-1, row-major and upper triangular, so that
/// |U e|^2 = e^T C^-1 e; nothing where C is not positive definite.
std::optional<std::array<double, 9>> whitening(const Covariance3& covariance);

}  // namespace sheaf
