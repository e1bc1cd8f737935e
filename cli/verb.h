// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace sheaf {

/// What every verb takes.
struct CommonOptions {
  std::string json;    ///< file for the result as JSON, or empty
  int threads = 0;     ///< 0: all
  bool quiet = false;  ///< nothing on stderr but errors
};
void add_common_options(CLI::App& verb, CommonOptions& options);

/// What a problem may be, for --help.
inline constexpr const char* kProblemIn =
    "problem: a BAL, Bundler, NVM or libmv file, plain or .gz or .bz2, or the folder of a COLMAP "
    "model (told by content)";
inline constexpr const char* kProblemOut =
    "NAME.ply is a point cloud with cameras, NAME.out Bundler, NAME.nvm NVM, NAME.problem libmv, a "
    "folder (NAME/, or NAME for what came from one) a COLMAP model, anything else BAL; .gz and "
    ".bz2 are compressed";

/// Each adds its verb. A verb that ran leaves its exit code; errors are thrown as sheaf::Error.
void add_solve(CLI::App& app, int& exit_code);
void add_info(CLI::App& app, int& exit_code);
void add_check(CLI::App& app, int& exit_code);
void add_convert(CLI::App& app, int& exit_code);
void add_perturb(CLI::App& app, int& exit_code);
void add_evaluate(CLI::App& app, int& exit_code);
void add_compare(CLI::App& app, int& exit_code);
void add_photometric(CLI::App& app, int& exit_code);
void add_generate(CLI::App& app, int& exit_code);
void add_demo(CLI::App& app, int& exit_code);

/// A validator that names what is accepted: "expected WHAT, not 'TEXT'".
CLI::Validator whole_number_from(long long lowest, const std::string& what);
CLI::Validator number_in(double lowest, double highest, bool lowest_too, const std::string& what);
CLI::Validator one_of(const std::vector<std::string>& names);
/// What `parse(text, value)` takes into a Value; it returns what is wrong, or nothing.
template <class Value, class Parse>
CLI::Validator parsed_by(Parse parse) {
  return CLI::Validator(
      [parse](std::string& text) {
        Value ignored;
        return std::string(parse(text, ignored));
      },
      "");
}

}  // namespace sheaf
