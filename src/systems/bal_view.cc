// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/bal_view.h"

#include <algorithm>

#include "geometry/camera_model.h"
#include "platform/cancel.h"
#include "platform/parallel.h"
#include "scene/rigs.h"

namespace sheaf {

namespace {

/// Whether the images of each sensor are of BAL's model, or none is: the sensor is turned with
/// them.
bool sensors_agree(const Problem& problem) {
  std::vector<std::int8_t> turns(problem.rigs.num_sensors(), -1);
  for (std::size_t i = 0; i < problem.rigs.image_sensor.size(); ++i) {
    if (!in_rig(problem.rigs, i)) continue;
    const bool bal = problem.cameras[problem.image_camera[i]].model == CameraModel::bal;
    std::int8_t& of = turns[problem.rigs.image_sensor[i]];
    if (of >= 0 && of != (bal ? 0 : 1)) return false;
    of = bal ? 0 : 1;
  }
  return true;
}

}  // namespace

bool BalView::serves(const Problem& problem, const Fixed& fixed) {
  const std::vector<ParameterSet> held = held_parameters(problem, fixed);
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const auto view = radial_view(problem.cameras[c]);
    const ParameterSet principal = principal_point(problem.cameras[c].model);
    if (!view || !view->refinable || (held[c] & principal) != principal) return false;
  }
  return sensors_agree(problem);
}

BalView::BalView(const Problem& problem, const Fixed& fixed)
    : turns_(!has_only_bal_cameras(problem)), held_(held_parameters(problem, fixed)) {
  sensor_turns_.assign(problem.rigs.num_sensors(), 0);
  for (std::size_t i = 0; i < problem.rigs.image_sensor.size(); ++i)
    if (in_rig(problem.rigs, i)) sensor_turns_[problem.rigs.image_sensor[i]] = turns(problem, i);
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    views_.push_back(*radial_view(problem.cameras[c]));
    const ParameterRoles role = roles_of(problem.cameras[c].model);
    ParameterSet of_bal = 0;
    int to = 0;
    for (int from : {role.fx, role.k1, role.k2}) {
      const bool free = from >= 0 && (held_[c] >> from & 1) == 0;
      of_bal = static_cast<ParameterSet>(of_bal | (free ? 0 : 1) << to++);
    }
    held_[c] = of_bal;
  }
}

bool BalView::turns(const Problem& problem, std::size_t image) const {
  return problem.cameras[problem.image_camera[image]].model != CameraModel::bal;
}

void BalView::renew(const Problem& problem) {
  for (std::size_t c = 0; c < views_.size(); ++c) views_[c] = *radial_view(problem.cameras[c]);
}

void BalView::cameras(const Problem& problem, CameraState& out) const {
  clear(out);
  out.poses.reserve(problem.num_images());
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    Pose pose = problem.poses[i];
    if (turns(problem, i)) turn_round(pose, false);
    out.poses.push_back({pose.rotation, pose.translation});
  }
  for (std::size_t s = 0; s < problem.rigs.num_sensors(); ++s) {
    Pose pose = problem.rigs.sensor_from_rig[s];
    if (sensor_turns_[s] != 0) turn_round(pose, false);
    out.sensors.push_back({pose.rotation, pose.translation});
  }
  for (const Pose& pose : problem.rigs.rig_from_world)
    out.frames.push_back({pose.rotation, pose.translation});
  for (const RadialView& view : views_) out.sets.push_back({view.f, view.k1, view.k2});
}

std::array<double, 2> BalView::turned(const Problem& problem, std::size_t image,
                                      const std::array<double, 2>& xy) const {
  if (!turns(problem, image)) return xy;
  const RadialView& view = views_[problem.image_camera[image]];
  return {xy[0] - view.cx, view.cy - xy[1]};
}

void BalView::turn(const Problem& problem, Batches& batches, Threads& threads) const {
  if (!turns_) return;
  constexpr std::size_t kBatches = 8192;
  threads.for_ranges(batches.num_batches(), kBatches, [&](std::size_t b, std::size_t end) {
    poll_cancelled();
    for (; b < end; ++b)
      for (std::size_t l = 0; l < 8; ++l) {
        const std::uint32_t image = batches.image[8 * b + l];
        if (!turns(problem, image)) continue;
        const RadialView& view = views_[problem.image_camera[image]];
        double* xy = &batches.xy[16 * b + l];
        xy[0] -= view.cx;
        xy[8] = view.cy - xy[8];
      }
  });
}

void BalView::turn(const Problem& problem, ImageBatches& batches, Threads& threads) const {
  if (!turns_) return;
  constexpr std::size_t kPieces = 64;
  threads.for_ranges(batches.pieces.size(), kPieces, [&](std::size_t p, std::size_t end) {
    for (; p < end; ++p) {
      const ImageBatches::Piece& piece = batches.pieces[p];
      if (!turns(problem, piece.image)) continue;
      const RadialView& view = views_[problem.image_camera[piece.image]];
      for (std::uint64_t b = piece.first_batch; b < piece.first_batch + piece.batches; ++b) {
        double* xy = &batches.rows[ImageBatches::kBatchDoubles * b + 24];
        for (std::size_t l = 0; l < 8; ++l) {
          xy[l] -= view.cx;
          xy[8 + l] = view.cy - xy[8 + l];
        }
      }
    }
  });
}

void BalView::store(const CameraState& cameras, Problem& problem) const {
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    Pose& pose = problem.poses[i];
    pose.rotation = cameras.poses[i].rotation;
    pose.translation = cameras.poses[i].translation;
    if (turns(problem, i)) turn_round(pose, true);
  }
  for (std::size_t s = 0; s < problem.rigs.num_sensors(); ++s) {
    Pose& pose = problem.rigs.sensor_from_rig[s];
    pose = {cameras.sensors[s].rotation, cameras.sensors[s].translation};
    if (sensor_turns_[s] != 0) turn_round(pose, true);
  }
  for (std::size_t f = 0; f < problem.rigs.num_frames(); ++f)
    problem.rigs.rig_from_world[f] = {cameras.frames[f].rotation, cameras.frames[f].translation};
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    Camera& camera = problem.cameras[c];
    const CameraState::Parameters& refined = cameras.sets[c];
    if (camera.model == CameraModel::bal) {
      std::copy_n(refined.begin(), 3, camera.parameters.begin());
      continue;
    }
    camera.parameters[0] = refined[0];
    if (views_[c].has_k1) camera.parameters[3] = refined[1];
    if (views_[c].has_k2) camera.parameters[4] = refined[2];
  }
}

}  // namespace sheaf
