// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "survey/triangulate.h"

#include <cmath>

#include "geometry/camera_model.h"
#include "platform/parallel.h"
#include "scene/similarity.h"
#include "starts/intersection.h"

namespace sheaf {
namespace {

Vector3<double> in_camera_of(const Problem& problem, std::uint32_t image,
                             const Vector3<double>& X) {
  const Pose& pose = problem.poses[image];
  return in_camera(matrix_from_quaternion(pose.rotation), pose, X.data());
}

/// A place among the cameras in whole units, which are taken off and put back exactly: where rays
/// meet is sought with a little weight on 0, which is to be near.
Vector3<double> middle_of(const std::vector<Pose>& poses) {
  Vector3<double> out{};
  for (const Pose& pose : poses) {
    const Vector3<double> C = camera_centre(matrix_from_quaternion(pose.rotation), pose);
    for (std::size_t k = 0; k < 3; ++k) out[k] += C[k] / static_cast<double>(poses.size());
  }
  for (double& x : out) x = std::round(x);
  return out;
}

}  // namespace

std::vector<std::optional<Vector3<double>>> triangulate(
    const Problem& problem, const std::vector<std::vector<Sighting>>& points) {
  Problem marked;
  const Vector3<double> middle = middle_of(problem.poses);
  const Similarity there{1, {1, 0, 0, 0}, {-middle[0], -middle[1], -middle[2]}};
  for (const Pose& pose : problem.poses) marked.poses.push_back(moved(pose, there));
  marked.cameras = problem.cameras;
  marked.image_camera = problem.image_camera;
  for (const std::vector<Sighting>& sightings : points) {
    const std::uint32_t point = marked.add_point(0, 0, 0);
    if (sightings.size() < 2) continue;
    for (const Sighting& s : sightings)
      marked.add_observation(s.image, point, s.pixel[0], s.pixel[1]);
  }
  const Sights sights(marked, {});
  Estimate state = estimate_of(marked);
  Threads threads(1);
  intersect(
      sights, {}, [] { return false; }, threads, state);
  std::vector<std::optional<Vector3<double>>> out(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].size() < 2) continue;
    const Vector3<double> X{state.points[3 * i] + middle[0], state.points[3 * i + 1] + middle[1],
                            state.points[3 * i + 2] + middle[2]};
    bool seen = std::isfinite(X[0] + X[1] + X[2]);
    for (const Sighting& s : points[i])
      seen = seen && sees(problem.cameras[problem.image_camera[s.image]],
                          in_camera_of(problem, s.image, X));
    if (seen) out[i] = X;
  }
  return out;
}

std::array<double, 2> mark_residual(const Problem& problem, const Sighting& sighting,
                                    const Vector3<double>& X) {
  const Camera& camera = problem.cameras[problem.image_camera[sighting.image]];
  const Projected at = project(camera, in_camera_of(problem, sighting.image, X));
  return residual(camera, at.pixel, sighting.pixel.data());
}

}  // namespace sheaf
