// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include "geometry/bal_camera.h"
#include "geometry/rigid_motion.h"

namespace sheaf {
namespace {

/// move(problem, x) puts one parameter x away from where it is.
using Move = std::function<void(Problem&, double)>;

double derivative_ratio(const Problem& problem, const Move& move) {
  const auto cost = [&](double x) {
    Problem moved = problem;
    move(moved, x);
    return evaluate(moved).cost;
  };
  const double middle = evaluate(problem).cost;
  // A first step gauges the curvature, the second is then a fair part of a pixel over all rows.
  double h = 1e-6, curvature = 0;
  for (int round = 0; round < 3; ++round) {
    const double up = cost(h), down = cost(-h);
    curvature = (up - 2 * middle + down) / (h * h);
    if (round == 2 && curvature > 0) return std::abs(up - down) / (2 * h) / std::sqrt(curvature);
    h = curvature > 0 ? 0.03 / std::sqrt(curvature) : 10 * h;
  }
  return 0;
}

Move pose_move(std::size_t image, int k) {
  return [=](Problem& p, double x) {
    Vector3<double> rho{}, phi{};
    (k < 3 ? rho[k] : phi[k - 3]) = x;
    Pose& pose = p.poses[image];
    const auto moved =
        left_perturbed(RigidMotion<double>{pose.rotation, pose.translation}, rho, phi);
    pose = {moved.rotation, moved.translation};
  };
}

bool listed(const std::vector<std::uint32_t>& ids, std::size_t i) {
  return std::find(ids.begin(), ids.end(), i) != ids.end();
}

}  // namespace

Scene small_scene() {
  SceneOptions options;
  options.images = 12;
  options.points = 600;
  options.mean_track = 5;
  return generate(options).value();
}

Scene shared_lens_scene(std::uint32_t together, bool keep_unused) {
  Scene scene = small_scene();
  for (Problem* p : {&scene.truth, &scene.start}) {
    for (std::size_t i = 0; i < p->num_images(); ++i)
      p->image_camera[i] = static_cast<std::uint32_t>(i) / together;
    if (!keep_unused) p->cameras.resize(p->image_camera.back() + 1);
  }
  Problem& truth = scene.truth;
  for (std::size_t i = 0; i < truth.num_observations(); ++i) {
    const std::uint32_t image = truth.observation_image[i];
    const double* X = &truth.points[3 * std::size_t(truth.observation_point[i])];
    const auto& k = truth.cameras[truth.image_camera[image]].parameters;
    const auto R = matrix_from_quaternion(truth.poses[image].rotation);
    Vector3<double> P = multiply(R, Vector3<double>{X[0], X[1], X[2]});
    for (int j = 0; j < 3; ++j) P[j] += truth.poses[image].translation[j];
    const auto pixel = project(BalCamera<double>{k[0], k[1], k[2]}, P);
    for (int j = 0; j < 2; ++j) {  // the noise stays, the pixel moves
      const double moved = pixel[j] - truth.observation_xy[2 * i + j];
      truth.observation_xy[2 * i + j] += moved;
      scene.start.observation_xy[2 * i + j] += moved;
    }
  }
  return scene;
}

double scaled_gradient(const Problem& problem, const Fixed& fixed, std::size_t points) {
  double largest = 0;
  const auto take = [&](const Move& move) {
    largest = std::max(largest, derivative_ratio(problem, move));
  };
  for (std::size_t i = 0; i < problem.num_images(); ++i)
    for (int k = 0; k < 6 && !fixed.poses && !listed(fixed.pose_ids, i); ++k) take(pose_move(i, k));
  const bool held[3] = {fixed.f, fixed.k1, fixed.k2};
  for (std::size_t i = 0; i < problem.cameras.size(); ++i)
    for (int k = 0; k < 3; ++k)
      if (!held[k] && !listed(fixed.camera_ids, i))
        take([=](Problem& p, double x) { p.cameras[i].parameters[k] += x; });
  for (std::size_t i = 0; i < std::min(3 * points, problem.points.size()) && !fixed.points; ++i)
    take([=](Problem& p, double x) { p.points[i] += x; });
  return largest;
}

std::string real_data(const std::string& name) {
  const char* folder = std::getenv("SHEAF_DATA");
  const std::filesystem::path path =
      std::filesystem::path(folder != nullptr ? folder : SHEAF_SOURCE_DIR "/data") / "bal" / name;
  return std::filesystem::exists(path) ? path.string() : "";
}

}  // namespace sheaf
