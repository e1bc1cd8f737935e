// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/scene_options.h"

#include <string>

namespace sheaf {
namespace {

OptionField<SceneOptions> noise(double SceneOptions::*at, const char* name, const char* unit,
                                const char* help) {
  return FieldsOf<SceneOptions>::real(
      at, {.name = name, .placeholder = "SIGMA", .unit = unit, .range = from(0), .help = help});
}

OptionTable<SceneOptions> make_scene_table() {
  using F = FieldsOf<SceneOptions>;
  using O = SceneOptions;
  return {F::whole(&O::images, {.name = "cameras",
                                .placeholder = "N",
                                .range = from(2),
                                .help = "images, each with a lens of its own unless --camera says "
                                        "so"}),
          F::whole(&O::points,
                   {.name = "points", .placeholder = "M", .range = from(1), .help = "points"}),
          F::real(&O::mean_track, {.name = "mean-track",
                                   .placeholder = "T",
                                   .range = from(2),
                                   .help = "observations of a point, on average"}),
          noise(&O::pixel_noise_px, "pixel-noise", "px", "standard deviation of the measurements"),
          noise(&O::rotation_noise_rad, "rotation-noise", "rad", "of the start's rotations"),
          noise(&O::center_noise, "center-noise", "",
                "of the start's camera centres, scene units; cameras stand about 1 apart"),
          noise(&O::point_noise, "point-noise", "", "of the start's points, scene units"),
          noise(&O::focal_noise, "focal-noise", "", "of the start's focal lengths, relative"),
          F::whole(&O::seed, {.name = "seed",
                              .placeholder = "S",
                              .range = from(0),
                              .help = "the same seed gives the same bytes on every machine"})};
}

OptionField<PhotometricSceneOptions> measured_field() {
  return FieldsOf<PhotometricSceneOptions>::made(
      OptionKind::real,
      {.name = "measured",
       .placeholder = "SIGMA_PX",
       .unit = "px",
       .range = between(0, 100),
       .nothing = true,
       .help = "write measurements.txt too, where points are seen plus noise of this size, for "
               "`sheaf photometric --anchor`"},
      [](const PhotometricSceneOptions& o) {
        return o.measured_px < 0 ? OptionValue() : OptionValue(o.measured_px);
      },
      [](PhotometricSceneOptions& o, const OptionValue& value) {
        const double* sigma = std::get_if<double>(&value);
        o.measured_px = sigma != nullptr ? *sigma : -1;
      });
}

OptionTable<PhotometricSceneOptions> make_photometric_table() {
  using F = FieldsOf<PhotometricSceneOptions>;
  using O = PhotometricSceneOptions;
  const auto real = [](double O::*at, const char* name, const char* placeholder, const char* unit,
                       OptionRange range, const char* help) {
    return F::real(
        at, {.name = name, .placeholder = placeholder, .unit = unit, .range = range, .help = help});
  };
  return {
      real(&O::wavelength_px, "wavelength", "PX", "px", from(2), "of the texture's finest wave"),
      real(&O::relief, "relief", "F", "", between(0, 0.2),
           "height of the surface's hills, in depths"),
      real(&O::noise_grey, "grey-noise", "SIGMA", "", from(0), "of every pixel, grey levels"),
      real(&O::brightness, "brightness", "F", "", between(0, 0.5),
           "how far the images' brightness strays"),
      real(&O::vignette, "vignette", "F", "", between(0, 0.9), "how much darker corners are"),
      F::flag(&O::occluder, {.name = "occluder", .help = "hide a part of the surface"}),
      real(&O::start_px, "start", "PX", "px", between(0, 100),
           "median distance of patches from their place at the start"),
      measured_field()};
}

}  // namespace

const OptionTable<SceneOptions>& scene_fields() {
  static const OptionTable<SceneOptions> kTable = make_scene_table();
  return kTable;
}

const OptionTable<PhotometricSceneOptions>& photometric_scene_fields() {
  static const OptionTable<PhotometricSceneOptions> kTable = make_photometric_table();
  return kTable;
}

}  // namespace sheaf
