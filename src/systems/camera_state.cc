// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/camera_state.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/camera_model.h"
#include "reduced/scaling.h"

namespace sheaf {
namespace {

double norm(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

/// A step up to a bound ends on it, whatever the sum rounds to.
double bounded(double value, double change, double lower, double upper) {
  if (change >= upper - value) return upper;
  return change <= lower - value ? lower : value + change;
}

}  // namespace

void clear(CameraState& state) {
  state.poses.clear(), state.sets.clear(), state.sensors.clear(), state.frames.clear();
  state.kept.clear();
}

void camera_state(const Problem& problem, CameraState& out) {
  clear(out);
  out.poses.reserve(problem.num_images());
  for (const Pose& pose : problem.poses) out.poses.push_back({pose.rotation, pose.translation});
  out.sets.reserve(problem.cameras.size());
  for (const Camera& camera : problem.cameras) out.sets.push_back(camera.parameters);
  for (const Pose& pose : problem.rigs.sensor_from_rig)
    out.sensors.push_back({pose.rotation, pose.translation});
  for (const Pose& pose : problem.rigs.rig_from_world)
    out.frames.push_back({pose.rotation, pose.translation});
}

CameraState camera_state(const Problem& problem) {
  CameraState out;
  camera_state(problem, out);
  return out;
}

std::array<double, 3> centre_of(const RigidMotion<double>& pose) {
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  const auto& t = pose.translation;
  std::array<double, 3> out{};
  for (std::size_t k = 0; k < 3; ++k) out[k] = -(R[k] * t[0] + R[3 + k] * t[1] + R[6 + k] * t[2]);
  return out;
}

SceneFrame scene_frame(const CameraState& state) {
  SceneFrame out;
  const auto images = static_cast<double>(state.poses.size());
  for (const auto& pose : state.poses) {
    const std::array<double, 3> centre = centre_of(pose);
    for (std::size_t k = 0; k < 3; ++k) out.origin[k] += centre[k];
  }
  for (double& x : out.origin) x /= images;
  double length = 0;
  for (const auto& pose : state.poses) {
    const std::array<double, 3> centre = centre_of(pose);
    length +=
        std::hypot(centre[0] - out.origin[0], centre[1] - out.origin[1], centre[2] - out.origin[2]);
  }
  out.unit = towards_one(length / images);
  return out;
}

void store(const CameraState& state, Problem& problem) {
  for (std::size_t i = 0; i < state.poses.size(); ++i) {
    problem.poses[i].rotation = state.poses[i].rotation;
    problem.poses[i].translation = state.poses[i].translation;
  }
  for (std::size_t c = 0; c < state.sets.size(); ++c) problem.cameras[c].parameters = state.sets[c];
  for (std::size_t s = 0; s < state.sensors.size(); ++s)
    problem.rigs.sensor_from_rig[s] = {state.sensors[s].rotation, state.sensors[s].translation};
  for (std::size_t f = 0; f < state.frames.size(); ++f)
    problem.rigs.rig_from_world[f] = {state.frames[f].rotation, state.frames[f].translation};
}

CameraColumns::CameraColumns(const Columns& columns, std::size_t images) : poses_(images) {
  for (std::size_t i = 0; i < images; ++i) std::copy_n(columns.image(i), 6, poses_[i].begin());
}

void CameraColumns::add(Parameter parameter) {
  if (parameter.column >= 0) parameters_.push_back(parameter);
}

CameraColumns CameraColumns::of_bal(const Columns& columns,
                                    const std::vector<std::uint32_t>& image_camera) {
  CameraColumns out(columns, columns.num_images());
  std::vector<char> seen;
  for (std::size_t i = 0; i < columns.num_images(); ++i) {
    const std::uint32_t lens = image_camera[i];
    if (seen.size() <= lens) seen.resize(lens + std::size_t(1), false);
    if (std::exchange(seen[lens], true)) continue;
    const std::int32_t* c = columns.image(i) + 6;
    out.add({lens, 0, 0, 1, c[0]});
    for (std::uint8_t k : {1, 2}) out.add({lens, k, Parameter::kNone, 1, c[k]});
  }
  return out;
}

/// Lengths in pixels change relative to the focal length.
CameraColumns CameraColumns::of_lenses(const Columns& columns, const LensTracks& tracks) {
  CameraColumns out(columns, tracks.image_lens.size());
  std::vector<char> seen(tracks.lenses.size(), false);
  for (std::size_t i = 0; i < tracks.image_lens.size(); ++i) {
    const std::uint32_t lens = tracks.image_lens[i];
    if (std::exchange(seen[lens], true)) continue;
    const LensPlaces& places = tracks.lenses[lens];
    const ParameterRoles roles = roles_of(places.model);
    for (std::size_t p = 0; p < places.place.size(); ++p) {
      const int place = places.place[p], index = static_cast<int>(p);
      if (place < 0) continue;
      const std::int32_t* c = columns.image(i) + 6 + place;
      if (place >= LensPlaces::kRiders)
        c = columns.image(places.first_block) + (place - LensPlaces::kRiders);
      const bool length =
          index == roles.fx || index == roles.fy || index == roles.cx || index == roles.cy;
      out.add({lens, static_cast<std::uint8_t>(p),
               static_cast<std::int8_t>(length ? roles.fx : Parameter::kNone), 1, *c});
    }
  }
  return out;
}

void CameraColumns::add_kept(const Columns& columns, std::size_t first_block, std::size_t count) {
  for (std::size_t j = 0; j < count; ++j) {
    const std::int32_t* c = columns.image(first_block + j);
    kept_.push_back({c[0], c[1], c[2]});
  }
}

void CameraColumns::keep_within(const std::vector<ParameterBound>& bounds) {
  for (const ParameterBound& bound : bounds)
    for (Parameter& p : parameters_)
      if (p.set == bound.camera && p.index == bound.parameter) {
        p.lower = bound.lower;
        p.upper = bound.upper;
      }
}

std::vector<StepBound> CameraColumns::step_bounds(const CameraState& from) const {
  std::vector<StepBound> out;
  for (const Parameter& p : parameters_) {
    const double value = from.sets[p.set][p.index];
    if (std::isfinite(p.lower) || std::isfinite(p.upper))
      out.push_back({p.column, p.lower - value, p.upper - value});
  }
  return out;
}

CameraColumns CameraColumns::of_brightness(const Columns& columns) {
  CameraColumns out(columns, columns.num_images());
  for (std::size_t i = 0; i < columns.num_images(); ++i) {
    const std::int32_t* c = columns.image(i) + 6;
    out.add({static_cast<std::uint32_t>(i), 0, Parameter::kNone, 1, c[0]});
    out.add({static_cast<std::uint32_t>(i), 1, Parameter::kNone, 255, c[1]});
  }
  return out;
}

CameraColumns CameraColumns::through(const BlockMap& map, const Rigs& rigs) const {
  const auto columns_of = [&](std::uint32_t block) {
    std::array<std::int32_t, 6> out;
    out.fill(Columns::kFixed);
    if (block != BlockMap::kNone) std::copy_n(map.columns.image(block), 6, out.begin());
    return out;
  };
  CameraColumns out = *this;
  out.parameters_.clear();
  for (Parameter p : parameters_) {
    p.column = map.solved_column[static_cast<std::size_t>(p.column)];
    out.add(p);
  }
  for (std::array<std::int32_t, 3>& c : out.kept_)
    for (std::int32_t& k : c) k = k < 0 ? k : map.solved_column[static_cast<std::size_t>(k)];
  for (std::size_t i = 0; i < poses_.size(); ++i) out.poses_[i] = columns_of(map.image_block[i]);
  for (const std::uint32_t block : map.sensor_block) out.sensors_.push_back(columns_of(block));
  for (const std::uint32_t block : map.frame_block) out.frames_.push_back(columns_of(block));
  for (const std::uint32_t i : map.moved_images) {
    const Mounted of{i, rigs.image_frame[i], rigs.image_sensor[i]};
    if (map.frame_block[of.frame] != BlockMap::kNone ||
        map.sensor_block[of.sensor] != BlockMap::kNone)
      out.mounted_.push_back(of);
  }
  return out;
}

double CameraColumns::step_poses(const PoseColumns& columns,
                                 const std::vector<RigidMotion<double>>& from,
                                 const Buffer<double>& x,
                                 std::vector<RigidMotion<double>>& to) const {
  double largest = 0;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    const std::array<std::int32_t, 6>& c = columns[i];
    const RigidMotion<double>& pose = from[i];
    to[i] = pose;
    if (c[0] < 0) continue;
    std::array<double, 6> d;
    for (std::size_t k = 0; k < 6; ++k) d[k] = x[static_cast<std::size_t>(c[k])];
    to[i] = left_perturbed(pose, {d[0], d[1], d[2]}, {d[3], d[4], d[5]});
    const auto& t = pose.translation;
    largest = std::max({largest, norm(d[3], d[4], d[5]),
                        norm(d[0], d[1], d[2]) / (norm(t[0], t[1], t[2]) + 1e-300)});
  }
  return largest;
}

double CameraColumns::step(const CameraState& from, const Buffer<double>& x,
                           CameraState& to) const {
  double largest = step_poses(poses_, from.poses, x, to.poses);
  largest = std::max(largest, step_poses(sensors_, from.sensors, x, to.sensors));
  largest = std::max(largest, step_poses(frames_, from.frames, x, to.frames));
  for (const Mounted& of : mounted_)
    to.poses[of.image] = composed(to.sensors[of.sensor], to.frames[of.frame]);
  to.kept = from.kept;
  for (std::size_t j = 0; j < kept_.size(); ++j) {
    if (kept_[j][0] < 0) continue;
    double moved = 0, length = 1e-300;
    for (std::size_t k = 0; k < 3; ++k) {
      const double d = x[static_cast<std::size_t>(kept_[j][k])];
      to.kept[j][k] += d;
      moved += d * d, length += from.kept[j][k] * from.kept[j][k];
    }
    largest = std::max(largest, std::sqrt(moved / length));
  }
  to.sets = from.sets;
  for (const Parameter& p : parameters_) {
    const double change = x[static_cast<std::size_t>(p.column)];
    const CameraState::Parameters& held = from.sets[p.set];
    const double unit = p.relative_to >= 0
                            ? std::abs(held[static_cast<std::size_t>(p.relative_to)]) + 1e-300
                            : p.unit;
    to.sets[p.set][p.index] = bounded(held[p.index], change, p.lower, p.upper);
    largest = std::max(largest, std::abs(change) / unit);
  }
  return largest;
}

}  // namespace sheaf
