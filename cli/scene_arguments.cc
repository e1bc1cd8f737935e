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
                               "200 for fisheyes, FOV, EUCM, UCM and DOUBLE_SPHERE, 360 for "
                               "EQUIRECTANGULAR",
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

std::vector<BoundOption> options_of(RigArguments& arguments) {
  using F = FieldsOf<RigArguments>;
  using A = RigArguments;
  const auto sigma = [](double A::*at, const char* name, const char* unit, const char* help) {
    return F::real(at, {.name = name,
                        .placeholder = "SIGMA",
                        .unit = unit,
                        .range = from(0),
                        .help = help,
                        .needs = {"rigs"}});
  };
  return bound<A>(
      {F::name(&A::kind, {{"stereo", "cameras side by side"}, {"around", "cameras in a circle"}},
               {.name = "rigs",
                .placeholder = "KIND",
                .nothing = true,
                .help = "a COLMAP model as OUT of a rig that drives along a street (docs/rigs.md), "
                        "through lenses of --camera (not given: OPENCV), one for each sensor",
                .excludes = {"like", "family", "outliers", "drift", "lenses", "cameras",
                             "photometric"}}),
       F::unless_zero(&A::sensors, {.name = "rig-sensors",
                                    .placeholder = "N",
                                    .range = between(1, 100),
                                    .help = "cameras of the rig; not given: 2 (stereo), 6 (around)",
                                    .needs = {"rigs"}}),
       F::whole(&A::frames, {.name = "frames",
                             .placeholder = "N",
                             .range = from(2),
                             .help = "moments at which the rig takes images, one unit apart",
                             .needs = {"rigs"}}),
       F::real(&A::missing, {.name = "missing",
                             .placeholder = "F",
                             .range = between(0, 1),
                             .help = "part of the frames that lack the image of one sensor",
                             .needs = {"rigs"}}),
       F::whole(&A::single_images, {.name = "single-images",
                                    .placeholder = "N",
                                    .range = from(0),
                                    .help = "images of no rig, mixed in",
                                    .needs = {"rigs"}}),
       sigma(&A::sensor_rotation_rad, "sensor-rotation-noise", "rad",
             "of the start's rotations of sensor_from_rig"),
       sigma(&A::sensor_translation, "sensor-translation-noise", "",
             "of the start's translations of sensor_from_rig, scene units")},
      arguments);
}

RigSceneOptions rig_options(const RigArguments& a, const LensArguments& lens,
                            const SceneOptions& scene) {
  RigSceneOptions options;
  options.kind = a.kind == "around" ? RigKind::around : RigKind::stereo;
  options.sensors = a.sensors;
  options.frames = a.frames;
  if (lens.chosen()) options.model = *camera_model_named(lens.camera);
  options.one_lens = lens.shared;
  options.field_of_view_deg = lens.field_of_view_deg;
  options.sensor_rotation_noise_rad = a.sensor_rotation_rad;
  options.sensor_translation_noise = a.sensor_translation;
  options.missing = a.missing;
  options.single_images = a.single_images;
  options.scene = scene;
  return options;
}

Json rig_json(const RigArguments& a, const LensArguments& lens) {
  if (!a.chosen())
    return {{"rigs", nullptr},
            {"rig_sensors", nullptr},
            {"frames", nullptr},
            {"missing", nullptr},
            {"single_images", nullptr},
            {"sensor_rotation_noise_rad", nullptr},
            {"sensor_translation_noise", nullptr}};
  const RigSceneOptions o = rig_options(a, lens, {});
  return {
      {"rigs", a.kind},
      {"rig_sensors", a.sensors > 0 ? Json(a.sensors) : Json(o.kind == RigKind::stereo ? 2 : 6)},
      {"frames", a.frames},
      {"missing", a.missing},
      {"single_images", a.single_images},
      {"sensor_rotation_noise_rad", a.sensor_rotation_rad},
      {"sensor_translation_noise", a.sensor_translation},
      {"family", nullptr},
      {"cameras", nullptr},
      {"camera", std::string(to_string(o.model))},
      {"lenses", lens.shared ? 1 : 0}};
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
