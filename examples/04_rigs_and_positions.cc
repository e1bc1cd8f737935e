// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// A stereo pair that is driven along a street: its images move as one, its mounting is refined. Some
// positions were measured, one of them 50 units off, and a distance between two points.

#include <sheaf/sheaf.h>

#include <cmath>
#include <cstdio>

namespace {

/// -R^T t.
std::array<double, 3> centre(const sheaf::Pose& pose) {
  const auto [w, x, y, z] = pose.rotation;
  const double R[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                       2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                       2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
  std::array<double, 3> C{};
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i) C[k] -= R[3 * i + k] * pose.translation[i];
  return C;
}

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

std::array<double, 3> point(const sheaf::Problem& problem, std::uint32_t j) {
  return {problem.points[3 * j], problem.points[3 * j + 1], problem.points[3 * j + 2]};
}

}  // namespace

int main() {
  sheaf::RigSceneOptions street;
  street.frames = 30;
  street.scene.points = 1500;
  street.sensor_rotation_noise_rad = 0.002;
  const sheaf::Scene scene = sheaf::generate(street).value();
  sheaf::Problem problem = scene.start;

  for (std::uint32_t image = 0; image < problem.num_images(); image += 6) {
    sheaf::CentrePrior measured;
    measured.image = image;
    measured.position = centre(sheaf::pose_of(scene.truth, image));
    if (image == 12) measured.position[0] += 50;
    measured.covariance = {1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-4};  // 0.01 along each axis
    measured.loss = {sheaf::LossKind::cauchy, 1};                // of one sigma
    problem.terms.centres.push_back(measured);
  }
  problem.terms.distances.push_back(
      {0, 700, distance(point(scene.truth, 0), point(scene.truth, 700)), 0.005, {}});

  const sheaf::Summary summary = sheaf::solve(problem);
  std::printf("%s\ncost %.6g -> %.6g, of which positions %.3g, distances %.3g\n",
              summary.words.c_str(), summary.initial_cost, summary.final_cost,
              summary.final_terms.centres, summary.final_terms.distances);
  double worst = 0;
  for (std::uint32_t image = 0; image < problem.num_images(); ++image)
    worst = std::max(worst, distance(centre(sheaf::pose_of(problem, image)),
                                     centre(sheaf::pose_of(scene.truth, image))));
  std::printf("no camera is further than %.3f from where it was; sensor_from_rig off by %.4f\n",
              worst,
              distance(problem.rigs.sensor_from_rig[1].translation,
                       scene.truth.rigs.sensor_from_rig[1].translation));
  return summary.usable() && worst < 0.1 ? 0 : 1;
}
