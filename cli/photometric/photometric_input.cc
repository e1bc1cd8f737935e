// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "photometric/photometric_input.h"

#include "report/errors.h"

namespace sheaf {
namespace {

/// Poses alone, for the code that compares reprojection problems.
Problem shell_of(const std::vector<Pose>& poses) {
  Problem out;
  for (const Pose& pose : poses) out.add_image(pose, Camera{});
  return out;
}

}  // namespace

PoseErrors pose_errors(const PhotometricFolder& folder) {
  const StateErrors errors =
      compare_states(shell_of(folder.problem.poses), shell_of(folder.given_poses), true).value();
  return {errors.rotation_error_rad.mean, errors.center_error.mean};
}

Json pose_errors_json(const std::optional<PoseErrors>& before,
                      const std::optional<PoseErrors>& after) {
  if (!before || !after) return {};
  return {
      {"rotation_error_rad", {{"before", before->rotation_rad}, {"after", after->rotation_rad}}},
      {"center_error", {{"before", before->center}, {"after", after->center}}}};
}

}  // namespace sheaf
