// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/scene_noise.h"

#include <algorithm>

#include "geometry/camera_model.h"
#include "platform/random.h"
#include "scene/portable_rotation.h"
#include "scene/view.h"

namespace sheaf {
namespace {

constexpr std::uint64_t kLenses = 17;  // a stream of the seed

/// The domain of unified models, and of what they see, ends at alpha = 1.
void keep_in_domain(Camera& lens) {
  double& last = lens.parameters[lens.model == CameraModel::double_sphere ? 5 : 4];
  if (lens.model == CameraModel::eucm || lens.model == CameraModel::ucm)
    last = std::min(last, 0.75);
  if (lens.model == CameraModel::double_sphere) last = std::min(last, 0.65);
}

}  // namespace

/// t = -R C = exp(phi) (t - R d).
void disturb_pose(Random& random, double rotation_rad, double center, Pose& pose) {
  const Quaternion<double> turn = portable_quaternion(normal3(random, rotation_rad));
  const Vector3<double> moved = multiply(portable_matrix(pose.rotation), normal3(random, center));
  Vector3<double> t = pose.translation;
  for (std::size_t i = 0; i < 3; ++i) t[i] -= moved[i];
  pose.translation = multiply(portable_matrix(turn), t);
  pose.rotation = normalized(multiply(turn, pose.rotation));
}

void disturb_lenses(const SceneOptions& o, Problem& start) {
  Random random(o.seed, kLenses);
  for (Camera& lens : start.cameras) {
    const ParameterRoles role = roles_of(lens.model);
    const double zoom = std::clamp(1 + o.focal_noise * random.normal(), 0.5, 2.0);
    for (int i = 0; i < static_cast<int>(parameter_count(lens.model)); ++i) {
      double& k = lens.parameters[static_cast<std::size_t>(i)];
      const double other = std::clamp(1 + 10 * o.focal_noise * random.normal(), 0.5, 1.5);
      if (i == role.fx || i == role.fy) {
        k *= zoom;
      } else if (i != role.cx && i != role.cy && image_size(lens.model) == 0) {
        k *= other;
      }
    }
    keep_in_domain(lens);
  }
}

}  // namespace sheaf
