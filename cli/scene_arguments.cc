// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene_arguments.h"

#include <cmath>
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
  verb.add_option("--cameras", o.images,
                  "images, each with a lens of its own unless --camera says so")
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

void add_family_options(CLI::App& verb, FamilyArguments& a) {
  CLI::Option* like =
      verb.add_option("--like", a.like,
                      "family and size of a published problem, as ladybug-1723, trafalgar-257, "
                      "dubrovnik-356, venice-1778 or final-13682; all is synthetic")
          ->type_name("NAME");
  CLI::Option* family =
      verb.add_option("--family", a.family,
                      "street (a car's images, with loops) or collection (photographs of popular "
                      "spots), instead of a lakeside")
          ->type_name("NAME")
          ->check(one_of({"street", "collection"}));
  for (const char* name : {"--cameras", "--points", "--mean-track"})
    like->excludes(verb.get_option(name));
  like->excludes(family);
  for (const char* name : {"--rotation-noise", "--center-noise", "--point-noise", "--focal-noise"})
    for (CLI::Option* option : {like, family}) option->excludes(verb.get_option(name));
  verb.add_option("--outliers", a.outliers,
                  "with --like and --family: fraction of the measurements that are wrong")
      ->type_name("F")
      ->check(number_in(0, 1, true, "a number from 0 to 1"))
      ->capture_default_str();
  verb.add_option("--drift", a.drift,
                  "with --like and --family: size of the start's errors, 0 for none")
      ->type_name("S")
      ->check(number_in(0, 100, true, "a number from 0 to 100"))
      ->capture_default_str();
}

void add_lens_options(CLI::App& verb, LensArguments& a) {
  std::vector<std::string> names;
  for (std::size_t m = 0; m < kCameraModels; ++m)
    names.emplace_back(to_string(static_cast<CameraModel>(m)));
  CLI::Option* camera =
      verb.add_option("--camera", a.camera,
                      "a scene through lenses of this model (docs/cameras.md), as OPENCV or EUCM; "
                      "OUT is then the folder of a COLMAP model, unless its name has an extension")
          ->type_name("MODEL")
          ->check(one_of(names));
  for (const char* name : {"--like", "--family", "--outliers", "--drift"})
    camera->excludes(verb.get_option(name));
  CLI::Option* shared =
      verb.add_flag("--shared", a.shared, "with --camera: one lens for all images")->needs(camera);
  verb.add_option("--lenses", a.lenses, "with --camera: so many lenses, which images take in turn")
      ->type_name("N")
      ->check(whole_number_from(1, "a whole number from 1 up"))
      ->needs(camera)
      ->excludes(shared);
  verb.add_option(
          "--field-of-view", a.field_of_view_deg,
          "with --camera: full angle in degrees [65 for perspective models, 200 for fisheyes, "
          "FOV and EUCM]")
      ->type_name("DEGREES")
      ->check(number_in(5, 220, true, "a number from 5 to 220"))
      ->needs(camera);
}

LensSceneOptions lens_options(const LensArguments& a, const SceneOptions& scene) {
  return {.model = *camera_model_named(a.camera),
          .lenses = a.shared ? 1 : a.lenses,
          .field_of_view_deg = a.field_of_view_deg,
          .scene = scene};
}

Json lens_json(const LensArguments& a) {
  if (!a.chosen())
    return {{"camera", nullptr}, {"lenses", nullptr}, {"field_of_view_deg", nullptr}};
  return {{"family", nullptr},
          {"camera", a.camera},
          {"lenses", a.shared ? 1 : a.lenses},
          {"field_of_view_deg", a.field_of_view_deg > 0 ? Json(a.field_of_view_deg) : Json()}};
}

FamilyOptions family_options(const FamilyArguments& a, const SceneOptions& scene) {
  FamilyOptions options;
  if (!a.like.empty()) {
    options = scene_like(a.like).value();
  } else {
    options.family = a.family == "street" ? SceneFamily::street : SceneFamily::collection;
    options.images = scene.images;
    options.points = scene.points;
    options.observations =
        static_cast<std::uint64_t>(std::floor(scene.mean_track * scene.points + 0.5));
  }
  options.pixel_noise_px = scene.pixel_noise_px;
  options.outliers = a.outliers;
  options.drift = a.drift;
  options.seed = scene.seed;
  return options;
}

Json family_json(const FamilyArguments& a, const SceneOptions& scene) {
  if (!a.chosen())
    return {{"family", "lakeside"}, {"like", nullptr}, {"outliers", nullptr}, {"drift", nullptr}};
  const FamilyOptions options = family_options(a, scene);
  return {{"family", options.family == SceneFamily::street ? "street" : "collection"},
          {"like", a.like.empty() ? Json() : Json(a.like)},
          {"outliers", options.outliers},
          {"drift", options.drift},
          {"cameras", options.images},
          {"points", options.points},
          {"mean_track", static_cast<double>(options.observations) / options.points},
          {"rotation_noise_rad", nullptr},
          {"center_noise", nullptr},
          {"point_noise", nullptr},
          {"focal_noise", nullptr}};
}

}  // namespace sheaf
