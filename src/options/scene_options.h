// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "options/option_field.h"
#include "sheaf/photometric.h"
#include "sheaf/scene.h"

namespace sheaf {

/// The options of a synthetic scene: counts, noises and seed.
const OptionTable<SceneOptions>& scene_fields();

/// What a scene of images has besides; counts and seed are those of a SceneOptions.
const OptionTable<PhotometricSceneOptions>& photometric_scene_fields();

}  // namespace sheaf
