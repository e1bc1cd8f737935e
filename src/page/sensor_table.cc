// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/sensor_table.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "chart/number_text.h"
#include "page/html.h"

namespace sheaf {

std::string sensor_table(const Problem& problem, const Covariance* known) {
  constexpr std::size_t kMost = 200;
  const Rigs& rigs = problem.rigs;
  if (known == nullptr || known->sensors.size() != rigs.num_sensors()) return "";
  const SceneMetadata* told = problem.metadata.get();
  const bool named = told != nullptr && told->sensor_ids.size() == rigs.num_sensors();
  std::string body;
  for (std::size_t s = 0; s < std::min(kMost, rigs.num_sensors()); ++s) {
    // A step is left of sensor_from_rig: its translation turned is that of the sensor's centre.
    const Covariance6& c = known->sensors[s];
    const double place = std::sqrt(c[0] + c[7] + c[14]);
    const double turn = std::sqrt(c[21] + c[28] + c[35]) * 57.29577951308232;
    if (rigs.is_reference[s] != 0 || !(place > 0 || turn > 0)) continue;
    body +=
        "<tr><th scope=\"row\">" +
        (named ? "camera " + std::to_string(told->sensor_ids[s]) : "sensor " + std::to_string(s)) +
        "</th><td>" + std::to_string(rigs.sensor_rig[s]) + "</td><td>" + digits(place, 2) +
        "</td><td>" + digits(turn, 2) + "</td></tr>";
  }
  if (body.empty()) return "";
  return part_heading("Sensors in their rigs", "how well their place and turn there are known") +
         scrolling("Sensors in their rigs",
                   "<table class=\"num\"><thead><tr><th>sensor</th><th>rig</th><th>σ of its "
                   "place</th><th>σ of its turn, °</th></tr></thead><tbody>" +
                       body + "</tbody></table>");
}

}  // namespace sheaf
