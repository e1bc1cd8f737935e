// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/loss.h"
#include "geometry/rotation.h"
#include "sheaf/problem.h"

namespace sheaf {

/// What a solver may change of a problem.
struct Estimate {
  std::vector<Pose> poses;
  std::vector<Camera> cameras;
  std::vector<double> points;             ///< 3 for each
  std::vector<Pose> sensors{}, frames{};  ///< of rigs
};
Estimate estimate_of(const Problem& problem);
void put(const Estimate& state, Problem& problem);

/// A problem's observations by point and by image. The problem must outlive it, and its state is
/// not looked at.
class Sights {
 public:
  /// skip: 1 for each observation to leave out, or empty.
  Sights(const Problem& problem, const std::vector<std::uint8_t>& skip);

  std::span<const std::uint64_t> of_point(std::size_t point) const {
    return {by_point_.data() + point_begin_[point], point_begin_[point + 1] - point_begin_[point]};
  }
  std::span<const std::uint64_t> of_image(std::size_t image) const {
    return {by_image_.data() + image_begin_[image], image_begin_[image + 1] - image_begin_[image]};
  }
  std::uint32_t image(std::uint64_t i) const { return problem_->observation_image[i]; }
  std::uint32_t point(std::uint64_t i) const { return problem_->observation_point[i]; }
  std::uint32_t camera_of(std::size_t image) const { return problem_->image_camera[image]; }
  const double* pixel(std::uint64_t i) const { return &problem_->observation_xy[2 * i]; }
  std::size_t num_points() const { return point_begin_.size() - 1; }
  std::size_t num_images() const { return image_begin_.size() - 1; }

 private:
  const Problem* problem_;
  std::vector<std::uint64_t> point_begin_, image_begin_, by_point_, by_image_;
};

/// How well some observations fit.
struct Fit {
  double cost = 0;           ///< 1/2 sum rho(|r|^2), px^2
  std::uint64_t behind = 0;  ///< observations whose point their camera does not see

  Fit& operator+=(const Fit& other) {
    cost += other.cost;
    behind += other.behind;
    return *this;
  }
};

/// Of one observation: the camera, the point in its frame, the pixel measured.
Fit fit_of(const Camera& camera, const Vector3<double>& P, const double* pixel,
           const ScaledLoss& loss);

/// Of all observations of an image, at a state.
Fit fit_of_image(const Sights& sights, std::size_t image, const Estimate& state,
                 const ScaledLoss& loss);

/// The inverse rotation: of a direction in a camera's frame, the direction in the world's.
Vector3<double> turned_back(const Matrix3<double>& rotation, const Vector3<double>& v);
/// -R^T t.
Vector3<double> camera_centre(const Matrix3<double>& rotation, const Pose& pose);
/// X in the frame of a camera.
Vector3<double> in_camera(const Matrix3<double>& rotation, const Pose& pose, const double* X);

}  // namespace sheaf
