// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "interrupt.h"
#include "options/option_field.h"
#include "sheaf/photometric.h"

namespace sheaf {

struct PhotometricSceneArguments {
  bool chosen = false;
  PhotometricSceneOptions scene;
};

/// --photometric and what belongs to it.
std::vector<BoundOption> options_of(PhotometricSceneArguments& arguments);

/// Writes the scene into folders; returns the exit code.
int generate_photometric(const PhotometricSceneOptions& options, const std::string& out,
                         const std::string& truth, const std::string& json, Interrupt& interrupt);

}  // namespace sheaf
