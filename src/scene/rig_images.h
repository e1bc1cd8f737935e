// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "scene/rig_street.h"
#include "sheaf/scene.h"

namespace sheaf {

/// The images of a RigSceneOptions as they were truly taken, and what they see of the street.
class RigImages {
 public:
  /// The options are good (`check_rig_scene`).
  explicit RigImages(const RigSceneOptions& options);

  const RigStreet& street() const { return street_; }
  /// Lenses, images, rigs and names; no points.
  const Problem& problem() const { return problem_; }
  /// Ways along the street between which points are to be taken, scene units.
  struct Reach {
    double from = 0, to = 0;
  };
  Reach reach() const;

  /// Images of the frames within `kRange` of the way s, in order.
  std::vector<std::uint32_t> near(double s) const;
  /// Frames between two, the short way round.
  double frames_between(std::uint32_t image, std::uint32_t other) const;

  /// Whether an image has the spot in its frame, unhidden and neither too near nor too far, and
  /// where; pixels as exact as the lens's formula.
  bool sees(std::uint32_t image, const RigStreet::Spot& spot, std::array<double, 2>& pixel) const;
  /// Direction from the image's centre to a point, of length 1.
  Vector3<double> ray(std::uint32_t image, const Vector3<double>& X) const;

  static constexpr double kRange = 28;  ///< scene units, and frames

 private:
  void mount_sensors(const RigSceneOptions& options, std::uint64_t sensors);
  void take_frame(const RigSceneOptions& options, class Random& random);
  void take_single(double s, class Random& random);
  void add_image(std::uint64_t frame, std::uint32_t of_frame, std::uint32_t sensor,
                 std::uint32_t camera, const Pose& pose, const std::string& name);

  RigStreet street_;
  double cosine_;  ///< of half the field of view
  std::uint64_t frames_;
  bool looks_back_;  ///< some sensor does
  Problem problem_;
  std::vector<std::string> names_;
  std::vector<std::uint64_t> place_;        ///< of each image: the frame that it was taken at
  std::vector<std::uint32_t> first_image_;  ///< of each frame, and one more
  std::vector<Vector3<double>> centres_;
  std::vector<Matrix3<double>> rotations_;
};

/// Number of sensors, and the full angle of view in degrees.
std::uint64_t sensors_of(const RigSceneOptions& options);
double view_deg_of(const RigSceneOptions& options);

}  // namespace sheaf
