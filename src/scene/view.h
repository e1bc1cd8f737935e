// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/rotation.h"
#include "scene/portable_rotation.h"
#include "sheaf/scene.h"

namespace sheaf {

class Random;

/// X -> to + scale R(turn) (X - from).
struct Drift {
  Quaternion<double> turn{1, 0, 0, 0};
  double scale = 1;
  Vector3<double> from{0, 0, 0}, to{0, 0, 0};

  Vector3<double> operator()(const Vector3<double>& X) const {
    const Vector3<double> d =
        multiply(portable_matrix(turn), {X[0] - from[0], X[1] - from[1], X[2] - from[2]});
    return {to[0] + scale * d[0], to[1] + scale * d[1], to[2] + scale * d[2]};
  }
};

/// An image as it was truly taken.
struct View {
  Vector3<double> center{};
  Matrix3<double> rotation{};     ///< cam_from_world, row-major
  Vector3<double> intrinsics{};   ///< f (px), k1, k2
  double half_x = 0, half_y = 0;  ///< half the frame at unit depth
  double weight = 1;              ///< how many of its points an image finds, relative to others
  std::uint32_t group = 0;        ///< which of the layout's drifts it shares
  std::uint32_t file_index = 0;   ///< its place in the file

  /// Of the point in the camera's frame: looks along -z.
  Vector3<double> in_camera(const Vector3<double>& X) const {
    return multiply(rotation, {X[0] - center[0], X[1] - center[1], X[2] - center[2]});
  }
};

/// Where all the images of a scene stand, and which are close to which.
struct Layout {
  SceneFamily family = SceneFamily::collection;
  std::vector<View> views;  ///< neighbours here are neighbours in the world
  /// Another such order, for the neighbours that the first one parts (collection).
  std::vector<std::uint32_t> second_order, second_rank;
  /// Street: the image at the same place the next time the car comes by, in a ring, or itself.
  std::vector<std::uint32_t> revisit;
  std::vector<Drift> drifts;  ///< start from truth, one for each group
};

Layout make_street(const FamilyOptions& options);
Layout make_collection(const FamilyOptions& options);

/// The point seen at (x, y) (unit depth, x right, y up) of the view, or false for open sky. It is
/// the same surface for all views, up to clutter.
bool street_point(const View& view, double x, double y, Random& random, Vector3<double>& X);
bool collection_point(const View& view, double x, double y, Random& random, Vector3<double>& X);

/// About exp(x) for |x| < 4, of correctly rounded operations alone; 0 from -16 down.
inline double growth(double x) {
  double g = 1 + x / 16;
  if (g <= 0) return 0;
  for (int i = 0; i < 4; ++i) g *= g;
  return g;
}

Vector3<double> normal3(Random& random, double deviation);

}  // namespace sheaf
