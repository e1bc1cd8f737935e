// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>

#include "json_document.h"
#include "photometric_arguments.h"
#include "sheaf/photometric.h"
#include "sheaf/solve.h"

namespace sheaf {

/// What the JSON of a photometric refinement is made of.
struct PhotometricRecord {
  std::string in, format;
  PhotometricArguments arguments;
  double read_s = 0, write_s = 0, total_s = 0;
  std::optional<PoseErrors> before{}, after{};  ///< where poses were disturbed
};
Json photometric_json(const PhotometricRecord& record, const PhotometricSummary& summary,
                      const PhotometricProblem& problem);

}  // namespace sheaf
