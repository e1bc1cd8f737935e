// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/scenes.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <numbers>

#include "geometry/camera_model.h"
#include "geometry/rigid_motion.h"
#include "platform/random.h"
#include "starts/sights.h"

namespace sheaf {
namespace {

/// move(problem, x) puts one parameter x away from where it is.
using Move = std::function<void(Problem&, double)>;

double derivative_ratio(const Problem& problem, const ScaledLoss& loss, const Move& move) {
  const auto cost = [&](double x) {
    Problem moved = problem;
    move(moved, x);
    return loss.kind == LossKind::none ? evaluate(moved).cost : robust_cost(moved, loss);
  };
  const double middle = cost(0);
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

/// cam_from_world of observation i's image, and its point in that camera's frame.
Vector3<double> in_camera(const Problem& problem, std::size_t i) {
  const Pose& pose = problem.poses[problem.observation_image[i]];
  const double* X = &problem.points[3 * std::size_t(problem.observation_point[i])];
  Vector3<double> P =
      multiply(matrix_from_quaternion(pose.rotation), Vector3<double>{X[0], X[1], X[2]});
  for (int k = 0; k < 3; ++k) P[k] += pose.translation[k];
  return P;
}

std::array<double, 2> pixel_of(const Problem& problem, std::size_t i) {
  const Camera& camera = problem.cameras[problem.image_camera[problem.observation_image[i]]];
  return project(camera, in_camera(problem, i)).pixel;
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
    const Camera& camera = truth.cameras[truth.image_camera[image]];
    const auto R = matrix_from_quaternion(truth.poses[image].rotation);
    Vector3<double> P = multiply(R, Vector3<double>{X[0], X[1], X[2]});
    for (int j = 0; j < 3; ++j) P[j] += truth.poses[image].translation[j];
    const auto pixel = project(camera, P).pixel;
    for (int j = 0; j < 2; ++j) {  // the noise stays, the pixel moves
      const double moved = pixel[j] - truth.observation_xy[2 * i + j];
      truth.observation_xy[2 * i + j] += moved;
      scene.start.observation_xy[2 * i + j] += moved;
    }
  }
  return scene;
}

double robust_cost(const Problem& problem, const ScaledLoss& loss) {
  double sum = 0;
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const auto u = pixel_of(problem, i);
    const Camera& camera = problem.cameras[problem.image_camera[problem.observation_image[i]]];
    const auto [x, y] = residual(camera, u, &problem.observation_xy[2 * i]);
    sum += evaluate_loss(loss, x * x + y * y).value;
  }
  return sum / 2;
}

Problem with_pixels(const Problem& truth, const Pixels& pixels) {
  Problem out = truth;
  Random noise(pixels.seed, 0), wrong(pixels.seed, 1);
  for (std::size_t i = 0; i < out.num_observations(); ++i) {
    const auto u = pixel_of(truth, i);
    for (int k = 0; k < 2; ++k)
      out.observation_xy[2 * i + k] = u[k] + pixels.noise_px * noise.normal();
    const double angle = wrong.uniform(0, 2 * std::numbers::pi);
    if (wrong.uniform() >= pixels.outliers) continue;
    out.observation_xy[2 * i] += pixels.outlier_px * std::cos(angle);
    out.observation_xy[2 * i + 1] += pixels.outlier_px * std::sin(angle);
  }
  return out;
}

void disturb(Problem& problem, const Disturbance& by) {
  std::vector<double> depths;
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    depths.push_back(std::abs(in_camera(problem, i)[2]));
  std::nth_element(depths.begin(), depths.begin() + depths.size() / 2, depths.end());
  const double unit = depths[depths.size() / 2];
  Random random(by.seed, 2);
  const auto normal = [&](double sigma) {
    return Vector3<double>{sigma * random.normal(), sigma * random.normal(),
                           sigma * random.normal()};
  };
  for (Pose& pose : problem.poses) {
    // A left turn by phi about the camera's centre leaves the centre where it is, so that the two
    // noises are apart: t <- exp(phi) t - shift.
    const auto moved = left_perturbed(RigidMotion<double>{pose.rotation, pose.translation}, {},
                                      normal(by.rotation_rad));
    pose = {moved.rotation, moved.translation};
    const Vector3<double> shift = normal(by.center * unit);
    for (int k = 0; k < 3; ++k) pose.translation[k] += shift[k];
  }
  for (Camera& camera : problem.cameras) camera.parameters[0] *= 1 + by.focal * random.normal();
  for (double& x : problem.points) x += by.point * unit * random.normal();
}

double scaled_gradient(const Problem& problem, const Fixed& fixed, std::size_t points,
                       const ScaledLoss& loss) {
  double largest = 0;
  const auto take = [&](const Move& move) {
    largest = std::max(largest, derivative_ratio(problem, loss, move));
  };
  for (std::size_t i = 0; i < problem.num_images(); ++i)
    for (int k = 0; k < 6 && !fixed.poses && !listed(fixed.pose_ids, i); ++k) take(pose_move(i, k));
  const std::vector<ParameterSet> held = held_parameters(problem, fixed);
  for (std::size_t i = 0; i < problem.cameras.size(); ++i)
    for (std::size_t k = 0; k < parameter_count(problem.cameras[i].model); ++k)
      if ((held[i] >> k & 1) == 0)
        take([=](Problem& p, double x) { p.cameras[i].parameters[k] += x; });
  for (std::size_t i = 0; i < std::min(3 * points, problem.points.size()) && !fixed.points; ++i)
    take([=](Problem& p, double x) { p.points[i] += x; });
  return largest;
}

void turn_about_centre(Pose& pose, const std::array<double, 3>& by) {
  const Vector3<double> centre = camera_centre(matrix_from_quaternion(pose.rotation), pose);
  pose.rotation = normalized(multiply(quaternion_from_angle_axis(by), pose.rotation));
  const Vector3<double> moved = multiply(matrix_from_quaternion(pose.rotation), centre);
  for (std::size_t k = 0; k < 3; ++k) pose.translation[k] = -moved[k];
}

std::string case_file(const std::string& name) {
  return (std::filesystem::path(SHEAF_SOURCE_DIR) / "tests" / "data" / name).string();
}

std::string real_data(const std::string& name) {
  const char* folder = std::getenv("SHEAF_DATA");
  const std::filesystem::path path =
      std::filesystem::path(folder != nullptr ? folder : SHEAF_SOURCE_DIR "/data") / "bal" / name;
  return std::filesystem::exists(path) ? path.string() : "";
}

}  // namespace sheaf
