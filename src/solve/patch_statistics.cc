// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/patch_statistics.h"

#include <algorithm>
#include <cmath>

namespace sheaf {
namespace {

PatchStatistics::Grey grey_of(std::vector<double> residuals) {
  PatchStatistics::Grey out;
  if (residuals.empty()) return out;
  double sum = 0;
  for (double& r : residuals) {
    sum += r * r;
    r = std::abs(r);
  }
  const auto close = std::count_if(residuals.begin(), residuals.end(),
                                   [](double r) { return r <= PatchStatistics::kInlier; });
  out.inliers = static_cast<double>(close) / static_cast<double>(residuals.size());
  out.rms = std::sqrt(sum / static_cast<double>(residuals.size()));
  const auto middle = residuals.begin() + static_cast<std::ptrdiff_t>(residuals.size() / 2);
  std::nth_element(residuals.begin(), middle, residuals.end());
  out.median = *middle;
  return out;
}

double square_sum(const double* r, std::size_t count) {
  double sum = 0;
  for (std::size_t k = 0; k < count; ++k) sum += r[k] * r[k];
  return sum;
}

}  // namespace

PatchStatistics::PatchStatistics(const PatchScene& scene, const std::vector<Sight>& seen)
    : scene_(scene), seen_(seen) {
  scene_.taps = Taps::bilinear_central;
}

void PatchStatistics::measure_before(const PatchState& state) {
  std::vector<double> patch;
  first_.clear();
  first_.reserve(scene_.grid.place.size() * seen_.size());
  for (const Sight& sight : seen_) {
    patch_residuals(scene_, state, sight, patch);
    first_.insert(first_.end(), patch.begin(), patch.end());
  }
  before_ = grey_of(first_);
}

void PatchStatistics::measure_after(const PatchState& state) {
  const std::size_t pixels = scene_.grid.place.size();
  std::vector<double> now, patch;
  now.reserve(first_.size());
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    if (!patch_residuals(scene_, state, seen_[i], patch)) {
      ++left_;
      const double* first = &first_[pixels * i];
      patch.assign(first, first + pixels);
      const double mean = before_.rms * std::sqrt(static_cast<double>(pixels));
      const double size = std::sqrt(square_sum(first, pixels));
      if (size < mean) patch.assign(pixels, before_.rms);
    }
    now.insert(now.end(), patch.begin(), patch.end());
  }
  after_ = grey_of(std::move(now));
}

}  // namespace sheaf
