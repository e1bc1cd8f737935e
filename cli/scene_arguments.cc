// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene_arguments.h"

#include <cmath>
#include <string>
#include <vector>

namespace sheaf {

std::vector<BoundOption> options_of(FamilyArguments& arguments) {
  using F = FieldsOf<FamilyArguments>;
  const std::vector<std::string> noises = {"rotation-noise", "center-noise", "point-noise",
                                           "focal-noise"};
  std::vector<std::string> stated = {"cameras", "points", "mean-track", "family"};
  stated.insert(stated.end(), noises.begin(), noises.end());
  return bound<FamilyArguments>(
      {F::text(&FamilyArguments::like,
               {.name = "like",
                .placeholder = "NAME",
                .help = "family and size of a published problem, as ladybug-1723, trafalgar-257, "
                        "dubrovnik-356, venice-1778 or final-13682; all is synthetic",
                .excludes = stated}),
       F::name(&FamilyArguments::family,
               {{"street", "a car's images, with loops"},
                {"collection", "photographs of popular spots"}},
               {.name = "family",
                .placeholder = "NAME",
                .nothing = true,
                .help = "instead of a lakeside",
                .excludes = noises}),
       F::real(&FamilyArguments::outliers,
               {.name = "outliers",
                .placeholder = "F",
                .range = between(0, 1),
                .help = "with --like and --family: fraction of the measurements that are wrong"}),
       F::real(&FamilyArguments::drift,
               {.name = "drift",
                .placeholder = "S",
                .range = between(0, 100),
                .help = "with --like and --family: size of the start's errors, 0 for none"})},
      arguments);
}

std::vector<BoundOption> options_of(LensArguments& arguments) {
  using F = FieldsOf<LensArguments>;
  std::vector<OptionChoice> models;
  for (std::size_t m = 0; m < kCameraModels; ++m)
    models.push_back({std::string(to_string(static_cast<CameraModel>(m)))});
  return bound<LensArguments>(
      {F::name(
           &LensArguments::camera, models,
           {.name = "camera",
            .placeholder = "MODEL",
            .nothing = true,
            .help = "a COLMAP model as OUT (unless its name has an extension) of a scene through "
                    "lenses of this model (docs/cameras.md)",
            .excludes = {"like", "family", "outliers", "drift"}}),
       F::flag(&LensArguments::shared, {.name = "shared",
                                        .help = "with --camera: one lens for all images",
                                        .needs = {"camera"}}),
       F::unless_zero(&LensArguments::lenses,
                      {.name = "lenses",
                       .placeholder = "N",
                       .range = from(1),
                       .help = "with --camera: so many lenses, which images take in turn",
                       .needs = {"camera"},
                       .excludes = {"shared"}}),
       F::unless_zero(&LensArguments::field_of_view_deg,
                      {.name = "field-of-view",
                       .placeholder = "DEGREES",
                       .unit = "deg",
                       .range = between(5, 220),
                       .help = "with --camera: full angle; not given: 65 for perspective models, "
                               "200 for fisheyes, FOV and EUCM",
                       .needs = {"camera"}})},
      arguments);
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
