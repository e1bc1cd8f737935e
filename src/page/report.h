// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>

#include "sheaf/covariance.h"
#include "sheaf/error.h"
#include "sheaf/loss.h"
#include "sheaf/problem.h"
#include "sheaf/stop.h"

namespace sheaf {

struct PhotometricPart;

/// What a report is made from beside the two states (docs/report.md).
struct ReportOptions {
  std::string title{};             ///< heading, and title of the page; empty: "Adjustment"
  std::filesystem::path images{};  ///< folder of the images, for thumbnails; empty: none
  std::string summary{};           ///< text of `solve --json`; empty: nothing is told of a run
  std::string summary_name = "summary";  ///< what messages call it
  Fixed fixed{};                         ///< as in the solve: what is held has no sigma
  Loss loss{};                           ///< as at the end of the solve, with its scale
  /// Whether sigmas are computed, which takes as long as a solve; where there are more than 500
  /// images or a million observations they are left out in any case.
  bool sigmas = true;
  /// Both states are in a frame that means something, such as a survey's: the start is not moved
  /// onto the result before they are compared.
  bool in_place = false;
  int threads = 0;                               ///< 0: all
  const PhotometricPart* photometric = nullptr;  ///< of a refinement by pixels; null: none
  /// What `report_precision` found while a survey's terms were in the problem, which has lost them
  /// since; null: it is found here.
  const Covariance* precision = nullptr;
  StopToken stop{};  ///< asked while sigmas are computed, which are then left out
  double time_limit_s = std::numeric_limits<double>::infinity();  ///< of the sigmas, likewise
};

/// How well a state is known as a report tells it, the terms of the problem counted; nothing where
/// that is not wanted, takes too long (ReportOptions::sigmas), or nothing is determined.
std::optional<Covariance> report_precision(const Problem& result, const ReportOptions& options);

/// A report as one page of HTML that needs nothing beside it: no file, no network. before: the
/// start, on which `after` improved, or null where there is but one state. Images and points are
/// matched as in `sheaf evaluate`. The same input gives the same bytes. Errors: usage for problems
/// that are not of one scene or that `validate` refuses; unreadable_input for a summary that is no
/// JSON of a solve.
Result<std::string> report_page(const Problem* before, const Problem& after,
                                const ReportOptions& options = {});

/// The same into a file, which appears whole or not at all. Errors: likewise, and
/// unwritable_output.
Result<void> write_report(const Problem* before, const Problem& after,
                          const std::filesystem::path& path, const ReportOptions& options = {});

}  // namespace sheaf
