// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/bal_view.h"

#include <string>

#include "scene/camera_frame.h"

namespace sheaf {

Result<void> BalView::check(const Problem& problem) {
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const auto view = radial_view(problem.cameras[c]);
    if (view && view->refinable) continue;
    return Error(ErrorCode::usage,
                 "camera " + std::to_string(c) + " is " +
                     std::string(to_string(problem.cameras[c].model)) +
                     ": solve refines BAL, SIMPLE_PINHOLE, SIMPLE_RADIAL and RADIAL cameras; the "
                     "other models can be read, converted and evaluated");
  }
  return {};
}

BalView::BalView(Problem& problem, Fixed& fixed) : problem_(problem) {
  if (has_only_bal_cameras(problem)) return;
  cameras_ = problem.cameras;
  xy_ = problem.observation_xy;
  for (std::uint32_t c = 0; c < cameras_.size(); ++c) {
    const RadialView view = *radial_view(cameras_[c]);
    if (!view.has_k1) fixed.k1_ids.push_back(c);
    if (!view.has_k2) fixed.k2_ids.push_back(c);
  }
  turned_ = to_bal_cameras(problem).ok();
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
