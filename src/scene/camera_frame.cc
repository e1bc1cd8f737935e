// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/camera_frame.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace sheaf {

std::optional<RadialView> radial_view(const Camera& camera) {
  const auto& k = camera.parameters;
  switch (camera.model) {
    case CameraModel::bal:
      return RadialView{k[0], k[1], k[2], 0, 0, true, true};
    case CameraModel::simple_pinhole:
      return RadialView{k[0], 0, 0, k[1], k[2]};
    case CameraModel::simple_radial:
      return RadialView{k[0], k[3], 0, k[1], k[2], true};
    case CameraModel::radial:
      return RadialView{k[0], k[3], k[4], k[1], k[2], true, true};
    case CameraModel::pinhole:
      if (k[0] != k[1]) return {};
      return RadialView{k[0], 0, 0, k[2], k[3], false, false, false};
    default:
      return {};
  }
}

void turn_round(Pose& pose, bool back) {
  // (0, 1, 0, 0) q: half a turn about x.
  const auto [w, x, y, z] = pose.rotation;
  pose.rotation = {-x, w, -z, y};
  if (back)
    for (double& q : pose.rotation) q = -q;
  pose.translation[1] = -pose.translation[1];
  pose.translation[2] = -pose.translation[2];
}

namespace {

/// The frame that a pose is from, as turn_round does with the one that it leads to.
void turn_round_source(Pose& pose, bool back) {
  const auto [w, x, y, z] = pose.rotation;
  pose.rotation = {x, -w, -z, y};
  if (back)
    for (double& q : pose.rotation) q = -q;
}

/// Of rigs whose images are turned: a rig turns with its reference.
void turn_rigs(Rigs& rigs, const std::vector<bool>& turned_image, bool back) {
  std::vector<bool> turned(rigs.num_sensors(), false), turned_rig(rigs.count, false);
  for (std::size_t j = 0; j < rigs.image_sensor.size(); ++j)
    if (rigs.image_sensor[j] != Rigs::kNone && turned_image[j]) turned[rigs.image_sensor[j]] = true;
  for (std::size_t s = 0; s < turned.size(); ++s)
    if (rigs.is_reference[s] != 0 && turned[s]) turned_rig[rigs.sensor_rig[s]] = true;
  for (std::size_t s = 0; s < turned.size(); ++s) {
    if (rigs.is_reference[s] != 0) continue;
    if (turned[s]) turn_round(rigs.sensor_from_rig[s], back);
    if (turned_rig[rigs.sensor_rig[s]]) turn_round_source(rigs.sensor_from_rig[s], back);
  }
  for (std::size_t f = 0; f < rigs.num_frames(); ++f)
    if (turned_rig[rigs.frame_rig[f]]) turn_round(rigs.rig_from_world[f], back);
}

}  // namespace

bool has_bal_cameras(const Problem& problem) {
  return std::any_of(problem.cameras.begin(), problem.cameras.end(),
                     [](const Camera& c) { return c.model == CameraModel::bal; });
}

bool has_only_bal_cameras(const Problem& problem) {
  return std::all_of(problem.cameras.begin(), problem.cameras.end(),
                     [](const Camera& c) { return c.model == CameraModel::bal; });
}

Result<void> to_bal_cameras(Problem& problem) {
  std::vector<RadialView> views;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const auto view = radial_view(problem.cameras[c]);
    if (!view)
      return Error(ErrorCode::usage,
                   "camera " + std::to_string(c) + " is " +
                       std::string(to_string(problem.cameras[c].model)) +
                       ", which the formula of BAL files (f, k1, k2) does not describe");
    views.push_back(*view);
  }
  const auto turned = [&](std::uint32_t image) {
    return problem.cameras[problem.image_camera[image]].model != CameraModel::bal;
  };
  std::vector<bool> turned_images(problem.num_images(), false);
  for (std::uint32_t j = 0; j < problem.num_images(); ++j) {
    if (!turned(j)) continue;
    turn_round(problem.poses[j], false);
    turned_images[j] = true;
  }
  turn_rigs(problem.rigs, turned_images, false);
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::uint32_t image = problem.observation_image[i];
    if (!turned(image)) continue;
    const RadialView& view = views[problem.image_camera[image]];
    double* xy = &problem.observation_xy[2 * i];
    xy[0] -= view.cx;
    xy[1] = view.cy - xy[1];
  }
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    Camera& camera = problem.cameras[c];
    camera.model = CameraModel::bal;
    camera.parameters = {views[c].f, views[c].k1, views[c].k2};
  }
  return {};
}

void from_bal_cameras(Problem& problem) {
  std::vector<std::array<double, 2>> reach(problem.cameras.size(), {0, 0});
  const auto is_bal = [&](std::uint32_t image) {
    return problem.cameras[problem.image_camera[image]].model == CameraModel::bal;
  };
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::uint32_t image = problem.observation_image[i];
    if (!is_bal(image)) continue;
    double* xy = &problem.observation_xy[2 * i];
    xy[1] = -xy[1];
    for (std::size_t k = 0; k < 2; ++k) {
      double& r = reach[problem.image_camera[image]][k];
      r = std::max(r, std::abs(xy[k]));
    }
  }
  std::vector<bool> turned(problem.num_images(), false);
  for (std::uint32_t j = 0; j < problem.num_images(); ++j) {
    if (!is_bal(j)) continue;
    turn_round(problem.poses[j], true);
    turned[j] = true;
  }
  turn_rigs(problem.rigs, turned, true);
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    Camera& camera = problem.cameras[c];
    if (camera.model != CameraModel::bal) continue;
    const auto size = [](double r) {
      return static_cast<std::uint64_t>(2 * std::ceil(std::min(r, 5e8)));
    };
    camera.model = CameraModel::radial;
    camera.parameters = {camera.parameters[0], 0, 0, camera.parameters[1], camera.parameters[2]};
    camera.width_px = size(reach[c][0]);
    camera.height_px = size(reach[c][1]);
  }
}

Result<const Problem*> with_bal_cameras(const Problem& problem, Problem& turned) {
  if (has_only_bal_cameras(problem)) return &problem;
  turned = problem;
  if (Result<void> done = to_bal_cameras(turned); !done.ok()) return done.error();
  return &turned;
}

const Problem* without_bal_cameras(const Problem& problem, Problem& turned) {
  if (!has_bal_cameras(problem)) return &problem;
  turned = problem;
  from_bal_cameras(turned);
  return &turned;
}

}  // namespace sheaf
