// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/weak_directions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>

#include "geometry/camera_model.h"
#include "starts/sights.h"

namespace sheaf {
namespace {

/// The farthest that a unit of each parameter moves an observed pixel.
using Reach = std::array<double, kMaxCameraParameters>;
std::vector<Reach> reach_of(const Problem& problem) {
  std::vector<Reach> out(problem.cameras.size(), Reach{});
  std::vector<Matrix3<double>> R;
  for (const Pose& pose : problem.poses) R.push_back(matrix_from_quaternion(pose.rotation));
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::uint32_t image = problem.observation_image[i];
    const std::uint32_t camera = problem.image_camera[image];
    const double* X = &problem.points[3 * std::size_t(problem.observation_point[i])];
    const LensJacobian<double> lens = project_with_jacobian(
        problem.cameras[camera], in_camera(R[image], problem.poses[image], X));
    for (std::size_t p = 0; p < parameter_count(problem.cameras[camera].model); ++p)
      out[camera][p] =
          std::max(out[camera][p], std::hypot(lens.parameters[0][p], lens.parameters[1][p]));
  }
  return out;
}

std::string number(double x) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.4g", x);
  return buffer;
}

}  // namespace

std::vector<WeakDirection> weak_directions(const Problem& problem,
                                           const std::vector<std::vector<double>>& lenses) {
  std::vector<WeakDirection> out;
  const std::vector<Reach> reach = reach_of(problem);
  for (std::uint32_t c = 0; c < lenses.size(); ++c) {
    const Camera& camera = problem.cameras[c];
    const std::size_t n = parameter_count(camera.model);
    const ParameterRoles roles = roles_of(camera.model);
    const std::vector<std::string_view> names = parameter_names(camera.model);
    const std::string of = " of camera " + std::to_string(c);
    const auto sigma = [&](std::size_t p) { return std::sqrt(lenses[c][(n + 1) * p]); };
    for (std::uint32_t p = 0; p < n; ++p) {
      const double s = sigma(p);
      if (!(s > 0)) continue;
      const auto role = static_cast<int>(p);
      const bool focal = role == roles.fx || role == roles.fy;
      const bool centre = role == roles.cx || role == roles.cy;
      const bool weak = std::isinf(s) || (focal    ? s > kWeakFocal * std::abs(camera.parameters[p])
                                          : centre ? s > kWeakCentre_px
                                                   : s * reach[c][p] > kWeakCorner_px);
      if (!weak) continue;
      std::string words = std::string(names[p]) + of + " is not determined";
      if (std::isfinite(s))
        words += ": its sigma " + number(s) +
                 (focal || centre ? std::string(" px")
                                  : " moves a pixel by up to " + number(s * reach[c][p]) + " px");
      out.push_back({words, c, {p}, s, 0});
    }
    for (std::uint32_t a = 0; a < n; ++a)
      for (std::uint32_t b = a + 1; b < n; ++b) {
        const double sa = sigma(a), sb = sigma(b);
        if (!(sa > 0) || !(sb > 0) || std::isinf(sa) || std::isinf(sb)) continue;
        const double correlation = lenses[c][n * a + b] / (sa * sb);
        if (!(std::abs(correlation) > kWeakCorrelation)) continue;
        char text[32];
        std::snprintf(text, sizeof text, "%.6f", correlation);
        out.push_back({std::string(names[a]) + " and " + std::string(names[b]) + of +
                           " cannot be told apart: correlation " + text,
                       c,
                       {a, b},
                       0,
                       correlation});
      }
  }
  return out;
}

}  // namespace sheaf
