// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/rig_findings.h"

#include <cmath>
#include <string>

#include "geometry/rotation.h"
#include "scene/rigs.h"

namespace sheaf {
namespace {

using Numbers = std::vector<std::uint64_t>;

constexpr std::uint32_t kFewPoints = 10;  ///< of a frame: 6 unknowns of its pose and some to spare
constexpr std::uint32_t kFewFrames = 5;   ///< of a sensor

std::vector<std::uint32_t> observations_of_images(const Problem& problem) {
  std::vector<std::uint32_t> counts(problem.num_images(), 0);
  for (const std::uint32_t j : problem.observation_image) ++counts[j];
  return counts;
}

void check_frames(const Problem& problem, const std::vector<std::uint32_t>& observed,
                  FindingList& list) {
  const Rigs& rigs = problem.rigs;
  const std::vector<std::uint8_t> trivial = trivial_frames(rigs);
  std::vector<std::uint64_t> images(rigs.num_frames(), 0), seen(rigs.num_frames(), 0);
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    if (!in_rig(rigs, j)) continue;
    ++images[rigs.image_frame[j]];
    seen[rigs.image_frame[j]] += observed[j];
  }
  Numbers empty, blind, weak;
  for (std::size_t f = 0; f < rigs.num_frames(); ++f) {
    if (images[f] == 0) empty.push_back(f);
    if (images[f] == 0 || trivial[f] != 0) continue;
    if (seen[f] == 0) blind.push_back(f);
    if (seen[f] > 0 && seen[f] < kFewPoints) weak.push_back(f);
  }
  list.add("empty-frames", false, "frames", empty,
           plural(empty.size(), "frame of a rig has", "frames of rigs have") +
               " no images: nothing determines their poses, they stay as they are");
  list.add("blind-frames", true, "frames", blind,
           plural(blind.size(), "frame's images observe", "frames' images observe") +
               " nothing: nothing determines their poses, they stay as they are");
  list.add("weak-frames", true, "frames", weak,
           plural(weak.size(), "frame's images observe", "frames' images observe") +
               " fewer than " + std::to_string(kFewPoints) +
               " points in all: their poses are weak or not determined; find more matches, or "
               "leave them out");
}

/// Frames in which a sensor observes something and another one does too: only these say where the
/// sensor is on its rig.
std::vector<std::uint64_t> shared_frames(const Problem& problem,
                                         const std::vector<std::uint32_t>& observed) {
  const Rigs& rigs = problem.rigs;
  std::vector<std::uint32_t> seeing(rigs.num_frames(), 0);
  const auto sees = [&](std::size_t j) { return in_rig(rigs, j) && observed[j] > 0; };
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    if (sees(j)) ++seeing[rigs.image_frame[j]];
  std::vector<std::uint64_t> frames(rigs.num_sensors(), 0);
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    if (sees(j) && seeing[rigs.image_frame[j]] > 1) ++frames[rigs.image_sensor[j]];
  return frames;
}

void check_sensors(const Problem& problem, const std::vector<std::uint32_t>& observed,
                   FindingList& list) {
  const Rigs& rigs = problem.rigs;
  std::vector<std::uint64_t> images(rigs.num_sensors(), 0);
  std::vector<bool> has_images(rigs.count, false), has_reference(rigs.count, false);
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    if (!in_rig(rigs, j)) continue;
    const std::uint32_t sensor = rigs.image_sensor[j];
    ++images[sensor];
    has_images[rigs.sensor_rig[sensor]] = true;
    if (rigs.is_reference[sensor] != 0) has_reference[rigs.sensor_rig[sensor]] = true;
  }
  const std::vector<std::uint64_t> shared = shared_frames(problem, observed);
  Numbers empty, loose, weak, headless;
  for (std::size_t s = 0; s < rigs.num_sensors(); ++s) {
    if (images[s] == 0) empty.push_back(s);
    if (images[s] == 0 || rigs.is_reference[s] != 0) continue;
    if (shared[s] == 0) loose.push_back(s);
    if (shared[s] > 0 && shared[s] < kFewFrames) weak.push_back(s);
  }
  for (std::size_t r = 0; r < rigs.count; ++r)
    if (has_images[r] && !has_reference[r]) headless.push_back(r);
  list.add("empty-sensors", false, "sensors", empty,
           plural(empty.size(), "sensor of a rig has", "sensors of rigs have") +
               " no images: nothing determines where they are, they stay as they are");
  list.add("loose-sensors", true, "sensors", loose,
           plural(loose.size(), "sensor shares", "sensors share") +
               " no frame with another sensor that observes something: where they are on their "
               "rigs is not determined; hold them (--fix sensor_from_rig=ID)");
  list.add("weak-sensors", false, "sensors", weak,
           plural(weak.size(), "sensor shares", "sensors share") + " fewer than " +
               std::to_string(kFewFrames) +
               " frames with another sensor: where they are on their rigs is weak; hold them if "
               "they are calibrated (--fix sensor_from_rig=ID)");
  list.add("rigs-without-reference", false, "rigs", headless,
           plural(headless.size(), "rig has", "rigs have") +
               " images, and none of the reference: frames and sensors could trade their poses, so "
               "that COLMAP holds sensor_from_rig there; hold it too (--fix sensor_from_rig)");
}

}  // namespace

void check_rigs(const Problem& problem, FindingList& list) {
  if (problem.rigs.empty()) return;
  const std::vector<std::uint32_t> observed = observations_of_images(problem);
  check_frames(problem, observed, list);
  check_sensors(problem, observed, list);
}

std::vector<std::uint32_t> rigid_frames_of(const Problem& problem) {
  const Rigs& rigs = problem.rigs;
  std::vector<std::uint32_t> frames(problem.num_images(), Rigs::kNone);
  const std::vector<std::uint8_t> trivial = trivial_frames(rigs);
  for (std::size_t j = 0; j < frames.size(); ++j)
    if (in_rig(rigs, j) && trivial[rigs.image_frame[j]] == 0) frames[j] = rigs.image_frame[j];
  return frames;
}

PoseGaps pose_gaps(const Problem& problem) {
  PoseGaps out;
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    const Pose &stated = problem.poses[j], given = pose_of(problem, j);
    const Quaternion<double>& q = given.rotation;
    const Quaternion<double> back{q[0], -q[1], -q[2], -q[3]};
    const Quaternion<double> turn = multiply(stated.rotation, back);
    const Vector3<double> phi = angle_axis_from_quaternion(turn);
    // |C - C'| = |t - R R'^T t'|, as rotations keep lengths.
    const Vector3<double> t = multiply(matrix_from_quaternion(normalized(turn)), given.translation);
    const auto length = [](double x, double y, double z) {
      return std::sqrt(x * x + y * y + z * z);
    };
    const bool apart = in_rig(problem.rigs, j);
    out.rotation_rad.push_back(apart ? length(phi[0], phi[1], phi[2]) : 0);
    out.center.push_back(apart ? length(stated.translation[0] - t[0], stated.translation[1] - t[1],
                                        stated.translation[2] - t[2])
                               : 0);
  }
  return out;
}

}  // namespace sheaf
