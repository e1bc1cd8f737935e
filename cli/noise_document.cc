// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "noise_document.h"

#include <fmt/format.h>

#include <vector>

#include "options/noise_options.h"

namespace sheaf {

Json noise_json(const NoiseOptions& o) {
  return {{"protocol", name_of(o.protocol)},
          {"rotation_rad", o.rotation_rad},
          {"translation", o.translation},
          {"center", o.center},
          {"point", o.point},
          {"sensor_rotation_rad", o.sensor_rotation_rad},
          {"sensor_translation", o.sensor_translation},
          {"intrinsics", o.intrinsics},
          {"intrinsics_relative", o.intrinsics_relative},
          {"pixel_px", o.pixel_px},
          {"outliers", o.outliers},
          {"outlier_px", o.outlier_px},
          {"normalize_to", o.normalize_to},
          {"min_depth", o.least_depth},
          {"seed", o.seed}};
}

std::string noise_text(const NoiseOptions& o) {
  std::vector<std::string> kinds;
  const auto add = [&](const char* name, double sigma, const char* unit) {
    if (sigma > 0) kinds.push_back(fmt::format("{} {:.6g}{}", name, sigma, unit));
  };
  add("rotations", o.rotation_rad, " rad");
  add("translations", o.translation, "");
  add("centres", o.center, "");
  add("points", o.point, "");
  add("sensors turned", o.sensor_rotation_rad, " rad");
  add("sensors moved", o.sensor_translation, "");
  const char* const names[] = {"f", "k1", "k2"};
  for (std::size_t k = 0; k < 3; ++k) {
    add(names[k], o.intrinsics[k], k == 0 ? " px" : "");
    add(names[k], 100 * o.intrinsics_relative[k], "%");
  }
  add("pixels", o.pixel_px, " px");
  return fmt::format("{}; seed {}",
                     kinds.empty() ? "none" : fmt::format("{}", fmt::join(kinds, ", ")), o.seed);
}

}  // namespace sheaf
