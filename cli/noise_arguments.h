// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>

#include "json_document.h"
#include "sheaf/scene.h"

namespace sheaf {

/// The options of `perturb` as the command line states them; what is not stated is the protocol's.
struct NoiseArguments {
  std::string protocol = "sheaf";
  std::optional<double> rotation, translation, center, point, pixel, outliers, outlier_size;
  std::optional<double> normalize, least_depth;
  std::string intrinsics;
  std::optional<std::uint64_t> seed;
};

void add_noise_options(CLI::App& verb, NoiseArguments& arguments);

/// The arguments have passed their validators.
NoiseOptions noise_options(const NoiseArguments& arguments);

Json noise_json(const NoiseOptions& options);

/// "rotations 0.01 rad, points 0.05; seed 1"
std::string noise_text(const NoiseOptions& options);

}  // namespace sheaf
