// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "inspect/finding_list.h"
#include "page/page_scene.h"
#include "page/run_record.h"
#include "sheaf/covariance.h"

namespace sheaf {

/// What the page's sections are made from, beside the scene. Null: not known.
struct PageFacts {
  const RunRecord* run = nullptr;
  const Covariance* covariance = nullptr;
  std::vector<Finding> findings;  ///< of the result
};

/// The page's first words, their reasons with remedies, and six figures.
struct Verdict {
  std::string headline;  ///< text
  std::string reasons;   ///< html: items of a list
  std::string figures;   ///< html: entries of a list of terms
};
Verdict verdict(const PageScene& scene, const PageFacts& facts);

}  // namespace sheaf
