// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "platform/clock.h"
#include "sheaf/options.h"
#include "sheaf/solve.h"
#include "solve/step_control.h"
#include "systems/system.h"

namespace sheaf {

/// The damping to start with. Measured: from 1e-5 to 5e-5, dubrovnik-16 and trafalgar-21 need 4 or
/// 5 steps to 1e-6 of their optimum and ladybug-49 4 to 6 to 1e-3; from 3e-6 and 7e-6 ladybug-49
/// ends 6% higher. Long scenes bend more: generated streets of 138 images end 3% lower from 1e-3
/// and 1e-2 than from 4e-4, of 1723 images 1% lower from 1e-2 than from 1e-3; photo collections of
/// some hundred images pay a step for it.
double default_damping(std::size_t images);

/// What the loop itself keeps from step to step, and what the held state costs.
struct LoopHistory {
  StepControl::State control;
  bool costs_known = true;  ///< else the first step evaluates them
  double cost = 0, plain_cost = 0;
  double forcing = 0;
  bool precise = false;
  int small_decreases = 0;
  double last_decrease = 1;  ///< relative, of the cost
  double stretch = 1;        ///< of the next step

  /// The loss has another scale: other costs, and unless it is much alike another curvature.
  void rescale(bool alike) {
    if (!alike) control.floor = {};
    control.raise = false;
    costs_known = false;
    stretch = 1;
    small_decreases = 0;
  }
};

/// Where a run stands beside what LoopHistory says. Those who know keep it up, so that it can be
/// written down before any step; where `resumes` is set they take it up again.
struct RunProgress {
  bool resumes = false;
  // The rounds of a loss.
  bool provisional = false;
  int returns = 0;
  std::uint64_t round_begin = 0;  ///< iterations there were when its steps began
  // The steps of an attempt.
  int rejected_in_a_row = 0;
  bool any_finite_trial = false;
  std::vector<int> last_iterations;
  std::uint64_t attempt_begin = 0;
};

/// What is to be done where an early step went wrong: go on, start again from a better state that
/// was found, or end, since no gain could be seen.
enum class Recourse { none, restart, end };

/// What the loop asks those who built the system.
struct Hooks {
  std::function<Recourse()> recover;
  /// Whether another camera solver is to go on, given how many conjugate gradient iterations the
  /// last steps took.
  std::function<bool(double iterations)> change_solver;
  RunProgress* progress = nullptr;
  /// Before each step but the first of a run; `progress` is up to date.
  std::function<void()> before_step{};
};

/// Levenberg-Marquardt or a dogleg, with gain-ratio control, on any System, with one loss. Adds to
/// the summary's iterations, and sets costs, termination and words; the best state is the system's
/// held one.
/// An infinite tolerance ends it after one accepted step; steps whose median motion is above
/// settled_motion_px never end it.
/// `since_start` runs since set-up began (the time limit counts from there).
/// `history`: what an earlier call left there is gone on from, and this one leaves its own after
/// every step, before on_iteration is called. With Home::history and the state of that moment, the
/// steps are those of a run that was never stopped.
/// `hooks` are asked where an early step went wrong, and after steps of many conjugate gradients;
/// where they want another state or another solver, the loop ends and returns true, with no reason
/// for stopping set. `tolerance`: in place of the options' own.
/// Allocates nothing but what the summary has no room for.
bool minimize(System& system, const ScaledLoss& loss, const SolveOptions& options,
              const Stopwatch& since_start, Summary& summary,
              double settled_motion_px = std::numeric_limits<double>::infinity(),
              std::optional<LoopHistory>* history = nullptr, const Hooks* hooks = nullptr,
              std::optional<double> tolerance = {});

/// What counts as an iteration: steps, rejected ones included, and passes of recoveries.
int steps_of(const Summary& summary);

}  // namespace sheaf
