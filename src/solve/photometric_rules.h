// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "geometry/loss.h"
#include "sheaf/error.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// What a median of |r| is multiplied with to estimate the standard deviation of normal residuals.
constexpr double kSigmaPerMedian = 1.4826022185056018;

constexpr double kLeastSigma = 1;  ///< grey levels, of an automatic scale: no camera is better

/// The patch's pixels where options and problem go together. Errors: ErrorCode::usage.
Result<Pattern> check_photometric(const PhotometricProblem& problem,
                                  const PhotometricOptions& options);

/// The loss of residuals whose noise is sigma (grey levels): its own scale, or the automatic one.
ScaledLoss scaled_for(const PhotometricOptions& options, const Pattern& pattern, double sigma);

}  // namespace sheaf
