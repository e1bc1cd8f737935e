// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include "geometry/rotation.h"
#include "platform/random.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// What the images of a photometric scene show: a height field over the plane z = 0 with grey waves
/// on it, and a square that may hang above it. Cameras look down on it along +z.
class WaveSurface {
 public:
  WaveSurface(const PhotometricSceneOptions& options, double focal_px, Random random);

  static constexpr double kDepth = 4;  ///< of the cameras, on average

  struct Hit {
    double depth;  ///< along the camera's z
    double grey;
    bool on_occluder;
  };
  /// The ray origin + depth direction, direction.z > 0 in the world.
  Hit hit(const Vector3<double>& origin, const Vector3<double>& direction) const;

 private:
  struct Wave {
    double x, y, phase, amplitude;  ///< grey = amplitude sin(x X + y Y + phase)
  };
  double height(double x, double y) const;
  double grey(double x, double y) const;

  std::vector<Wave> waves_;
  double relief_;
  bool occluder_;
};

}  // namespace sheaf
