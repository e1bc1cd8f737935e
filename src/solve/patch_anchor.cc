// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/patch_anchor.h"

#include <cmath>

#include "solve/patch_level.h"

namespace sheaf {

std::vector<Measurement> measurements_of(const PhotometricProblem& problem,
                                         const PhotometricOptions& options) {
  std::vector<Measurement> out;
  if (std::isinf(options.anchor_px)) return out;
  const bool rays = uses_rays(problem, options);
  for (std::size_t i = 0; i < problem.num_measurements(); ++i) {
    const std::uint32_t point = problem.measured_point[i], image = problem.measured_image[i];
    if (rays && problem.host[point] == image) continue;
    out.push_back({point, image, problem.measured_xy[2 * i], problem.measured_xy[2 * i + 1]});
  }
  return out;
}

Anchor anchor_of_level(const std::vector<Measurement>& measurements, const PatchScene& scene,
                       const PatchState& state, const PhotometricOptions& options, int level,
                       double sigma_grey) {
  Anchor anchor;
  anchor.sigma_px = std::ldexp(options.anchor_px, -level);
  anchor.sigma_grey = sigma_grey;
  anchor.loss = {options.anchor_loss.kind, options.anchor_loss.scale_px};
  for (Measurement of : measurements) {
    if (!(place_patch(scene, state, {of.point, of.image}).depth > 0)) continue;
    for (int l = 0; l < level; ++l) of.x = halved(of.x), of.y = halved(of.y);
    anchor.measurements.push_back(of);
  }
  return anchor;
}

double rms_of(const std::vector<Measurement>& measurements, const PatchScene& scene,
              const PatchState& state) {
  if (measurements.empty()) return 0;
  double sum = 0;
  for (const Measurement& of : measurements) {
    const PatchPlace at = place_patch(scene, state, {of.point, of.image});
    sum += (at.x - of.x) * (at.x - of.x) + (at.y - of.y) * (at.y - of.y);
  }
  return std::sqrt(sum / static_cast<double>(measurements.size()));
}

Result<void> check_anchor(const PhotometricProblem& problem, const PhotometricOptions& options) {
  if (std::isinf(options.anchor_px) || problem.num_measurements() > 0) return {};
  return Error(ErrorCode::usage,
               "an anchor needs measured positions of points in images, and there are none");
}

}  // namespace sheaf
