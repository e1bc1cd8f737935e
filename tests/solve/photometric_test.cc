// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/photometric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "geometry/rotation.h"
#include "report/errors.h"
#include "sheaf/sheaf.h"

namespace sheaf {
namespace {

/// After a Sim(3) by the camera centres: rotations, and where true points are seen from the
/// estimated poses.
struct Errors {
  double rotation_rad = 0, reprojection_px = 0;
};

Problem shell_of(const PhotometricProblem& p) {
  Problem out;
  for (const Pose& pose : p.poses) out.add_image(pose, Camera{});
  out.points = p.points;
  return out;
}

std::array<double, 2> project(const PhotometricProblem& p, std::size_t image, std::size_t point) {
  const Pose& pose = p.poses[image];
  const Vector3<double> P = multiply(
      matrix_from_quaternion(pose.rotation),
      Vector3<double>{p.points[3 * point], p.points[3 * point + 1], p.points[3 * point + 2]});
  const double z = P[2] + pose.translation[2];
  return {p.camera.fx * (P[0] + pose.translation[0]) / z + p.camera.cx,
          p.camera.fy * (P[1] + pose.translation[1]) / z + p.camera.cy};
}

/// Projections are free of gauge: the estimate's own points seen by its own poses.
Errors errors_of(const PhotometricProblem& estimate, const PhotometricProblem& truth) {
  Errors out;
  out.rotation_rad =
      compare_states(shell_of(estimate), shell_of(truth), true).value().rotation_error_rad.mean;
  std::size_t count = 0;
  for (std::size_t i = 0; i < truth.num_points(); ++i)
    for (std::size_t j = 0; j < truth.images.size(); ++j) {
      if (truth.host[i] == j) continue;
      const auto a = project(estimate, j, i), b = project(truth, j, i);
      if (b[0] < 8 || b[1] < 8 || b[0] > truth.images[j].width - 9 ||
          b[1] > truth.images[j].height - 9)
        continue;
      out.reprojection_px += std::hypot(a[0] - b[0], a[1] - b[1]);
      ++count;
    }
  out.reprojection_px /= static_cast<double>(count);
  return out;
}

TEST(Photometric, Explore) {
  const bool trace = std::getenv("TRACE");
  for (double start : {1.0, 3.0, 7.0})
    for (int levels : {1, 3})
      for (auto interpolation : {Interpolation::bicubic, Interpolation::bilinear})
        for (const char* pattern : {"4x4", "5x5"}) {
          PhotometricSceneOptions o;
          o.start_px = start;
          PhotometricScene scene = generate(o).value();
          PhotometricOptions options;
          options.interpolation = interpolation;
          options.pattern = pattern;
          options.levels = levels;
          options.affine_brightness = false;
          options.loss = Huber{10};
          if (trace)
            options.on_iteration = [](const Iteration& it) {
              std::printf("  %d cost %.6e %d gain %.3f lambda %.1e motion\n", it.index, it.cost,
                          it.accepted, it.gain_ratio, it.damping);
              return true;
            };
          const Errors before = errors_of(scene.start, scene.truth);
          const auto summary = refine_photometric(scene.start, options).value();
          const Errors after = errors_of(scene.start, scene.truth);
          std::printf(
              "start %.0f levels %d interp %d %s: %.3f px %.2e rad -> %.5f px %.2e rad; it %zu rms "
              "%.3f -> %.4f, %s %.2fs\n",
              start, levels, int(interpolation), pattern, before.reprojection_px,
              before.rotation_rad, after.reprojection_px, after.rotation_rad,
              summary.solve.iterations.size() - 1, summary.initial_rms_grey, summary.final_rms_grey,
              to_string(summary.solve.termination), summary.solve.solve_s);
        }
}

}  // namespace
}  // namespace sheaf
