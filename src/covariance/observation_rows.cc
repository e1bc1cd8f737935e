// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/observation_rows.h"

#include <algorithm>

#include "geometry/camera_model.h"
#include "geometry/motion_log.h"
#include "starts/sights.h"

namespace sheaf {
namespace {

std::array<double, 36> identity6() {
  std::array<double, 36> out{};
  for (std::size_t k = 0; k < 6; ++k) out[7 * k] = 1;
  return out;
}

}  // namespace

ObservationRows::ObservationRows(const Problem& problem, const ParameterBlocks& blocks)
    : problem_(problem), blocks_(blocks), poses_(problem.num_images()) {
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    rotations_.push_back(matrix_from_quaternion(problem.poses[i].rotation));
    if (blocks.rigid[i] == 0) {
      if (blocks.image[i] != ParameterBlocks::kNone)
        poses_[i].push_back({blocks.image[i], identity6()});
      continue;
    }
    const std::uint32_t frame = blocks.frame[problem.rigs.image_frame[i]];
    const std::uint32_t sensor_index = problem.rigs.image_sensor[i];
    const Pose& sensor = problem.rigs.sensor_from_rig[sensor_index];
    if (frame != ParameterBlocks::kNone)
      poses_[i].push_back({frame, adjoint_of({sensor.rotation, sensor.translation})});
    if (blocks.sensor[sensor_index] != ParameterBlocks::kNone)
      poses_[i].push_back({blocks.sensor[sensor_index], identity6()});
  }
}

void ObservationRows::add_pose(std::size_t image, const std::array<double, 12>& J, Row& out) const {
  for (const PosePart& pose : poses_[image]) {
    Part& part = out.parts[out.count++];
    part.block = pose.block;
    part.width = 6;
    for (std::size_t r = 0; r < 2; ++r)
      for (std::size_t k = 0; k < 6; ++k) {
        double sum = 0;
        for (std::size_t l = 0; l < 6; ++l) sum += J[6 * r + l] * pose.by_image[6 * l + k];
        part.J[9 * r + k] = sum;
      }
  }
}

void ObservationRows::add_lens(std::size_t image, const LensJacobian<double>& lens, double scale,
                               Row& out) const {
  const ParameterBlocks::Lens& of = blocks_.lenses[problem_.image_camera[image]];
  for (std::size_t at = 0; at < of.of_column.size(); at += ParameterBlocks::kWidest) {
    Part& part = out.parts[out.count++];
    part.block = of.block + static_cast<std::uint32_t>(at / ParameterBlocks::kWidest);
    part.width = blocks_.width(part.block);
    for (std::size_t r = 0; r < 2; ++r)
      for (std::size_t k = 0; k < part.width; ++k)
        part.J[9 * r + k] =
            scale * lens.parameters[r][static_cast<std::size_t>(of.of_column[at + k])];
  }
}

void ObservationRows::evaluate(std::size_t observation, Row& out) const {
  const std::size_t image = problem_.observation_image[observation];
  const double* X = &problem_.points[3 * std::size_t(problem_.observation_point[observation])];
  const Matrix3<double>& R = rotations_[image];
  const Vector3<double> P = in_camera(R, problem_.poses[image], X);
  const Camera& camera = problem_.cameras[problem_.image_camera[image]];
  const LensJacobian<double> lens = project_with_jacobian(camera, P);
  const std::array<double, 2> e =
      residual(camera, lens.pixel, &problem_.observation_xy[2 * observation]);
  const double scale =
      problem_.observation_sigma.empty() ? 1 : 1 / problem_.observation_sigma[observation];
  std::array<double, 12> pose;
  for (std::size_t r = 0; r < 2; ++r) {
    out.r[r] = scale * e[r];
    std::array<double, 3> a;
    for (std::size_t k = 0; k < 3; ++k) a[k] = scale * lens.point[r][k];
    for (std::size_t k = 0; k < 3; ++k)
      out.point[3 * r + k] = a[0] * R[k] + a[1] * R[3 + k] + a[2] * R[6 + k];
    const Vector3<double> turn = cross(P, {a[0], a[1], a[2]});  // a . (phi x P) = phi . (P x a)
    std::copy(a.begin(), a.end(), &pose[6 * r]);
    std::copy(turn.begin(), turn.end(), &pose[6 * r + 3]);
  }
  out.count = 0;
  add_pose(image, pose, out);
  add_lens(image, lens, scale, out);
}

}  // namespace sheaf
