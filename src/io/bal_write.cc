// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/rotation.h"
#include "io/bal.h"
#include "io/text_buffer.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

Vector3<double> rotation_of(const Problem& problem, std::size_t image) {
  if (const auto stated = stated_rotation(problem, image)) return *stated;
  return angle_axis_from_quaternion(problem.poses[image].rotation);
}

}  // namespace

Result<void> write_bal(const Problem& problem, OutputFile& out) {
  TextBuffer text(out);
  text.put(problem.num_images(), ' ');
  text.put(problem.num_points(), ' ');
  text.put(problem.num_observations(), '\n');
  for (std::size_t i = 0; i < problem.num_observations() && !out.failed(); ++i) {
    text.put(problem.observation_image[i], ' ');
    text.put(problem.observation_point[i], ' ');
    text.put(problem.observation_xy[2 * i], ' ');
    text.put(problem.observation_xy[2 * i + 1], '\n');
  }
  for (std::size_t i = 0; i < problem.num_images() && !out.failed(); ++i) {
    for (double v : rotation_of(problem, i)) text.put(v, '\n');
    for (double v : problem.poses[i].translation) text.put(v, '\n');
    const Camera& camera = problem.cameras[problem.image_camera[i]];
    for (std::size_t k = 0; k < 3; ++k) text.put(camera.parameters[k], '\n');
  }
  for (std::size_t i = 0; i < problem.points.size() && !out.failed(); ++i)
    text.put(problem.points[i], '\n');
  text.flush();
  return out.commit();
}

}  // namespace sheaf
