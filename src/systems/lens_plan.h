// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "systems/arrangement.h"
#include "systems/plan.h"

namespace sheaf {

/// As count_work, before anything is listed: images alone are counted exactly, what lenses add to
/// the factor of a formed matrix is estimated.
WorkCounts estimate_lens_work(const Arrangement& arranged, bool points_held, Clusters& clusters,
                              Threads& threads);

/// As it is once pairs are listed: blocks of images and of lenses alike count as images. clusters:
/// as estimated.
WorkCounts count_lens_work(const Arrangement& arranged, const LensChunks& chunks,
                           const WorkCounts& estimate);

}  // namespace sheaf
