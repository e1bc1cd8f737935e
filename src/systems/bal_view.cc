// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/bal_view.h"

#include "geometry/camera_model.h"
#include "scene/camera_frame.h"

namespace sheaf {

bool BalView::serves(const Problem& problem, const Fixed& fixed) {
  const std::vector<ParameterSet> held = held_parameters(problem, fixed);
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const auto view = radial_view(problem.cameras[c]);
    const ParameterSet principal = principal_point(problem.cameras[c].model);
    if (!view || !view->refinable || (held[c] & principal) != principal) return false;
  }
  return true;
}

BalView::BalView(Problem& problem, Fixed& fixed) : problem_(problem) {
  if (has_only_bal_cameras(problem)) return;
  cameras_ = problem.cameras;
  xy_ = problem.observation_xy;
  std::vector<ParameterSet> held = held_parameters(problem, fixed);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const ParameterRoles role = roles_of(cameras_[c].model);
    ParameterSet of_bal = 0;
    int to = 0;
    for (int from : {role.fx, role.k1, role.k2}) {
      const bool free = from >= 0 && (held[c] >> from & 1) == 0;
      of_bal = static_cast<ParameterSet>(of_bal | (free ? 0 : 1) << to++);
    }
    held[c] = of_bal;
  }
  turned_ = to_bal_cameras(problem).ok();
  if (turned_) fixed.parameters = std::move(held);
}

BalView::~BalView() {
  if (!turned_) return;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    Camera& camera = cameras_[c];
    const auto& refined = problem_.cameras[c].parameters;
    if (camera.model == CameraModel::bal) {
      camera.parameters = refined;
      continue;
    }
    camera.parameters[0] = refined[0];
    const RadialView view = *radial_view(camera);
    if (view.has_k1) camera.parameters[3] = refined[1];
    if (view.has_k2) camera.parameters[4] = refined[2];
  }
  problem_.cameras = std::move(cameras_);
  problem_.observation_xy = std::move(xy_);
  for (std::size_t j = 0; j < problem_.num_images(); ++j)
    if (problem_.cameras[problem_.image_camera[j]].model != CameraModel::bal)
      turn_round(problem_.poses[j], true);
}

}  // namespace sheaf
