// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/survey.h"

namespace sheaf {

/// A step of a run, as its JSON tells it; NaN where it does not.
struct RunStep {
  int index = 0;
  double cost = 0, trial_cost = 0, gradient = 0, change = 0, damping = 0, gain = 0, scale_px = 0;
  double time_s = 0;
  bool accepted = true;
};

/// A residual of a survey along the axes of its frame, with what was stated.
struct RunSurveyResidual {
  std::string name;
  std::array<double, 3> residual{}, sigma{}, adjusted{};  ///< unit of the frame
  double worst_sigmas = 0;
  bool blunder = false;
};

struct RunSurvey {
  std::string frame;
  std::vector<std::string> words;
  std::vector<RunSurveyResidual> positions, control, check;
  std::array<double, 3> positions_rmse{}, control_rmse{}, check_rmse{};
  WorldFrame world;  ///< of `adjusted`, with its origin
};

/// What the JSON of `solve` says of a run. Texts are empty and numbers NaN where it does not say.
struct RunRecord {
  std::string version, command;
  std::string unit = "px";  ///< of residuals
  std::string path, format, sha256;
  double bytes = 0;
  std::vector<std::pair<std::string, std::string>> options;  ///< key, value as text
  std::string solver, reason, precision, simd;
  int threads = 0;
  double forecast_bytes = 0, peak_bytes = 0;
  double initial_cost = 0, final_cost = 0;
  std::string loss;
  double loss_scale_px = 0;
  std::string code, words;  ///< why it ended
  std::vector<RunStep> steps;
  int recoveries = 0;
  double read_s = 0, setup_s = 0, solve_s = 0, write_s = 0, total_s = 0;
  std::optional<RunSurvey> survey;

  bool converged() const { return code.find("converged") != std::string::npos; }
};

/// name: of the file, for messages. Errors: unreadable_input for what is no JSON, or not that of a
/// solve (no termination, no iterations).
Result<RunRecord> read_run(const std::string& json, const std::string& name);

}  // namespace sheaf
