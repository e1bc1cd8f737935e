// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "json_document.h"
#include "options/option_field.h"
#include "sheaf/scene.h"

namespace sheaf {

/// Scenes of a family; counts, pixel noise and seed are those of the SceneOptions.
struct FamilyArguments {
  std::string like, family;  ///< both empty: the lakeside that SceneOptions describes
  double outliers = FamilyOptions().outliers;
  double drift = FamilyOptions().drift;
  bool chosen() const { return !like.empty() || !family.empty(); }
};

/// --like, --family, --outliers and --drift.
std::vector<BoundOption> options_of(FamilyArguments& arguments);

/// Scenes through lenses of a model; counts, noises and seed are those of the SceneOptions.
struct LensArguments {
  std::string camera;  ///< name of a model; empty: no such scene
  bool shared = false;
  std::uint64_t lenses = 0;
  double field_of_view_deg = 0;
  bool chosen() const { return !camera.empty(); }
};

/// --camera, --shared, --lenses and --field-of-view.
std::vector<BoundOption> options_of(LensArguments& arguments);
LensSceneOptions lens_options(const LensArguments& arguments, const SceneOptions& scene);
/// `null`s where no such scene was asked for.
Json lens_json(const LensArguments& arguments);

/// Scenes of rigs; points, noises and seed are those of the SceneOptions, model and field of view
/// those of the LensArguments.
struct RigArguments {
  std::string kind;  ///< "stereo" or "around"; empty: no such scene
  std::uint64_t sensors = 0;
  std::uint64_t frames = RigSceneOptions().frames;
  double missing = 0;
  std::uint64_t single_images = 0;
  double sensor_rotation_rad = 0, sensor_translation = 0;
  bool chosen() const { return !kind.empty(); }
};

/// --rigs, --rig-sensors, --frames, --missing, --single-images, --sensor-rotation-noise and
/// --sensor-translation-noise.
std::vector<BoundOption> options_of(RigArguments& arguments);
RigSceneOptions rig_options(const RigArguments& rigs, const LensArguments& lens,
                            const SceneOptions& scene);
/// `null`s where no such scene was asked for; else also what differs from that of lenses.
Json rig_json(const RigArguments& rigs, const LensArguments& lens);

/// Throws Error (ErrorCode::usage) for a name that is not known.
FamilyOptions family_options(const FamilyArguments& arguments, const SceneOptions& scene);

/// What differs from the `options` of a lakeside scene, and the family's own.
Json family_json(const FamilyArguments& arguments, const SceneOptions& scene);

}  // namespace sheaf
