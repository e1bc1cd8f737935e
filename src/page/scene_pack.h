// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "page/page_scene.h"
#include "page/scene_view.h"
#include "sheaf/error.h"

namespace sheaf {

/// What the page's script shows in 3D and in its panel: numbers as one compressed block, and a text
/// that says what is where in it (`meta`, JSON).
struct ScenePack {
  std::string data;                ///< deflate, base64
  std::string meta;                ///< members of a JSON object, without its braces
  std::uint64_t points = 0;        ///< that are drawn
  std::uint64_t observations = 0;  ///< that are kept
};

/// Beyond so many, points and observations are thinned: those that are off are kept first, of the
/// rest a fair sample.
struct PackLimits {
  std::size_t points = 400000;
  std::size_t observations = 150000;
};

/// point_sigma: scene units, one for each point, or empty; not finite where not determined.
/// threads: 0 takes all; the block does not depend on it. Errors: memory_limit where the block
/// cannot be compressed.
Result<ScenePack> pack_scene(const PageScene& scene, const SceneView& view,
                             const std::vector<double>& point_sigma, const PackLimits& limits = {},
                             int threads = 1);

}  // namespace sheaf
