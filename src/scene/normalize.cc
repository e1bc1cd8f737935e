// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "scene/noise.h"
#include "scene/rigs.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

// The upper one of an even number: both published programs take it.
double upper_median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// C <- s (C - m) with t = -R C: t <- s (t + R m).
void move(std::array<double, 3>& t, const Matrix3<double>& R, const Normalization& to) {
  const Vector3<double> shift = multiply(R, to.center);
  for (std::size_t k = 0; k < 3; ++k) t[k] = to.scale * (t[k] + shift[k]);
}

void move(Rigs& rigs, const Normalization& to) {
  for (Pose& frame : rigs.rig_from_world)
    move(frame.translation, matrix_from_quaternion(frame.rotation), to);
  for (Pose& sensor : rigs.sensor_from_rig)
    for (double& t : sensor.translation) t *= to.scale;
}

void place_images_of_rigs(Problem& problem) {
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    if (in_rig(problem.rigs, j)) problem.poses[j] = pose_of(problem, j);
}

void move_position(std::array<double, 3>& position, Covariance3& covariance,
                   const Normalization& to) {
  for (std::size_t k = 0; k < 3; ++k) position[k] = to.scale * (position[k] - to.center[k]);
  for (double& c : covariance) c *= to.scale * to.scale;
}

/// Blocks' states move with the scene, so that differences from them are scaled where they are
/// lengths: of a pose the first three, of a point all.
void move(GaussianPrior& prior, const Normalization& to) {
  using Kind = GaussianPrior::Block::Kind;
  std::vector<double> scales;
  for (GaussianPrior::Block& block : prior.blocks) {
    std::vector<double>& x = block.state;
    if (block.kind == Kind::pose) {
      std::array<double, 3> t{x[4], x[5], x[6]};
      move(t, matrix_from_quaternion(Quaternion<double>{x[0], x[1], x[2], x[3]}), to);
      std::copy(t.begin(), t.end(), x.begin() + 4);
      scales.insert(scales.end(), {to.scale, to.scale, to.scale, 1, 1, 1});
    } else if (block.kind == Kind::point) {
      for (std::size_t k = 0; k < 3; ++k) x[k] = to.scale * (x[k] - to.center[k]);
      scales.insert(scales.end(), 3, to.scale);
    } else {
      scales.insert(scales.end(), x.size(), 1);
    }
  }
  for (std::size_t i = 0; i < prior.square_root.size(); ++i)
    prior.square_root[i] /= scales[i % scales.size()];
  for (std::size_t i = 0; i < prior.mean.size(); ++i) prior.mean[i] *= scales[i];
}

/// What terms cost stays the same.
void move(Terms& terms, const Normalization& to) {
  for (CentrePrior& prior : terms.centres) move_position(prior.position, prior.covariance, to);
  for (PointPrior& prior : terms.points) move_position(prior.position, prior.covariance, to);
  for (DistancePrior& prior : terms.distances) {
    prior.distance *= to.scale;
    prior.sigma *= to.scale;
  }
  for (GaussianPrior& prior : terms.gaussians) move(prior, to);
}

}  // namespace

Result<Normalization> normalize(Problem& problem, double size) {
  const std::size_t n = problem.num_points();
  if (n == 0) return Error(ErrorCode::usage, "a problem without points cannot be normalised");
  if (!(size > 0) || !std::isfinite(size))
    return Error(ErrorCode::usage, "the size to normalise to must be a finite number above 0");
  Normalization out;
  std::vector<double> values(n);
  for (std::size_t k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < n; ++i) values[i] = problem.points[3 * i + k];
    out.center[k] = upper_median(values);
  }
  for (std::size_t i = 0; i < n; ++i) {
    values[i] = 0;
    for (std::size_t k = 0; k < 3; ++k)
      values[i] += std::fabs(problem.points[3 * i + k] - out.center[k]);
  }
  const double deviation = upper_median(values);
  out.scale = size / deviation;
  if (!(deviation > 0) || !std::isfinite(out.scale))
    return Error(ErrorCode::usage, "the points' median distance from their median is " +
                                       std::to_string(deviation) + ": nothing to normalise to");
  for (std::size_t i = 0; i < problem.points.size(); ++i)
    problem.points[i] = out.scale * (problem.points[i] - out.center[i % 3]);
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    move(problem.poses[j].translation, portable_matrix(portable_rotation(problem, j)), out);
  move(problem.rigs, out);
  place_images_of_rigs(problem);
  move(problem.terms, out);
  return out;
}

}  // namespace sheaf
