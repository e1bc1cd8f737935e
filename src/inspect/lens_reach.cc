// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/lens_reach.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/camera_model.h"
#include "inspect/statistics.h"

namespace sheaf {
namespace {

constexpr double kAbsurd = 100, kReach = 10;  ///< times the median distance
constexpr std::size_t kFewOfLens = 10;

/// Where the middle of the image is; BAL's pixels count from there.
std::array<double, 2> middle_of(const Camera& camera) {
  if (camera.model == CameraModel::bal) return {0, 0};
  return {static_cast<double>(camera.width_px) / 2, static_cast<double>(camera.height_px) / 2};
}

bool size_known(const Camera& camera) { return camera.width_px > 0 && camera.height_px > 0; }

using Offset = std::array<double, 2>;

double length(const Offset& offset) { return std::hypot(offset[0], offset[1]); }

/// Of each observation from the principal point of its lens.
std::vector<Offset> offsets_of(const Problem& problem) {
  std::vector<Offset> centres, out;
  for (const Camera& camera : problem.cameras) centres.push_back(principal_point_of(camera));
  out.reserve(problem.num_observations());
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const Offset& centre = centres[problem.image_camera[problem.observation_image[i]]];
    out.push_back(
        {problem.observation_xy[2 * i] - centre[0], problem.observation_xy[2 * i + 1] - centre[1]});
  }
  return out;
}

/// The median length of each lens's offsets, or of all where a lens has few.
std::vector<double> medians_of(const Problem& problem, const std::vector<Offset>& offsets) {
  std::vector<std::vector<double>> own(problem.cameras.size());
  std::vector<double> all, medians;
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    all.push_back(length(offsets[i]));
    own[problem.image_camera[problem.observation_image[i]]].push_back(all.back());
  }
  const double of_all = range_of(std::move(all)).median;
  for (std::vector<double>& list : own)
    medians.push_back(list.size() < kFewOfLens ? of_all : range_of(std::move(list)).median);
  return medians;
}

bool outside_image(const Camera& camera, const double* pixel) {
  const Offset middle = middle_of(camera);
  return std::abs(pixel[0] - middle[0]) > 1.5 * static_cast<double>(camera.width_px) ||
         std::abs(pixel[1] - middle[1]) > 1.5 * static_cast<double>(camera.height_px);
}

}  // namespace

void LensReach::add(const Offset& offset) {
  const double turn = std::atan2(offset[1], offset[0]) / (2 * std::numbers::pi) + 0.5;
  if (!(turn >= 0)) return;  // not a number
  const std::size_t sector = static_cast<std::size_t>(turn * kSectors) % kSectors;
  if (length(offset) > length(offsets[sector])) offsets[sector] = offset;
}

double LensReach::farthest() const {
  double out = 0;
  for (const auto& offset : offsets) out = std::max(out, length(offset));
  return out;
}

LensReach reach_of_corners(const Camera& camera) {
  LensReach reach;
  if (!size_known(camera)) return reach;
  const auto centre = principal_point_of(camera), middle = middle_of(camera);
  const double half_width = static_cast<double>(camera.width_px) / 2;
  const double half_height = static_cast<double>(camera.height_px) / 2;
  for (const double x : {-half_width, half_width})
    for (const double y : {-half_height, half_height})
      reach.add({middle[0] + x - centre[0], middle[1] + y - centre[1]});
  return reach;
}

MeasuredReaches measured_reaches(const Problem& problem) {
  const std::vector<Offset> offsets = offsets_of(problem);
  const std::vector<double> medians = medians_of(problem, offsets);
  MeasuredReaches out;
  out.reaches.resize(problem.cameras.size());
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const std::uint32_t c = problem.image_camera[problem.observation_image[i]];
    const Camera& camera = problem.cameras[c];
    const double far = length(offsets[i]);
    const bool absurd = size_known(camera) ? outside_image(camera, &problem.observation_xy[2 * i])
                                           : medians[c] > 0 && far > kAbsurd * medians[c];
    if (absurd) out.absurd.push_back(i);
    if (!absurd && far <= kReach * medians[c]) out.reaches[c].add(offsets[i]);
  }
  return out;
}

}  // namespace sheaf
