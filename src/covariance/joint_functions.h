// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "covariance/linear_function.h"
#include "covariance/normal_equations.h"
#include "sheaf/covariance.h"

namespace sheaf {

/// An image's (rho, phi); no parts where it is held.
LinearFunction function_of_image(const NormalEquations& equations, std::size_t image);
/// A lens's free columns.
LinearFunction function_of_lens(const ParameterBlocks& blocks, std::size_t camera);

/// What is asked of parameters that no row couples: functions, and which of them is whose.
struct JointFunctions {
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  std::vector<LinearFunction> functions;
  std::vector<std::size_t> of_lens;  ///< of each camera, or kNone, or none at all
  std::vector<std::array<std::size_t, 2>> of_pair;
};
JointFunctions joint_functions(const Problem& problem, const NormalEquations& equations,
                               const CovarianceOptions& options);

}  // namespace sheaf
