// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "json_document.h"
#include "sheaf/io.h"

namespace sheaf {

/// The options of reading a photometric problem as the command line states them.
struct PhotometricInputArguments {
  std::string intrinsics, images;
  PhotometricReadOptions read;
};

void add_photometric_input_options(CLI::App& verb, PhotometricInputArguments& arguments);
/// The arguments have passed their validators.
PhotometricReadOptions read_options(const PhotometricInputArguments& arguments);

/// Keys of "options".
Json photometric_input_json(const PhotometricInputArguments& arguments);

/// How far poses are from those given, after the Sim(3) that brings them together; where none were
/// disturbed, nothing.
struct PoseErrors {
  double rotation_rad = 0, center = 0;  ///< mean over the images
};
PoseErrors pose_errors(const PhotometricFolder& folder);
Json pose_errors_json(const std::optional<PoseErrors>& before,
                      const std::optional<PoseErrors>& after);

}  // namespace sheaf
