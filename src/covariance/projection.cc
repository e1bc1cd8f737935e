// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include "geometry/camera_model.h"
#include "geometry/known_kinds.h"
#include "sheaf/covariance.h"
#include "starts/bearing.h"

namespace sheaf {
namespace {

constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();

/// J C J^T of the two rows of J; what a row does not look at may be infinite in C.
std::array<double, 3> spread(const std::vector<double>& J, const std::vector<double>& C) {
  const std::size_t n = J.size() / 2;
  std::array<double, 3> out{};
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k) {
      const auto add = [&](double by, double& to) {
        if (by != 0) to += by * C[n * i + k];
      };
      add(J[i] * J[k], out[0]);
      add(J[i] * J[n + k], out[1]);
      add(J[n + i] * J[n + k], out[2]);
    }
  return out;
}

/// By the lens's parameters and by (rho, phi), of a place `distance` along a direction, or
/// infinitely far away; there the pixel depends on the direction alone.
std::vector<double> derivatives(const Camera& camera, const Vector3<double>& direction,
                                double distance) {
  const std::size_t n = parameter_count(camera.model), all = n + 6;
  const double far = distance > 0 ? distance : 1;
  const Vector3<double> P{far * direction[0], far * direction[1], far * direction[2]};
  const LensJacobian<double> lens = project_with_jacobian(camera, P);
  std::vector<double> J(2 * all, 0);
  for (std::size_t r = 0; r < 2; ++r) {
    for (std::size_t p = 0; p < n; ++p) J[all * r + p] = lens.parameters[r][p];
    const Vector3<double> a{lens.point[r][0], lens.point[r][1], lens.point[r][2]};
    const Vector3<double> turn = cross(P, a);
    for (std::size_t k = 0; k < 3; ++k) {
      J[all * r + n + k] = distance > 0 ? a[k] : 0;
      J[all * r + n + 3 + k] = turn[k];
    }
  }
  return J;
}

}  // namespace

double ProjectionUncertainty::worst_direction(std::size_t node) const {
  const auto& [xx, xy, yy] = covariance[node];
  if (std::isinf(xx) || std::isinf(yy)) return std::numeric_limits<double>::infinity();
  return std::sqrt((xx + yy) / 2 + std::hypot((xx - yy) / 2, xy));
}

Result<ProjectionUncertainty> projection_uncertainty(const Camera& camera,
                                                     const std::vector<double>& lens_motion,
                                                     const ProjectionGrid& grid) {
  const auto usage = [](const char* text) { return Error(ErrorCode::usage, text); };
  if (!is_known(camera.model)) return usage("the camera's model is none that there is");
  const std::size_t all = parameter_count(camera.model) + 6;
  if (lens_motion.size() != all * all)
    return usage("projection uncertainty needs the covariance of the lens and its images' motion");
  if (camera.width_px == 0 || camera.height_px == 0)
    return usage("projection uncertainty needs the size of the images, which is not known");
  if (grid.columns < 2 || grid.rows < 2) return usage("a grid has at least two rows and columns");
  if (!(grid.distance >= 0) || !std::isfinite(grid.distance))
    return usage("the distance must be finite and not below 0");
  ProjectionUncertainty out;
  out.grid = grid;
  for (std::uint32_t row = 0; row < grid.rows; ++row)
    for (std::uint32_t column = 0; column < grid.columns; ++column) {
      const double pixel[] = {static_cast<double>(camera.width_px) * column / (grid.columns - 1.0),
                              static_cast<double>(camera.height_px) * row / (grid.rows - 1.0)};
      out.pixels.push_back({pixel[0], pixel[1]});
      const auto direction = bearing(camera, pixel);
      out.covariance.push_back(
          direction ? spread(derivatives(camera, *direction, grid.distance), lens_motion)
                    : std::array<double, 3>{kNothing, kNothing, kNothing});
    }
  return out;
}

}  // namespace sheaf
