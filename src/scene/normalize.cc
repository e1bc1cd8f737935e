// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "scene/noise.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

// The upper one of an even number: both published programs take it.
double upper_median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

Result<Normalization> normalize(Problem& problem, double size) {
  const std::size_t n = problem.num_points();
  if (n == 0) return Error(ErrorCode::usage, "a problem without points cannot be normalised");
  if (!(size > 0) || !std::isfinite(size))
    return Error(ErrorCode::usage, "the size to normalise to must be a finite number above 0");
  Normalization out;
  std::vector<double> values(n);
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < n; ++i) values[i] = problem.points[3 * i + k];
    out.center[k] = upper_median(values);
  }
  for (std::size_t i = 0; i < n; ++i) {
    values[i] = 0;
    for (std::size_t k = 0; k < 3; ++k)
      values[i] += std::fabs(problem.points[3 * i + k] - out.center[k]);
  }
  const double deviation = upper_median(values);
  out.scale = size / deviation;
  if (!(deviation > 0) || !std::isfinite(out.scale))
    return Error(ErrorCode::usage, "the points' median distance from their median is " +
                                       std::to_string(deviation) + ": nothing to normalise to");
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    problem.points[i] = out.scale * (problem.points[i] - out.center[i % 3]);
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    // C <- s (C - m) with t = -R C: t <- s (t + R m).
    const Vector3<double> shift =
        multiply(portable_matrix(portable_rotation(problem, j)), out.center);
    for (std::size_t k = 0; k < 3; ++k) {
      double& t = problem.poses[j].translation[k];
      t = out.scale * (t + shift[k]);
    }
  }
  return out;
}

}  // namespace sheaf
