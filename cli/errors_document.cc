// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "errors_document.h"

#include <fmt/format.h>

#include <cmath>

namespace sheaf {
namespace {

constexpr double kDegrees = 57.295779513082321;  // of a radian

std::string error_line(const char* what, const ErrorStatistics& e, double unit = 1) {
  return fmt::format("{:<22} {:>12.6g} {:>12.6g} {:>12.6g} {:>12.6g}\n", what, unit * e.mean,
                     unit * e.median, unit * e.rms, unit * e.max);
}

std::string alignment_text(const StateAlignment& a) {
  if (!a.aligned) return "aligned     no: as the files have it\n";
  const double turn = 2 * std::atan2(std::hypot(a.similarity.rotation[1], a.similarity.rotation[2],
                                                a.similarity.rotation[3]),
                                     std::fabs(a.similarity.rotation[0]));
  const auto& t = a.similarity.translation;
  return fmt::format(
      "aligned     by {} of {} {}: scale {:.9g}, turned by {:.6g} deg, moved by {:.6g}\n",
      a.inliers, a.places, a.by_points ? "points" : "camera centres", a.similarity.scale,
      kDegrees * turn, std::hypot(t[0], t[1], t[2]));
}

}  // namespace

Json error_json(const ErrorStatistics& e) {
  return {{"mean", number(e.mean)},
          {"median", number(e.median)},
          {"rms", number(e.rms)},
          {"max", number(e.max)}};
}

Json errors_json(const StateErrors& errors) {
  const auto of_rigs = [&](const ErrorStatistics& e) {
    return errors.has_rigs ? error_json(e) : Json();
  };
  return {{"aligned", errors.aligned},
          {"scale", number(errors.scale)},
          {"rotation_error_rad", error_json(errors.rotation_error_rad)},
          {"translation_error", error_json(errors.translation_error)},
          {"center_error", error_json(errors.center_error)},
          {"point_error", errors.has_points ? error_json(errors.point_error) : Json()},
          {"frame_rotation_error_rad", of_rigs(errors.frame_rotation_error_rad)},
          {"frame_center_error", of_rigs(errors.frame_center_error)},
          {"sensor_rotation_error_rad", of_rigs(errors.sensor_rotation_error_rad)},
          {"sensor_translation_error", of_rigs(errors.sensor_translation_error)}};
}

std::string errors_csv(const ErrorLists& lists) {
  std::string out = "image,rotation_error_rad,rotation_error_deg,translation_error,center_error\n";
  for (std::size_t j = 0; j < lists.rotation_rad.size(); ++j)
    out +=
        fmt::format("{},{},{},{},{}\n", lists.matching.images[j].reference, lists.rotation_rad[j],
                    kDegrees * lists.rotation_rad[j], lists.translation[j], lists.center[j]);
  return out;
}

std::string errors_text(const ErrorLists& lists) {
  const StateErrors errors = summarise(lists);
  std::string out = alignment_text(lists.alignment);
  out += fmt::format("Mean rot error    {:.6g} rad ({:.6g} deg)\n", errors.rotation_error_rad.mean,
                     kDegrees * errors.rotation_error_rad.mean);
  out += fmt::format("Mean trans error  {:.6g}\n\n", errors.translation_error.mean);
  out +=
      fmt::format("{:<22} {:>12} {:>12} {:>12} {:>12}\n", "error", "mean", "median", "rms", "max");
  out += error_line("rotation (rad)", errors.rotation_error_rad);
  out += error_line("rotation (deg)", errors.rotation_error_rad, kDegrees);
  out += error_line("translation (of t)", errors.translation_error);
  out += error_line("camera centre", errors.center_error);
  if (errors.has_points) out += error_line("point", errors.point_error);
  if (!errors.has_rigs) return out;
  out += error_line("frame rotation (rad)", errors.frame_rotation_error_rad);
  out += error_line("frame centre", errors.frame_center_error);
  out += error_line("sensor rotation (rad)", errors.sensor_rotation_error_rad);
  out += error_line("sensor translation", errors.sensor_translation_error);
  return out;
}

}  // namespace sheaf
