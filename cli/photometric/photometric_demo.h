// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "json_document.h"
#include "report/errors.h"
#include "sheaf/photometric.h"
#include "sheaf/solve.h"
#include "sheaf/stop.h"

namespace sheaf {

/// A generated scene refined from its pixels.
struct PhotometricDemo {
  PhotometricSceneOptions scene;
  PhotometricSummary summary;
  StateErrors before, after;  ///< against the truth
  double seconds = 0;         ///< of the refinement
};

PhotometricDemo run_photometric_demo(std::uint64_t seed, int threads, const StopToken& stop);
void tell(const PhotometricDemo& demo);
Json photometric_demo_json(const PhotometricDemo& demo);

}  // namespace sheaf
