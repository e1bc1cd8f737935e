// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>

#include "sheaf/scene.h"

namespace sheaf {

/// --cameras, --points, --mean-track, the noises and --seed.
void add_scene_options(CLI::App& verb, SceneOptions& options);

}  // namespace sheaf
