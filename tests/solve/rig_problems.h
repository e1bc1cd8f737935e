// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "geometry/camera_model.h"
#include "geometry/rigid_motion.h"
#include "platform/random.h"
#include "scene/rigs.h"
#include "sheaf/problem.h"

namespace sheaf::test {

/// A rig of cameras that looks at a cloud of points from frames along an arc.
struct RigScene {
  std::uint32_t frames = 6, sensors = 2, points = 120;
  CameraModel model = CameraModel::opencv;
  bool shared_lens = false;      ///< one lens for all sensors
  bool camera_reference = true;  ///< the first sensor is the reference; else no camera is
  std::uint32_t free_images = 0;
  double pixel = 0.3, pose = 2e-3, sensor = 2e-3, point = 0.02;  ///< sigmas of noise and start
  std::uint64_t seed = 1;
};

inline Pose moved(const Pose& pose, double sigma, Random& random) {
  const auto draw = [&] {
    return Vector3<double>{sigma * random.normal(), sigma * random.normal(),
                           sigma * random.normal()};
  };
  const Vector3<double> rho = draw(), phi = draw();
  const auto to = left_perturbed<double>({pose.rotation, pose.translation}, rho, phi);
  return {to.rotation, to.translation};
}

inline Camera lens_of(CameraModel model) {
  Camera camera;
  camera.model = model;
  const ParameterRoles roles = roles_of(model);
  const auto set = [&](int at, double value) {
    if (at >= 0) camera.parameters[static_cast<std::size_t>(at)] = value;
  };
  set(roles.fx, 800), set(roles.fy, 810), set(roles.cx, 500), set(roles.cy, 400);
  set(roles.k1, -0.05), set(roles.k2, 0.01);
  camera.width_px = 1000, camera.height_px = 800;
  return camera;
}

/// As it was seen from the truth, and a start that is off.
inline Problem rig_problem(const RigScene& scene) {
  Problem p;
  Random random(scene.seed);
  p.rigs.count = 1;
  for (std::uint32_t s = 0; s < scene.sensors; ++s) {
    if (s == 0 || !scene.shared_lens) p.cameras.push_back(lens_of(scene.model));
    const double angle = 0.1 * s;
    Pose pose;
    if (s > 0 || !scene.camera_reference)
      pose = {{std::cos(angle / 2), 0, std::sin(angle / 2), 0}, {-0.5 * s - 0.1, 0.02 * s, 0.05}};
    p.rigs.sensor_from_rig.push_back(pose);
    p.rigs.sensor_rig.push_back(0);
    p.rigs.is_reference.push_back(s == 0 && scene.camera_reference);
  }
  const auto frame_at = [&](double where) {
    const double angle = 0.6 * (where - 0.5);
    return Pose{{std::cos(angle / 2), 0, std::sin(angle / 2), 0},
                {-4 * (where - 0.5), 0.3 * std::sin(9 * where), 6}};
  };
  for (std::uint32_t f = 0; f < scene.frames; ++f) {
    p.rigs.rig_from_world.push_back(frame_at((f + 0.5) / scene.frames));
    p.rigs.frame_rig.push_back(0);
    for (std::uint32_t s = 0; s < scene.sensors; ++s) {
      p.add_image(Pose{}, scene.shared_lens ? 0 : s);
      p.rigs.image_frame.push_back(f);
      p.rigs.image_sensor.push_back(s);
    }
  }
  for (std::uint32_t i = 0; i < scene.free_images; ++i) {
    p.add_image(frame_at(i / (scene.free_images + 1.0)), 0u);
    p.rigs.image_frame.push_back(Rigs::kNone);
    p.rigs.image_sensor.push_back(Rigs::kNone);
  }
  place_images(p);
  for (std::uint32_t j = 0; j < scene.points; ++j)
    p.add_point(random.uniform(-3, 3), random.uniform(-2, 2), random.uniform(-2, 3));
  for (std::uint32_t j = 0; j < scene.points; ++j)
    for (std::uint32_t i = 0; i < p.num_images(); ++i) {
      if (random.uniform() < 0.25) continue;
      const auto R = matrix_from_quaternion(p.poses[i].rotation);
      Vector3<double> P =
          multiply(R, Vector3<double>{p.points[3 * j], p.points[3 * j + 1], p.points[3 * j + 2]});
      for (std::size_t k = 0; k < 3; ++k) P[k] += p.poses[i].translation[k];
      const Projected seen = project(p.cameras[p.image_camera[i]], P);
      p.add_observation(i, j, seen.pixel[0] + scene.pixel * random.normal(),
                        seen.pixel[1] + scene.pixel * random.normal());
    }
  for (Pose& pose : p.rigs.rig_from_world) pose = moved(pose, scene.pose, random);
  for (std::size_t s = 0; s < p.rigs.num_sensors(); ++s)
    if (p.rigs.is_reference[s] == 0)
      p.rigs.sensor_from_rig[s] = moved(p.rigs.sensor_from_rig[s], scene.sensor, random);
  for (std::size_t i = 0; i < p.num_images(); ++i)
    if (!in_rig(p.rigs, i)) p.poses[i] = moved(p.poses[i], scene.pose, random);
  for (double& x : p.points) x += scene.point * random.normal();
  place_images(p);
  return p;
}

}  // namespace sheaf::test
