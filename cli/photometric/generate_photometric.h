// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "sheaf/photometric.h"
#include "sheaf/scene.h"

namespace sheaf {

struct PhotometricSceneArguments {
  bool chosen = false;
  PhotometricSceneOptions scene;
};

/// --photometric and what belongs to it, after `add_scene_options`: --cameras, --points and --seed
/// count for both.
void add_photometric_scene_options(CLI::App& verb, PhotometricSceneArguments& arguments);

/// Writes the scene into folders; returns the exit code. The counts and the seed are taken from
/// `scene` where they were given.
int generate_photometric(CLI::App& verb, PhotometricSceneArguments arguments,
                         const SceneOptions& scene, const std::string& out,
                         const std::string& truth, const std::string& json);

}  // namespace sheaf
