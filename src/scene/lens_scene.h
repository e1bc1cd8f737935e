// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/rotation.h"
#include "sheaf/scene.h"

namespace sheaf {

/// The lenses of a LensSceneOptions and the images that look through them. All numbers come out of
/// correctly rounded operations: the same bits on every machine.
class LensScene {
 public:
  explicit LensScene(const LensSceneOptions& options);

  const std::vector<Camera>& lenses() const { return lenses_; }
  const std::vector<Pose>& poses() const { return poses_; }
  std::uint32_t lens_of(std::uint32_t image) const {
    return static_cast<std::uint32_t>(image % lenses_.size());
  }

  /// A place that most images have in view.
  std::array<double, 3> point(class Random& random) const;

  /// Direction from the image's centre to the point, in the world, of length 1.
  std::array<double, 3> ray(std::uint32_t image, const std::array<double, 3>& point) const;

  /// Whether the point lies within the field of view and the frame, and where; pixels as exact as
  /// the lens's formula.
  bool sees(std::uint32_t image, const std::array<double, 3>& point,
            std::array<double, 2>& pixel) const;

 private:
  void place_around(class Random& random);
  void place_below(class Random& random);

  std::uint32_t images_;
  double half_view_rad_, cosine_;  ///< half the field of view, and its cosine
  bool wide_;
  std::vector<Camera> lenses_;
  std::vector<Pose> poses_;
  std::vector<Matrix3<double>> rotations_;
};

}  // namespace sheaf
