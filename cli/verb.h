// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <initializer_list>
#include <string>
#include <vector>

#include "options/option_field.h"

namespace sheaf {

/// A verb of the command: what it takes, and what it does.
struct Verb {
  std::string name, purpose;
  std::string examples;                          ///< below the help; the first one runs as it is
  std::vector<BoundOption> places{}, options{};  ///< arguments by place, all needed; and by name
  std::vector<BoundOption> more_places{};        ///< behind those that are needed
  /// Once all that was given is set. Returns the exit code; errors are thrown as sheaf::Error.
  std::function<int()> run{};
};

Verb solve_verb();
Verb info_verb();
Verb check_verb();
Verb convert_verb();
Verb perturb_verb();
Verb evaluate_verb();
Verb align_verb();
Verb covariance_verb();
Verb calibrate_verb();
Verb compare_verb();
Verb photometric_verb();
Verb generate_verb();
Verb demo_verb();
Verb split_verb();
Verb join_verb();
Verb report_verb();
Verb view_verb();
/// All of them, in the order of the command's help.
std::vector<Verb> all_verbs();

/// What every verb takes.
struct CommonOptions {
  std::string json;    ///< file for the result as JSON, or empty
  int threads = 0;     ///< 0: all
  bool quiet = false;  ///< nothing on stderr but errors
};
std::vector<BoundOption> options_of(CommonOptions& options);

/// The command line that a verb was given, as far as it says something: what is as before anything
/// was given is left out. Asked for once all is set; made before.
std::function<std::string()> command_of(const Verb& verb);

/// Lists behind one another.
std::vector<BoundOption> joined(std::initializer_list<std::vector<BoundOption>> lists);

/// Those that a verb has of its own, out of a table's.
std::vector<BoundOption> own(const std::vector<BoundOption>& options);

/// A problem that is read.
OptionSpec problem_in();
/// --log of a solve.
OptionSpec log_of_steps();
/// --ply of two states of a problem.
OptionSpec ply_of_two_states();
/// --format of a problem that is written, and what it takes.
OptionSpec problem_format();
std::vector<OptionChoice> problem_formats();
/// What a problem that is written becomes, for --help.
inline constexpr const char* kProblemOut =
    "NAME.ply is a point cloud with cameras, NAME.out Bundler, NAME.nvm NVM, NAME.problem libmv, a "
    "folder (NAME/, or NAME for what came from one) a COLMAP model, anything else BAL; .gz and "
    ".bz2 are compressed";

}  // namespace sheaf
