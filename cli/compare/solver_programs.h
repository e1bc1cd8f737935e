// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sheaf/problem.h"

namespace sheaf {

/// A solver that `compare` can run.
struct SolverProgram {
  std::string name;               ///< "sheaf", or what follows "peer-"
  std::string config;             ///< words, as bench/README.md lists them; sheaf's are its own
  std::filesystem::path program;  ///< this command itself for sheaf
};

struct MissingSolver {
  std::string name;
  std::string how;  ///< to install it
};

struct SolverList {
  std::vector<SolverProgram> found;
  std::vector<MissingSolver> missing;
};

/// The solvers of a comma-separated list of NAME[:CONFIG], or, where it is empty, sheaf and all
/// peers that are found. A NAME without a program of that name stands for all whose names begin so
/// ("ceres": "ceres-2.1"). Peers (programs peer-NAME) are looked for in `folders`
/// (colon-separated), then in ../libexec/sheaf and bench/peers beside this command. Throws Error
/// (ErrorCode::usage) for an entry without a name. `fixed`: what is held, for the configuration
/// that a peer takes where none is stated.
SolverList find_solvers(const std::string& list, const std::string& folders, const Problem& problem,
                        const Fixed& fixed);

/// This command's own file.
std::filesystem::path own_program();

/// The options of `sheaf solve` that a config's words stand for: NAME of a camera solver, or
/// OPTION=VALUE, joined by '+'. Throws Error (ErrorCode::usage) for an empty word.
std::vector<std::string> solve_words(const std::string& config);

}  // namespace sheaf
