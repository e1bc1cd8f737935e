// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include "photometric/photometric_input.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// The options of a photometric refinement as the command line states them.
struct PhotometricArguments {
  PhotometricInputArguments input;
  int max_iterations = PhotometricOptions().max_iterations;
  double tolerance = PhotometricOptions().tolerance;
  double motion_px = PhotometricOptions().motion_px;
  double time_limit_s = 0;  ///< 0: none
  std::string interpolation = "bicubic";
  std::string brightness = "affine";
  std::string loss = "huber:auto";
  std::string loss_on = "pixel";
  std::string leaving = "truncated";
  std::string warp = "auto";
  std::string points = "auto";
  std::string pattern = PhotometricOptions().pattern;
  double min_zncc = PhotometricOptions().min_zncc;
  int levels = PhotometricOptions().levels;
  int rounds = PhotometricOptions().rounds;
  std::string rows = "shared";
  double anchor_px = 0;  ///< 0: none
  std::string anchor_loss = "none";
  std::string fix;
  std::uint64_t memory_limit_bytes = 0;  ///< none
  double initial_damping = 0;
};

void add_photometric_options(CLI::App& verb, PhotometricArguments& arguments);

/// Everything but threads and callbacks. The arguments have passed their validators.
PhotometricOptions photometric_options(const PhotometricArguments& arguments);

}  // namespace sheaf
