// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "page/page_scene.h"

namespace sheaf {

/// The frame in which a scene is shown: x to the right, y up, z towards the reader.
struct SceneView {
  Matrix3<double> axes{};                 ///< rows: right, up and towards the reader, in the world
  Vector3<double> origin{};               ///< world: where the view's zero is
  Vector3<double> centre{};               ///< view: the middle of what is shown
  std::array<Vector3<double>, 2> core{};  ///< view: the box of nearly all points and all images
  double radius = 1;                      ///< half that box's diagonal, scene units
  double reach = 5;       ///< points farther from the centre along an axis are not shown
  double frustum = 0.1;   ///< depth of an image's frustum, scene units
  std::uint64_t far = 0;  ///< points beyond the reach

  Vector3<double> operator()(const Vector3<double>& world) const;
};

/// up: of a frame that means something, else of zero length: then up is what the images' x axes
/// stand upright to, for photographers hold level more often than they look level.
SceneView scene_view(const PageScene& scene, const Vector3<double>& up);

/// A point of the result, or of the start laid onto it, world.
Vector3<double> result_point(const PageScene& scene, std::size_t point);
Vector3<double> start_point(const PageScene& scene, std::size_t point);

/// Centre and corners of an image's frustum in the view's frame.
using Frustum = std::array<Vector3<double>, 5>;
Frustum frustum(const PageScene& scene, const SceneView& view, std::size_t image, bool start);

}  // namespace sheaf
