// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <limits>
#include <string>

#include "sheaf/camera_solver_kind.h"
#include "sheaf/loss.h"
#include "sheaf/problem.h"
#include "sheaf/stop.h"

namespace sheaf {

struct Iteration;
struct Summary;

/// What to do with observations whose point lies behind their camera.
enum class Cheirality {
  formula,   ///< the model's formula wherever it is finite, counted and listed
  reject,    ///< as formula, but a step that newly puts an observation behind is rejected
  hold_out,  ///< those behind at the start are left out (and listed); then as reject
};

/// In which coordinates a point steps. It is stored as X, Y, Z in any case.
enum class PointParametrisation {
  automatic,      ///< inverse depth where many points are seen under small angles, else X, Y, Z
  xyz,            ///< X, Y, Z
  homogeneous,    ///< a unit 4-vector about the middle of the cameras: passes through infinity
  inverse_depth,  ///< bearing and inverse depth from the first image that sees it: likewise
};

/// Instruction set of the hot kernels. An x86-64 processor has those up to some point of the list
/// before neon; a 64-bit ARM one has neon alone.
enum class Simd { best, scalar, sse4, avx2, avx512, neon };

/// What bounds a step that the cost did not follow.
enum class TrustRegion {
  lm,  ///< more damping: a new linearisation and factorisation
  /// A smaller radius: the same factorisation, a shorter step on Powell's path. Points by xyz only.
  dogleg,
};

/// In what the camera system is solved. State, residuals, gradient and costs are always double.
enum class Precision {
  automatic,  ///< whichever is quicker, where mixed ends where double ends
  full,       ///< double throughout
  mixed,      ///< float inside the linear solver, where it has such a variant
};

struct SolveOptions {
  int max_iterations = 50;  ///< trust region steps tried, rejected ones included
  double tolerance = 1e-8;  ///< stop when the relative cost decrease stays below this twice
  double gradient_tolerance = 1e-10;  ///< stop when the scaled gradient is at most this x |r|
  double time_limit_s = std::numeric_limits<double>::infinity();  ///< set-up included
  Loss loss{};                                                    ///< none, or as in `Huber{1.0}`
  int threads = 0;  ///< 0: all; the result does not depend on it
  Cheirality cheirality = Cheirality::formula;
  PointParametrisation points = PointParametrisation::automatic;
  Fixed fixed{};
  CameraSolverKind solver = CameraSolverKind::automatic;
  Precision precision = Precision::automatic;
  std::uint64_t memory_limit_bytes = 0;  ///< 0: none; else refuse what is forecast to exceed it
  /// The solver may free the problem's observations while it runs and put them back at the end, in
  /// memory that it no longer needs: a third off the peak of the largest problems. Nobody else may
  /// look at the problem meanwhile; should memory run out, it is left without observations.
  bool lend_observations = false;
  TrustRegion trust_region = TrustRegion::lm;  ///< what follows a rejected step
  double initial_damping = 0;                  ///< lambda of the first step; 0: the default rule
  /// At most so many Gauss-Newton steps of each point by itself in every step, once the cameras
  /// have stepped (Ceres calls them inner iterations); 0: none, the plain Levenberg-Marquardt step.
  /// Under a loss: a Levenberg-Marquardt of each point, three tries for one of these.
  int inner_iterations = 3;
  /// How often at most an early step that went wrong is answered by resecting every image and
  /// intersecting every point by itself (docs/solver.md); 0: never.
  int recoveries = 3;
  Simd simd = Simd::best;  ///< for tests and measurements
  /// File that the run is written down in now and then, between two steps, so that another process
  /// can go on; empty: none. A checkpoint that cannot be written ends no solve
  /// (Summary::checkpoint_failure).
  std::string checkpoint{};
  double checkpoint_every_s = 60;
  /// A checkpoint to go on from: the end is that of the run that was never stopped, bit for bit.
  /// Problem, options and instruction set must be those of that run, but for threads and the time
  /// limit, which counts from here on.
  std::string resume{};

  /// Called once the solver is chosen and before it allocates: solver, reason and forecast are set.
  /// Called again should another one go on (Summary::solver_changes).
  std::function<void(const Summary&)> on_plan{};
  /// Called after the start was evaluated (index 0) and after every step; return false to stop.
  std::function<bool(const Iteration&)> on_iteration{};
  StopToken stop{};  ///< asks the solver to end within one evaluation
};

}  // namespace sheaf
