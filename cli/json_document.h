// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "options/option_field.h"
#include "sheaf/io.h"
#include "sheaf/problem.h"
#include "sheaf/scene.h"
#include "sheaf/solve.h"

namespace sheaf {

struct Statistics;

using Json = nlohmann::ordered_json;  // keys in the order of docs/json.md

/// A number, or null when it is not finite: JSON has no other way to say it.
Json number(double value);

/// Keys shared by the verbs; docs/json.md explains each.
Json input_json(const std::string& path, const InputFile& input);
Json counts_json(const Problem& problem);
Json observations_json(const std::vector<std::uint64_t>& ids, const Problem& problem);
Json statistics_json(const Statistics& statistics);
Json scene_options_json(const SceneOptions& options);
/// Key and value of each option that a verb has of its own.
Json options_json(const std::vector<BoundOption>& options);
Json iteration_json(const Iteration& iteration);
Json iterations_json(const Summary& summary);
Json changes_json(const Summary& summary);
Json recoveries_json(const Summary& summary);
Json loss_json(const Summary& summary);
Json checkpoints_json(const Summary& summary);

/// What the JSON of a solve is made of.
struct SolveRecord {
  Json input, options;
  std::string command{};     ///< that was given
  Json rig_configuration{};  ///< null without --rigs
  Evaluation before, after;  ///< by independent code
  bool agrees = true;        ///< the solver's final cost with it
  double read_s = 0, cpu_s = 0, write_s = 0, total_s = 0;
};
Json solve_json(const SolveRecord& record, const Summary& summary, const Problem& problem);

/// Appears whole or not at all. Throws Error (ErrorCode::unwritable_output).
void write_json(const Json& document, const std::string& path);

}  // namespace sheaf
