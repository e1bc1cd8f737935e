// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include "refinement.h"
#include "sheaf/options.h"

namespace sheaf {

/// The options of a solve as the command line states them.
struct SolveArguments {
  int max_iterations = SolveOptions().max_iterations;
  double tolerance = SolveOptions().tolerance;
  double time_limit_s = 0;  ///< 0: none
  std::string loss = "none";
  std::string cheirality = "formula";
  std::string points = "xyz";
  RefinementArguments refinement;
  std::string solver = "auto";
  std::string precision = "auto";
  std::uint64_t memory_limit_bytes = 0;  ///< 0: none
  std::string trust_region = "lm";
  double initial_damping = 0;
  int inner_iterations = SolveOptions().inner_iterations;
  std::string simd = "best";
};

void add_solve_options(CLI::App& verb, SolveArguments& arguments);

/// Everything but threads, callbacks and what is fixed, which needs the problem. The arguments have
/// passed their validators.
SolveOptions solve_options(const SolveArguments& arguments);

/// "" or what is wrong with a --loss, NAME[:SCALE|:auto][:gnc].
std::string parse_loss(const std::string& text, Loss& out);

}  // namespace sheaf
