// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/solver.h"

#include <algorithm>
#include <new>
#include <optional>
#include <string>

#include "solve/one_solve.h"
#include "systems/build.h"

namespace sheaf {

struct Solver::State {
  SolveOptions options;  ///< as they were given
  SolveOptions of_run;   ///< and what a run changes of them
  const Kernels* kernels = nullptr;
  std::optional<Threads> threads;  ///< there once the options were found right, with `kernels`
  int asked_threads = 0;
  KeptHome kept;
  Summary summary;

  void set(const SolveOptions& given) {
    kept.forget();
    kernels = nullptr;
    if (asked_threads != given.threads) threads.reset();
    asked_threads = given.threads;
    options = given;
    options.lend_observations = false;
    of_run = options;
  }
  /// Copying all of the options would allocate what their lists and functions take.
  void reset_run() {
    of_run.recoveries = options.recoveries;
    of_run.solver = options.solver;
    of_run.initial_damping = options.initial_damping;
  }
  /// What most solves say has its memory beforehand, so that one which takes a step more than all
  /// before it allocates nothing.
  void make_room() {
    constexpr std::size_t kMostSteps = 1000, kRounds = 32, kWords = 128;
    const auto steps = static_cast<std::size_t>(std::max(0, options.max_iterations));
    summary.iterations.reserve(std::min(kMostSteps, steps) + 2);
    summary.rounds.reserve(kRounds);
    for (std::string* words : {&summary.words, &summary.points_reason, &summary.solver_reason})
      words->reserve(kWords);
  }
  Result<void> begin() {
    if (kernels != nullptr) return {};
    if (Result<void> valid = check_options(options); !valid.ok()) return valid;
    Result<const Kernels*> chosen = choose_kernels(options.simd);
    if (!chosen.ok()) return chosen.error();
    if (!threads) threads.emplace(options.threads);
    kernels = chosen.value();
    make_room();
    return {};
  }
};

namespace {

/// Nothing is in it, and its vectors and strings keep their memory.
void clear(Summary& summary) {
  static const Summary empty;
  summary = empty;
}

}  // namespace

Solver::Solver(const SolveOptions& options) : state_(std::make_unique<State>()) {
  state_->set(options);
}
Solver::~Solver() = default;
Solver::Solver(Solver&&) noexcept = default;
Solver& Solver::operator=(Solver&&) noexcept = default;

void Solver::set_options(const SolveOptions& options) { state_->set(options); }
const SolveOptions& Solver::options() const { return state_->options; }

Result<const Summary*> Solver::try_solve(Problem& problem) {
  const Stopwatch clock;
  State& s = *state_;
  s.kept.used = false;
  Result<void> done = check_problem(problem, s.options);
  try {
    if (done.ok()) done = s.begin();
    if (done.ok()) {
      clear(s.summary);
      s.reset_run();
      done = solve_once(problem, s.of_run, *s.kernels, *s.threads, clock, &s.kept, s.summary);
    }
  } catch (const std::bad_alloc&) {
    done = Error(ErrorCode::memory_limit, "the machine has no memory left for this problem");
  }
  if (done.ok()) return &s.summary;
  s.kept.forget();
  return done.error();
}

const Summary& Solver::solve(Problem& problem) { return *try_solve(problem).value(); }

bool Solver::was_kept() const { return state_->kept.used; }
void Solver::forget() { state_->kept.forget(); }

}  // namespace sheaf
