// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "sheaf/photometric.h"

namespace sheaf {

/// What the process will be resident with beyond the problem at most, while it refines and looks at
/// the result. Which patches are seen is looked up for some of the points, evenly spread.
std::uint64_t forecast_photometric(const PhotometricProblem& problem,
                                   const PhotometricOptions& options, const Pattern& pattern,
                                   int threads);

}  // namespace sheaf
