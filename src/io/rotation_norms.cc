// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/rotation_norms.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "io/colmap_rigs.h"
#include "scene/source_files.h"

namespace sheaf {
namespace {

constexpr double kByDigits = 1e-4;

double off(const double* numbers, std::size_t count) {
  double squares = 0;
  for (std::size_t k = 0; k < count; ++k) squares += numbers[k] * numbers[k];
  return std::abs(std::sqrt(squares) - 1);
}

/// Of each image the rotation that its file stated, the worst row of a matrix.
std::vector<double> stated_by_images(const Problem& problem) {
  const std::vector<double>& all = problem.metadata->stated_rotations;
  std::vector<double> out(problem.num_images(), 0);
  const bool matrices = all.size() == 9 * out.size();
  const std::size_t length = matrices ? 3 : 4, rows = matrices ? 3 : 1;
  if (all.size() != length * rows * out.size()) return out;
  for (std::size_t j = 0; j < out.size(); ++j)
    for (std::size_t r = 0; r < rows; ++r)
      out[j] = std::max(out[j], off(&all[(j * rows + r) * length], length));
  return out;
}

/// The same by frames and sensors, which hold where there are any.
void add_rigs(const Problem& problem, const ColmapRigs& rigs, std::vector<double>& out) {
  std::unordered_map<std::uint64_t, std::size_t> image_of_id;
  for (std::size_t j = 0; j < problem.metadata->image_ids.size(); ++j)
    image_of_id[problem.metadata->image_ids[j]] = j;
  std::unordered_map<std::uint32_t, const RigRecord*> rig_of_id;
  for (const RigRecord& rig : rigs.rigs) rig_of_id[rig.id] = &rig;
  for (const FrameRecord& frame : rigs.frames)
    for (const FrameDatum& datum : frame.data) {
      const auto image = image_of_id.find(datum.id);
      if (datum.type != SensorType::camera || image == image_of_id.end()) continue;
      double& worst = out[image->second] = off(frame.pose.data(), 4);
      const auto rig = rig_of_id.find(frame.rig);
      if (rig == rig_of_id.end()) continue;
      for (const RigSensor& sensor : rig->second->sensors)
        if (sensor.type == SensorType::camera && sensor.id == datum.sensor && sensor.pose)
          worst = std::max(worst, off(sensor.pose->data(), 4));
    }
}

}  // namespace

OffNorms off_norms(const Problem& problem) {
  OffNorms out;
  if (problem.metadata == nullptr) return out;
  std::vector<double> norms = stated_by_images(problem);
  if (problem.metadata->source) add_rigs(problem, parse_rigs(*problem.metadata->source), norms);
  for (std::size_t j = 0; j < norms.size(); ++j) {
    if (norms[j] > kByDigits) out.images.push_back(j);
    out.largest = std::max(out.largest, norms[j]);
  }
  return out;
}

}  // namespace sheaf
