// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene_arguments.h"

#include <limits>

#include "verb.h"

namespace sheaf {

void add_scene_options(CLI::App& verb, SceneOptions& o) {
  const double most = std::numeric_limits<double>::max();
  const auto noise = [&](const char* name, double& value, const char* what) {
    verb.add_option(name, value, what)
        ->type_name("SIGMA")
        ->check(number_in(0, most, true, "a number from 0 up"))
        ->capture_default_str();
  };
  verb.add_option("--cameras", o.images, "images, each with a lens of its own")
      ->type_name("N")
      ->check(whole_number_from(2, "a whole number from 2 up"))
      ->capture_default_str();
  verb.add_option("--points", o.points, "points")
      ->type_name("M")
      ->check(whole_number_from(1, "a whole number from 1 up"))
      ->capture_default_str();
  verb.add_option("--mean-track", o.mean_track, "observations of a point, on average")
      ->type_name("T")
      ->check(number_in(2, most, true, "a number from 2 up"))
      ->capture_default_str();
  noise("--pixel-noise", o.pixel_noise_px, "standard deviation of the measurements, pixels");
  noise("--rotation-noise", o.rotation_noise_rad, "of the start's rotations, radians");
  noise("--center-noise", o.center_noise,
        "of the start's camera centres, scene units (cameras stand about 1 apart)");
  noise("--point-noise", o.point_noise, "of the start's points, scene units");
  noise("--focal-noise", o.focal_noise, "of the start's focal lengths, relative");
  verb.add_option("--seed", o.seed, "the same seed gives the same bytes on every machine")
      ->type_name("S")
      ->check(whole_number_from(0, "a whole number from 0 up"))
      ->capture_default_str();
}

}  // namespace sheaf
