// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "io/json_lines.h"
#include "sheaf/survey.h"

namespace sheaf {

/// Of a height that is not stated (it is 0 then), metres: it says nothing.
inline constexpr double kUnknownHeightSigma = 1e4;

/// survey.json, as docs/constraints.md has it. Errors as `read_constraints`.
Result<Constraints> parse_survey_json(const JsonValue& root, const std::string& name);

/// gcp_list.txt: a line of the coordinates' frame, then x y z, pixel x y, image, name of the point.
Result<Constraints> parse_gcp_list(const std::string& text, const std::string& name);
/// geo.txt: a line of the coordinates' frame, then image x y z, three angles, two accuracies.
Result<Constraints> parse_geo_txt(const std::string& text, const std::string& name);
/// A table of positions with a line of column names.
Result<Constraints> parse_position_table(const std::string& text, const std::string& name);

/// Whether a text is OpenSfM's ground_control_points.json, whose points have observations.
bool is_opensfm_points(const JsonValue& root);
Result<Constraints> parse_opensfm_points(const JsonValue& root, const std::string& name);

/// The table pose_priors of a database of COLMAP: positions, and directions of gravity.
Result<Constraints> read_pose_priors(const std::filesystem::path& path);
/// The GPS tags of a JPEG, or of those in a folder and its folders.
Result<Constraints> read_image_positions(const std::filesystem::path& path);

/// Several files as one. Errors: unreadable_input, where their frames differ.
Result<Constraints> merge_constraints(std::vector<Constraints> parts);

/// What the files have in common that no reader sees line by line: ids that occur twice, ends of
/// scale bars that are no points. Errors: unreadable_input with file and line.
Result<void> check_constraints(const Constraints& constraints);

}  // namespace sheaf
