// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/colmap_lens.h"

#include "geometry/camera_model.h"

namespace sheaf {

std::optional<Camera> colmap_lens(const Camera& camera) {
  if (colmap_id(camera.model) >= 0) return camera;
  const auto& k = camera.parameters;
  Camera out = camera;
  if (camera.model == CameraModel::radial_k3) {
    out.model = CameraModel::full_opencv;
    out.parameters = {k[0], k[0], k[1], k[2], k[3], k[4], 0, 0, k[5]};
    return out;
  }
  if (camera.model != CameraModel::ucm) return std::nullopt;
  out.model = CameraModel::eucm;
  out.parameters[5] = 1;
  return out;
}

}  // namespace sheaf
