// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/patch_comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "solve/patch_level.h"
#include "solve/photometric_rules.h"

namespace sheaf {
namespace {

/// By point; NaN where nothing is seen. All patches have as many pixels.
std::vector<double> rms_of_points(const PatchStage& stage, std::size_t points) {
  std::vector<double> sum(points, 0), count(points, 0);
  for (const PatchSight& sight : stage.seen) {
    sum[sight.point] += sight.rms_grey * sight.rms_grey;
    count[sight.point] += 1;
  }
  for (std::size_t i = 0; i < points; ++i)
    sum[i] = count[i] > 0 ? std::sqrt(sum[i] / count[i]) : std::numeric_limits<double>::quiet_NaN();
  return sum;
}

bool comes_before(const PatchSight& a, const PatchSight& b) {
  return a.point != b.point ? a.point < b.point : a.image < b.image;
}

}  // namespace

PatchStage stage_of(const PhotometricProblem& problem, const PhotometricOptions& options,
                    const PhotometricDetails& details) {
  return {state_of(problem, uses_rays(problem, options)), details.seen};
}

Result<PatchComparison> compare_patches(const PhotometricProblem& problem,
                                        const PhotometricOptions& options, PatchStage before,
                                        PatchStage after) {
  const Result<Pattern> pattern = check_photometric(problem, options);
  if (!pattern.ok()) return pattern.error();
  return PatchComparison{scene_of_level(problem, options, pattern.value(), 0), std::move(before),
                         std::move(after)};
}

std::vector<PatchFit> rank_patches(const PatchComparison& comparison) {
  const std::size_t points = comparison.after.state.points.size() / 3;
  const std::vector<double> before = rms_of_points(comparison.before, points);
  const std::vector<double> after = rms_of_points(comparison.after, points);
  std::vector<PatchFit> fits;
  for (std::size_t i = 0; i < points; ++i)
    if (!std::isnan(after[i])) fits.push_back({static_cast<std::uint32_t>(i), before[i], after[i]});
  std::stable_sort(fits.begin(), fits.end(),
                   [](const PatchFit& a, const PatchFit& b) { return a.after > b.after; });
  return fits;
}

PatchGreys greys_of(const PatchScene& scene, const PatchStage& stage, const Sight& sight) {
  PatchGreys out;
  const PatchSight key{sight.point, sight.image, 0, 0, 0};
  if (!std::binary_search(stage.seen.begin(), stage.seen.end(), key, comes_before)) return out;
  if (!patch_residuals(scene, stage.state, sight, out.residual)) return out;
  const double alpha = relative_brightness(scene, stage.state, sight).a;
  const float* reference = &scene.references[scene.grid.cells() * sight.point];
  for (std::size_t k = 0; k < out.residual.size(); ++k)
    out.grey.push_back(reference[scene.grid.place[k]] + out.residual[k] / alpha);
  return out;
}

}  // namespace sheaf
