// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "json_document.h"
#include "report/comparison.h"

namespace sheaf {

/// What all runs of a comparison have in common, and what they are held against.
struct ComparisonRecord {
  std::vector<SolverRun> runs;
  std::vector<double> taus;  ///< times to best (1 + tau)
  int threads = 1;
  double best = 0;  ///< least cost found by anyone, evaluated independently
};

/// A line for each solver: its run of median total time.
std::string comparison_text(const ComparisonRecord& record);

/// A column for each solver's median run: seconds and chi2 of each step, which were rejected.
std::string steps_table(const ComparisonRecord& record);

/// The list `runs` of docs/json.md.
Json runs_json(const ComparisonRecord& record);

}  // namespace sheaf
