// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "json_document.h"
#include "sheaf/covariance.h"

namespace sheaf {

const char* to_string(Gauge gauge);

/// gauge, sigma, redundancy, unknowns, then images, pairs of them, frames, sensors, cameras,
/// points, observations and weak directions; points one by one where `point_ids` asks for them.
Json covariance_json(const Problem& problem, const CovarianceOptions& options,
                     const Covariance& of);

/// A line for each parameter: kind, name, parameter, value, sigma.
std::string covariance_csv(const Problem& problem, const CovarianceOptions& options,
                           const Covariance& of);

/// For people: the gauge, the noise, medians and worst ones, weak directions.
std::string covariance_text(const Problem& problem, const CovarianceOptions& options,
                            const Covariance& of);

}  // namespace sheaf
