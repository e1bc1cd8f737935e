// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/brown_lens.h"

#include <string_view>
#include <vector>

namespace sheaf {
namespace {

constexpr int kFirstRadial = 4, kFirstTangential = 7;

bool is_polynomial(CameraModel model) {
  switch (model) {
    case CameraModel::simple_pinhole:
    case CameraModel::pinhole:
    case CameraModel::simple_radial:
    case CameraModel::radial:
    case CameraModel::opencv:
    case CameraModel::full_opencv:
    case CameraModel::radial_k3:
      return true;
    default:
      return false;
  }
}

/// The number of a parameter among fx, fy, cx, cy, k1, k2, k3, p1, p2, or -1.
int number_of(std::string_view name) {
  if (name == "f") return 0;
  if (name == "k") return kFirstRadial;
  constexpr std::array<std::string_view, 9> kNames{"fx", "fy", "cx", "cy", "k1",
                                                   "k2", "k3", "p1", "p2"};
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (kNames[i] == name) return static_cast<int>(i);
  return -1;
}

std::array<double*, 9> numbers_of(BrownLens& lens) {
  return {&lens.fx,   &lens.fy,   &lens.cx,   &lens.cy,  &lens.k[0],
          &lens.k[1], &lens.k[2], &lens.p[0], &lens.p[1]};
}

CameraModel model_for(const BrownLens& lens, const BrownTerms& terms) {
  const bool two = terms.two_focals || lens.fx != lens.fy;
  if (terms.radial > 2)
    return two || terms.tangential ? CameraModel::full_opencv : CameraModel::radial_k3;
  if (terms.tangential) return CameraModel::opencv;
  if (terms.radial == 0) return two ? CameraModel::pinhole : CameraModel::simple_pinhole;
  if (two) return CameraModel::opencv;
  return terms.radial == 1 ? CameraModel::simple_radial : CameraModel::radial;
}

}  // namespace

Result<BrownLens> brown_lens(const Camera& camera) {
  const std::string model(to_string(camera.model));
  const std::string what =
      "of lenses only f, cx, cy, k1, k2, k3, p1 and p2 can be stated, and the ";
  if (!is_polynomial(camera.model)) return Error(ErrorCode::usage, what + "lens is " + model);
  BrownLens out;
  const std::vector<std::string_view> names = parameter_names(camera.model);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double value = camera.parameters[i];
    if (const int n = number_of(names[i]); n >= 0) {
      *numbers_of(out)[static_cast<std::size_t>(n)] = value;
      if (names[i] == "f") out.fy = value;
    } else if (value != 0) {
      return Error(ErrorCode::usage, what + model + " lens has " + std::string(names[i]) + " = " +
                                         std::to_string(value));
    }
  }
  return out;
}

bool is_whole_panorama(const Camera& camera) {
  const double w = camera.parameters[0], h = camera.parameters[1];
  return w > 0 && w == 2 * h && w == static_cast<double>(camera.width_px) &&
         h == static_cast<double>(camera.height_px);
}

CameraOfFile camera_of(const BrownLens& lens, const BrownTerms& terms, std::uint64_t width,
                       std::uint64_t height) {
  CameraOfFile out;
  out.camera.model = model_for(lens, terms);
  out.camera.parameters.fill(0);
  out.camera.width_px = width;
  out.camera.height_px = height;
  BrownLens values = lens;
  const std::vector<std::string_view> names = parameter_names(out.camera.model);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const int n = number_of(names[i]);
    const bool known = n >= 0 && (n < kFirstRadial       ? true
                                  : n < kFirstTangential ? n - kFirstRadial < terms.radial
                                                         : terms.tangential);
    if (known) out.camera.parameters[i] = *numbers_of(values)[static_cast<std::size_t>(n)];
    if (!known) out.unknown |= static_cast<ParameterSet>(1u << i);
  }
  return out;
}

}  // namespace sheaf
