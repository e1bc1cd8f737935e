// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/lens_reach.h"

#include <algorithm>
#include <cmath>

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

std::vector<double> lengths_of(const std::vector<Offset>& offsets) {
  std::vector<double> out;
  out.reserve(offsets.size());
  for (const Offset& offset : offsets) {
    // std::hypot takes several times as long: it is for what would overflow.
    const double square = offset[0] * offset[0] + offset[1] * offset[1];
    out.push_back(square > 1e-280 && square < 1e280 ? std::sqrt(square) : length(offset));
  }
  return out;
}

/// The median length of each lens's offsets, or of all where a lens has few.
std::vector<double> medians_of(const Problem& problem, const std::vector<double>& lengths) {
  std::vector<std::vector<double>> own(problem.cameras.size());
  for (std::size_t i = 0; i < lengths.size(); ++i)
    own[problem.image_camera[problem.observation_image[i]]].push_back(lengths[i]);
  const bool some_have_few = std::any_of(own.begin(), own.end(),
                                         [](const auto& list) { return list.size() < kFewOfLens; });
  const double of_all = some_have_few ? range_of(lengths).median : 0;
  std::vector<double> medians;
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

std::size_t LensReach::sector_of(const Offset& offset) {
  const double x = offset[0], y = offset[1], wide = std::abs(x), tall = std::abs(y);
  if (y < 0) return x < 0 ? (tall < wide ? 0 : 1) : (wide < tall ? 2 : 3);
  if (x > 0 || (x == 0 && y == 0)) return tall < wide || y == 0 ? 4 : 5;
  if (y == 0) return 0;
  return wide < tall ? 6 : 7;
}

void LensReach::add(const Offset& offset) {
  std::array<double, 2>& known = offsets[sector_of(offset)];
  if (length(offset) > length(known)) known = offset;
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
  const std::vector<double> lengths = lengths_of(offsets);
  const std::vector<double> medians = medians_of(problem, lengths);
  MeasuredReaches out;
  std::vector<std::array<double, LensReach::kSectors>> farthest(problem.cameras.size());
  out.reaches.resize(problem.cameras.size());
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const std::uint32_t c = problem.image_camera[problem.observation_image[i]];
    const Camera& camera = problem.cameras[c];
    const double far = lengths[i];
    const bool absurd = size_known(camera) ? outside_image(camera, &problem.observation_xy[2 * i])
                                           : medians[c] > 0 && far > kAbsurd * medians[c];
    if (absurd) out.absurd.push_back(i);
    if (absurd || !(far <= kReach * medians[c])) continue;
    const std::size_t sector = LensReach::sector_of(offsets[i]);
    if (!(far > farthest[c][sector])) continue;
    farthest[c][sector] = far;
    out.reaches[c].offsets[sector] = offsets[i];
  }
  return out;
}

}  // namespace sheaf
