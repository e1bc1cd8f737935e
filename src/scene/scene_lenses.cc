// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/scene_lenses.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "geometry/camera_model.h"
#include "platform/random.h"
#include "scene/portable_number.h"

namespace sheaf {
namespace {

constexpr double kNarrowDeg = 65, kWideDeg = 200;  // unless asked for
constexpr double kMostNarrowDeg = 110, kMostWideDeg = 220;

enum Stream : std::uint64_t { kLenses = 1 };

/// Of RAD_TAN_THIN_PRISM_FISHEYE, whose coefficients count from 0.
double usual_from_zero(std::string_view name) {
  constexpr std::pair<std::string_view, double> kUsual[] = {
      {"k0", -0.02}, {"k1", 0.003}, {"k2", -6e-4}, {"k3", 5e-5},  {"k4", -2e-6}, {"k5", 5e-8},
      {"p0", -4e-4}, {"p1", 6e-4},  {"s0", 5e-4},  {"s1", -5e-5}, {"s2", -3e-4}, {"s3", 4e-5}};
  for (const auto& [known, value] : kUsual)
    if (known == name) return value;
  return 0;
}

/// Distortion as real lenses have it; perspective models lose a tenth at the corners of 65 degrees,
/// and fisheyes grow monotonically to 110 degrees from the axis.
double usual(CameraModel model, std::string_view name) {
  if (model == CameraModel::rad_tan_thin_prism_fisheye) return usual_from_zero(name);
  const bool fisheye = is_fisheye(model);
  if (name == "k") return fisheye ? -0.02 : -0.12;
  if (name == "k1") return fisheye ? -0.02 : -0.15;
  if (name == "k2") return fisheye ? 0.003 : 0.04;
  if (name == "k3") return fisheye ? -6e-4 : -0.008;
  if (name == "k4") return fisheye ? 5e-5 : 0.02;
  if (name == "k5") return 0.01;
  if (name == "k6") return 0.002;
  if (name == "p1") return 6e-4;
  if (name == "p2") return -4e-4;
  if (name == "sx1") return 5e-4;
  if (name == "sy1") return -3e-4;
  if (name == "omega") return 0.9;
  if (name == "xi") return -0.15;
  if (name == "alpha") return model == CameraModel::double_sphere ? 0.58 : 0.62;
  return name == "beta" ? 1.05 : 0;
}

/// A lens whose image is as large as its sensor: the diagonal of a 3:2 frame spans the field of
/// view, or the circle of a fisheye fills a square one.
Camera usual_lens(CameraModel model, double half_view_rad) {
  if (model == CameraModel::equirectangular) return {model, {2000, 1000}, 2000, 1000};
  const bool square = is_fisheye(model);
  Camera lens{model, {}, square ? 1600u : 1800u, square ? 1600u : 1200u};
  const std::vector<std::string_view> names = parameter_names(model);
  for (std::size_t i = 0; i < names.size(); ++i) lens.parameters[i] = usual(model, names[i]);
  const ParameterRoles role = roles_of(model);
  auto& k = lens.parameters;
  const auto at = [](int i) { return static_cast<std::size_t>(i); };
  k[at(role.fx)] = k[at(role.fy)] = 1;
  const SineCosine edge = portable_sine_cosine(half_view_rad);
  const double reach = portable_pixel(lens, {edge.sine, 0, edge.cosine})[0];
  const double w = static_cast<double>(lens.width_px), h = static_cast<double>(lens.height_px);
  k[at(role.fx)] = (square ? w / 2 - 20 : std::sqrt(w * w + h * h) / 2) / reach;
  k[at(role.fy)] = role.fy == role.fx ? k[at(role.fx)] : 1.004 * k[at(role.fx)];
  k[at(role.cx)] = w / 2 + 6.5;
  k[at(role.cy)] = h / 2 - 4.25;
  return lens;
}

}  // namespace

bool is_fisheye(CameraModel model) {
  switch (model) {
    case CameraModel::opencv_fisheye:
    case CameraModel::simple_radial_fisheye:
    case CameraModel::radial_fisheye:
    case CameraModel::thin_prism_fisheye:
    case CameraModel::fov:
    case CameraModel::eucm:
    case CameraModel::rad_tan_thin_prism_fisheye:
    case CameraModel::simple_fisheye:
    case CameraModel::fisheye:
    case CameraModel::double_sphere:
    case CameraModel::ucm:
    case CameraModel::equirectangular:
      return true;
    default:
      return false;
  }
}

std::array<double, 2> portable_pixel(const Camera& camera, const std::array<double, 3>& P) {
  PortableNumber k[kMaxCameraParameters], at[3];
  for (std::size_t i = 0; i < kMaxCameraParameters; ++i)
    k[i] = PortableNumber(camera.parameters[i]);
  for (std::size_t i = 0; i < 3; ++i) at[i] = PortableNumber(P[i]);
  LensJacobian<PortableNumber> J;
  with_lens(camera.model, [&](auto lens) {
    if constexpr (!std::is_same_v<decltype(lens), BalLens>) lens.project(k, at, J);
  });
  return {J.pixel[0].value, J.pixel[1].value};
}

Result<double> field_of_view_deg(const LensSceneOptions& options) {
  const bool fisheye = is_fisheye(options.model);
  const double most = fisheye ? kMostWideDeg : kMostNarrowDeg;
  const double view = options.field_of_view_deg;
  if (view == 0 && options.model == CameraModel::equirectangular) return 360;
  if (view == 0) return fisheye ? kWideDeg : kNarrowDeg;
  if (view >= 5 && view <= most) return view;
  return Error(ErrorCode::usage, "the field of view of a synthetic " +
                                     std::string(to_string(options.model)) +
                                     " lens must be from 5 to " +
                                     std::to_string(static_cast<int>(most)) + " degrees");
}

std::vector<Camera> draw_lenses(CameraModel asked, double half_view_rad, std::uint64_t count,
                                std::uint64_t seed) {
  const CameraModel model = asked == CameraModel::bal ? CameraModel::radial : asked;
  const Camera first = usual_lens(model, half_view_rad);
  std::vector<Camera> lenses;
  Random random(seed, kLenses);
  const ParameterRoles role = roles_of(model);
  for (std::uint64_t c = 0; c < count; ++c) {
    Camera lens = first;
    const double zoom = 1 + 0.02 * random.normal();
    for (int i = 0; i < static_cast<int>(parameter_count(model)); ++i) {
      double& k = lens.parameters[static_cast<std::size_t>(i)];
      const double other = random.normal();
      if (c == 0 || i == role.cx || i == role.cy || image_size(model) != 0) continue;
      k *= i == role.fx || i == role.fy ? std::clamp(zoom, 0.9, 1.1) : 1 + 0.05 * other;
    }
    lenses.push_back(lens);
  }
  return lenses;
}

}  // namespace sheaf
