// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "scene/rig_configuration.h"
#include "sheaf/error.h"

namespace sheaf {

/// A file of rigs, and what of it is not used.
struct RigConfigurationFile {
  std::vector<RigConfiguration> rigs;
  std::vector<std::string> notes;  ///< sentences
};

/// Reads COLMAP's rig_config.json: a list of rigs, each with a list "cameras" of image_prefix and
/// either ref_sensor (true) or, where it is known, cam_from_rig_rotation (w, x, y, z) with
/// cam_from_rig_translation. camera_model_name and camera_params are noted and not used. Errors:
/// unreadable_input with file, line, what was found, what was expected.
Result<RigConfigurationFile> read_rig_configuration(const std::filesystem::path& path);
Result<RigConfigurationFile> parse_rig_configuration(const std::string& text,
                                                     const std::string& name);

}  // namespace sheaf
