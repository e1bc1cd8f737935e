// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "sheaf/problem.h"

namespace sheaf::test {

/// Sigmas of observations from 0.5 to 2 px, and rows of their own for every third point.
inline void weigh(Problem& problem) {
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    problem.observation_sigma.push_back(0.5 + 0.25 * static_cast<double>(i % 7));
  for (std::uint32_t j = 0; j < problem.num_points(); j += 3) {
    const double* X = &problem.points[3 * std::size_t(j)];
    problem.terms.points.push_back({j,
                                    {X[0] + 0.01, X[1] - 0.02, X[2] + 0.005},
                                    {4e-4, 1e-4, 0, 1e-4, 2e-4, 5e-5, 0, 5e-5, 3e-4}});
  }
}

}  // namespace sheaf::test
