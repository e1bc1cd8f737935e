// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "photometric/generate_photometric.h"

#include <fmt/format.h>

#include <limits>
#include <utility>

#include "json_document.h"
#include "outputs.h"
#include "sheaf/io.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

void write_folder(PhotometricProblem problem, const std::string& path) {
  PhotometricFolder folder;
  folder.problem = std::move(problem);
  write_photometric(folder, path).value();
}

Json document_of(const PhotometricSceneOptions& o, const std::string& out, const std::string& truth,
                 double total_s) {
  return {{"version", SHEAF_VERSION},
          {"options",
           {{"cameras", o.images},
            {"points", o.points},
            {"wavelength_px", o.wavelength_px},
            {"relief", o.relief},
            {"grey_noise", o.noise_grey},
            {"brightness", o.brightness},
            {"vignette", o.vignette},
            {"occluder", o.occluder},
            {"outliers", o.outliers},
            {"start_px", o.start_px},
            {"measured_px", o.measured_px < 0 ? Json() : Json(o.measured_px)},
            {"seed", o.seed}}},
          {"output", out},
          {"truth", truth.empty() ? Json() : Json(truth)},
          {"images", o.images},
          {"points", o.points},
          {"time", {{"total_s", total_s}}}};
}

}  // namespace

void add_photometric_scene_options(CLI::App& verb, PhotometricSceneArguments& a) {
  const double most = std::numeric_limits<double>::max();
  CLI::Option* flag = verb.add_flag(
      "--photometric", a.chosen,
      "make images of a textured surface instead: OUT and --truth are folders for `sheaf "
      "photometric`; of the other options --cameras (6), --points (2000), --outliers (0, points at "
      "a wrong depth) and --seed count");
  const auto number = [&](const char* name, const char* type, double& value, double highest,
                          const char* what, const char* range) {
    verb.add_option(name, value, what)
        ->type_name(type)
        ->check(number_in(0, highest, true, range))
        ->capture_default_str()
        ->needs(flag);
  };
  PhotometricSceneOptions& o = a.scene;
  verb.add_option("--wavelength", o.wavelength_px, "of the texture's finest wave, pixels")
      ->type_name("PX")
      ->check(number_in(2, most, true, "a number of pixels from 2 up"))
      ->capture_default_str()
      ->needs(flag);
  number("--relief", "F", o.relief, 0.2, "height of the surface's hills, in depths",
         "a number from 0 to 0.2");
  number("--grey-noise", "SIGMA", o.noise_grey, most, "of every pixel, grey levels",
         "a number from 0 up");
  number("--brightness", "F", o.brightness, 0.5, "how far the images' brightness strays",
         "a number from 0 to 0.5");
  number("--vignette", "F", o.vignette, 0.9, "how much darker corners are",
         "a number from 0 to 0.9");
  verb.add_flag("--occluder", o.occluder, "hide a part of the surface")->needs(flag);
  number("--start", "PX", o.start_px, 100,
         "median distance of patches from their place at the start",
         "a number of pixels from 0 to 100");
  verb.add_option("--measured", o.measured_px,
                  "write measurements.txt too, where points are seen plus noise of this size, for "
                  "`sheaf photometric --anchor`")
      ->type_name("SIGMA_PX")
      ->check(number_in(0, 100, true, "a number of pixels from 0 to 100"))
      ->needs(flag);
  for (const char* name :
       {"--like", "--family", "--camera", "--drift", "--mean-track", "--pixel-noise",
        "--rotation-noise", "--center-noise", "--point-noise", "--focal-noise"})
    flag->excludes(verb.get_option(name));
}

int generate_photometric(CLI::App& verb, PhotometricSceneArguments arguments,
                         const SceneOptions& scene, const std::string& out,
                         const std::string& truth, const std::string& json) {
  const Timer total;
  check_outputs({{"--json", json}});
  PhotometricSceneOptions& o = arguments.scene;
  o.eight_bit = true;
  if (verb.count("--cameras") > 0) o.images = static_cast<std::uint32_t>(scene.images);
  if (verb.count("--points") > 0) o.points = static_cast<std::uint32_t>(scene.points);
  o.seed = scene.seed;
  PhotometricScene made = generate(o).value();
  if (!truth.empty()) write_folder(std::move(made.truth), truth);
  write_folder(std::move(made.start), out);
  fmt::print("{}: {} images of {} x {} pixels, {} points\n", out, o.images, o.width, o.height,
             o.points);
  if (!json.empty()) write_json(document_of(o, out, truth, total.seconds()), json);
  return 0;
}

}  // namespace sheaf
