// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "json_document.h"
#include "report/matching.h"

namespace sheaf {

/// What two models have in common: `first` and `second` end the keys of what only one of them has,
/// such as images_only_in_estimate.
Json matching_json(const Matching& matching, const Problem& estimate, const Problem& reference,
                   const std::string& first, const std::string& second);

/// The same in words, "the estimate" and "the reference" being what the two are called; nothing
/// where they have everything in common.
std::string matching_text(const Matching& matching, const Problem& estimate,
                          const Problem& reference, const std::string& first,
                          const std::string& second);

}  // namespace sheaf
