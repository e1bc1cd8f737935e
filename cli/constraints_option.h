// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "json_document.h"
#include "options/option_field.h"
#include "sheaf/survey.h"

namespace sheaf {

/// --constraints of the verbs that know a survey.
struct ConstraintsArguments {
  std::vector<std::string> paths;  ///< of the survey; empty: none
  std::string residuals;           ///< CSV that is written; empty: none
};
/// With --residuals for a verb that adjusts.
std::vector<BoundOption> options_of(ConstraintsArguments& arguments, bool adjusts);

/// The files that a verb reads, with those of the survey.
std::vector<std::string> with_survey(std::vector<std::string> inputs,
                                     const ConstraintsArguments& arguments);

/// What the option names, as one survey. Throws Error.
Constraints read_constraints(const ConstraintsArguments& arguments);

/// Reads the survey and brings the problem into its frame, with all that it adds; nothing without
/// the option. Throws Error.
std::optional<Survey> place_survey(const ConstraintsArguments& arguments, Problem& problem,
                                   const Fixed& fixed);

/// Lines for people: what is used, what not and why, how the model was moved.
std::string survey_text(const Survey& survey);
/// The same of residuals: root mean squares, the worst ones, blunders.
std::string residuals_text(const SurveyReport& report);

/// Null without a survey; without a report (of a check) residuals are left out.
Json survey_json(const std::optional<Survey>& survey, const SurveyReport* report);

/// What leads from the local frame that a model is written in back to the survey's coordinates.
Json frame_json(const Survey& survey);

/// The same as frame.json in the folder of a COLMAP model; the path of the file, or "" beside
/// formats that are one file. Throws Error.
std::string write_frame(const Survey& survey, const std::string& format, const std::string& model);
/// Residuals as CSV. Throws Error.
void write_residuals(const SurveyReport& report, const std::string& path);

}  // namespace sheaf
