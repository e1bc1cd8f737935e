// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "json_document.h"
#include "photometric/photometric_input.h"
#include "sheaf/photometric.h"
#include "sheaf/solve.h"

namespace sheaf {

/// What the JSON of a photometric refinement is made of.
struct PhotometricRecord {
  std::string in, format;
  Json options;
  std::vector<std::string> pictures;  ///< names in their folder
  double read_s = 0, write_s = 0, total_s = 0;
  std::optional<PoseErrors> before{}, after{};  ///< where poses were disturbed
};
Json photometric_json(const PhotometricRecord& record, const PhotometricSummary& summary,
                      const PhotometricDetails& details, const PhotometricProblem& problem);

/// Over the points that patches determine: of the inverse depths, or of X, Y and Z together; NaN of
/// none.
double median_sigma(const PhotometricDetails& details);

}  // namespace sheaf
