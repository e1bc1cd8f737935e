// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/camera_model.h"

#include <algorithm>
#include <numbers>

#include "geometry/bal_camera.h"

namespace sheaf {

Projected project(const Camera& camera, const std::array<double, 3>& P) {
  const double* k = camera.parameters.data();
  if (camera.model == CameraModel::bal)
    return {project(BalCamera<double>{k[0], k[1], k[2]}, P), BalLens::sees(k, P.data())};
  return with_lens(camera.model, [&](auto lens) {
    LensJacobian<double> J;
    lens.project(k, P.data(), J);
    return Projected{J.pixel, lens.sees(k, P.data())};
  });
}

bool sees(const Camera& camera, const std::array<double, 3>& P) {
  return with_lens(camera.model,
                   [&](auto lens) { return lens.sees(camera.parameters.data(), P.data()); });
}

LensJacobian<double> project_with_jacobian(const Camera& camera, const std::array<double, 3>& P) {
  LensJacobian<double> out{};
  with_lens(camera.model,
            [&](auto lens) { lens.project(camera.parameters.data(), P.data(), out); });
  return out;
}

std::size_t parameter_count(CameraModel model) {
  return with_lens(model, [](auto lens) { return decltype(lens)::kParameters.size(); });
}

std::vector<std::string_view> parameter_names(CameraModel model) {
  return with_lens(model, [](auto lens) {
    const auto& names = decltype(lens)::kParameters;
    return std::vector<std::string_view>(names.begin(), names.end());
  });
}

ParameterSet principal_point(CameraModel model) {
  const ParameterRoles roles = roles_of(model);
  if (roles.cx < 0) return 0;
  return static_cast<ParameterSet>(1u << roles.cx | 1u << roles.cy);
}

ParameterSet image_size(CameraModel model) {
  return with_lens(model, [](auto lens) -> ParameterSet {
    if constexpr (requires { decltype(lens)::kImageSize; }) return decltype(lens)::kImageSize;
    return 0;
  });
}

std::string_view to_string(CameraModel model) {
  return with_lens(model, [](auto lens) { return decltype(lens)::kName; });
}

std::optional<CameraModel> camera_model_named(std::string_view name) {
  for (std::size_t i = 0; i < kCameraModels; ++i)
    if (to_string(static_cast<CameraModel>(i)) == name) return static_cast<CameraModel>(i);
  return {};
}

int colmap_id(CameraModel model) {
  return with_lens(model, [](auto lens) { return decltype(lens)::kColmapId; });
}

std::optional<CameraModel> camera_model_of_colmap(int id) {
  for (std::size_t i = 0; i < kCameraModels; ++i)
    if (id >= 0 && colmap_id(static_cast<CameraModel>(i)) == id) return static_cast<CameraModel>(i);
  return {};
}

ParameterRoles roles_of(CameraModel model) {
  // Callers ask in every solve of a window: nothing is allocated.
  return with_lens(model, [model](auto lens) {
    ParameterRoles roles;
    if (image_size(model) != 0) roles.fx = roles.fy = -1;
    bool from_zero = false;  // coefficients count from k0
    const auto& names = decltype(lens)::kParameters;
    for (int i = 0; i < static_cast<int>(names.size()); ++i) {
      const std::string_view name = names[static_cast<std::size_t>(i)];
      if (name == "fy") roles.fy = i;
      if (name == "cx") roles.cx = i;
      if (name == "cy") roles.cy = i;
      if (name == "k0") from_zero = true, roles.k1 = i, roles.k2 = i + 1;
      if (!from_zero && (name == "k1" || name == "k")) roles.k1 = i;
      if (!from_zero && name == "k2") roles.k2 = i;
    }
    return roles;
  });
}

std::array<double, 2> principal_point_of(const Camera& camera) {
  const ParameterRoles roles = roles_of(camera.model);
  if (image_size(camera.model) != 0) return {camera.parameters[0] / 2, camera.parameters[1] / 2};
  if (roles.cx < 0) return {0, 0};
  return {camera.parameters[static_cast<std::size_t>(roles.cx)],
          camera.parameters[static_cast<std::size_t>(roles.cy)]};
}

double pixels_per_radian(const Camera& camera) {
  const int fx = roles_of(camera.model).fx;
  if (fx < 0) return camera.parameters[0] / (2 * std::numbers::pi);
  return camera.parameters[static_cast<std::size_t>(fx)];
}

}  // namespace sheaf
