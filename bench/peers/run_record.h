// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// What every peer program takes and says: its arguments, its clock, its JSON.
#pragma once

#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace peer {

struct Arguments {
  std::string input, output, config;
  std::set<std::string> fix;  ///< what is held, in the words of `sheaf solve --fix`
  int threads = 1;
  int max_iterations = 50;
  double time_limit_s = std::numeric_limits<double>::infinity();
  double cost_target = -1;   ///< stop once the cost is at or below it
  double tolerance = 1e-12;  ///< and after two accepted steps with no more decrease than this part
  bool test = false;         ///< check the derivatives instead of solving
};

/// IN --config NAME --fix LIST --threads N --max-iterations K --time-limit S --tolerance T
/// --out FILE --cost-target C. False with the usage on stderr.
bool parse_arguments(int argc, char** argv, Arguments& arguments);

/// False, with words on stderr, when more is to be held than `able` names.
bool can_hold(const char* peer, const Arguments& arguments, const std::set<std::string>& able);

/// A configuration is words joined by '-', some with a value: "dense_schur-analytic-eta=0.1".
class Config {
 public:
  explicit Config(const std::string& text);
  bool has(const std::string& word);  ///< and marks it as known
  double value(const std::string& word, double otherwise);
  std::string unknown() const;  ///< a word that nobody asked for, or ""

 private:
  std::vector<std::string> words_;
  std::set<std::string> known_;
};

/// The run's clock (0 = start of building the problem) and trace. The time spent in recording
/// itself is taken off, so that a peer does not pay for being watched.
class RunRecord {
 public:
  void start();
  void setup_done() { setup_done_at(now()); }
  void setup_done_at(double time_s) { setup_s_ = time_s; }
  double now() const;
  void pause();
  void resume();
  void add(double cost, bool accepted = true);             ///< cost of the state held now
  void add_at(double time_s, double cost, bool accepted);  ///< by the peer's own clock
  /// A peer's step with the tries that it refused inside: seconds of each. They are steps of their
  /// own in the trace, and the accepted one has what is left of the time.
  void add_with_tries(double cost, const std::vector<double>& refused_s);
  void finish();                                ///< the solver returned
  void counts_in_float() { in_float_ = true; }  ///< costs and states are rounded to float
  /// Accepted steps may go up, and the peer ends with the best state of all: the trace has the best
  /// cost so far, and the last decreases are those of the steps, up or down.
  void ends_with_best() { with_best_ = true; }

  /// Target reached, time spent, or two accepted steps in a row whose relative decrease is at most
  /// the tolerance: the one stopping rule of all solvers. (Costs in float cannot show a decrease of
  /// less than their rounding: they are not asked below 1e-6.)
  bool over(const Arguments& arguments) const;
  std::string json(const std::string& solver, const Arguments& arguments) const;

 private:
  std::vector<std::pair<double, double>> trace_;  // time_s, cost
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  double start_s_ = 0, paused_s_ = 0, pause_begin_s_ = 0, setup_s_ = 0, total_s_ = 0;
  double cpu_start_s_ = 0, cpu_s_ = 0;
  bool in_float_ = false, with_best_ = false;
  double held_ = infinity;                                   // cost of the state held now
  double decrease_ = infinity, decrease_before_ = infinity;  // relative, of the last accepted steps
};

}  // namespace peer
