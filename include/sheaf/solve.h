// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/loss.h"
#include "sheaf/options.h"
#include "sheaf/photometric.h"
#include "sheaf/problem.h"

namespace sheaf {

/// One trust region step. Index 0 is the start: no trial, accepted.
struct Iteration {
  int index = 0;
  int round = 0;          ///< of the loss's scale: index into Summary::rounds
  double start_cost = 0;  ///< of the state held before the step, with the scale of its round
  double cost = 0;        ///< of the state held after the step
  double trial_cost = 0;  ///< of the state tried; may be infinite or NaN
  bool accepted = true;
  double damping = 0;       ///< lambda the step was computed with
  double radius = 0;        ///< px: of the step in the metric of diag(J^T J); infinite: none (lm)
  bool reused = false;      ///< dogleg after a rejection: nothing was linearised or factored anew
  double gain_ratio = 0;    ///< actual / predicted decrease
  double gradient_max = 0;  ///< px; largest |J_i^T r| / |J_i| over the free columns, at the state
                            ///< the step starts from, points eliminated
  double step_norm = 0;     ///< largest relative change of any one block
  double scale_px = 0;      ///< of the loss in this step; 0: no loss
  /// Least part of its weight that the step gave the loss's curvature along a residual
  /// (docs/math.md, section 12); 1: the weight alone.
  double loss_floor = 1;
  int linear_iterations = 0;
  /// 0: a step. Else it is no step: the state was replaced by one that so many passes of resection
  /// and intersection found (Summary::recoveries).
  int passes = 0;
  double time_s = 0;  ///< since set-up ended
};

enum class Termination {
  cost_converged,      ///< relative decrease below the tolerance twice
  gradient_converged,  ///< scaled gradient below its tolerance
  step_converged,      ///< no block moves by more than rounding
  max_iterations,
  time_limit,
  stopped,         ///< by the callback or the stop token
  no_usable_step,  ///< no step could be computed or accepted from the start
  nothing_free,    ///< nothing was free to move
  zero_weights,    ///< under the loss every observation has the weight 0
  drowned,  ///< one observation's cost is so large that its rounding hides what others could gain
};

/// "cost_converged", ... : stable, for JSON.
const char* to_string(Termination termination);

/// Steps that were made with one scale of the loss. Within a round costs only fall; between two
/// they mean different things.
struct LossRound {
  double scale_px = 0;      ///< 0 without a loss
  double sigma_px = 0;      ///< that an automatic scale was set for; 0: the scale was given
  double initial_cost = 0;  ///< with this scale, of the state that the round starts from
  double final_cost = 0;
  int steps = 0;  ///< tried, rejected ones included
};

/// An attempt to get out of where early steps went wrong: images were resected and points
/// intersected in turn. Each pass over all images or all points counts as an iteration.
struct Recovery {
  int after_step = 0;  ///< index of the step that was rejected
  int passes = 0;      ///< that were made
  bool taken = false;  ///< whether the state found was so much better that it was gone on from
  bool from_start =
      false;  ///< whether the best passes set out from the start, not the state reached
  double cost_before = 0;  ///< of the state reached, by the scale of the round
  double cost_after = 0;   ///< of the best one found
};

/// The camera solver was chosen anew, by the conjugate gradients that steps really took.
struct SolverChange {
  int after_step = 0;
  double iterations = 0;  ///< of conjugate gradients, the mean of the last steps
  std::string from, to;   ///< as Summary::solver
};

/// A Summary says what happened. Costs are 1/2 sum rho(|r|^2) in px^2; without a loss rho(s) = s.
struct Summary {
  double initial_cost = 0;        ///< with the first round's scale
  double final_cost = 0;          ///< with the last round's
  double initial_plain_cost = 0;  ///< 1/2 sum |r|^2, whatever the loss
  double final_plain_cost = 0;
  double initial_rms_px = 0;  ///< per observation, of the plain residuals; sigmas take no part
  double final_rms_px = 0;
  /// These parts of the costs are the terms'; the rest is the observations'.
  TermCosts initial_terms, final_terms;
  std::vector<BoundReached> at_bounds;  ///< of Terms::bounds, at the end
  Termination termination = Termination::no_usable_step;
  std::string words;  ///< the reason for stopping, as a sentence
  std::vector<Iteration> iterations;
  std::vector<Recovery> recoveries;
  LossKind loss = LossKind::none;
  std::vector<LossRound> rounds;  ///< without a loss one
  double final_sigma_px = 0;      ///< estimated at the end, for an automatic scale

  std::string solver;         ///< "dense", ...; the last one
  std::string solver_reason;  ///< one line: why this one
  std::vector<SolverChange> solver_changes;
  std::string points = "xyz";        ///< the coordinates in which points stepped
  std::string points_reason;         ///< one line: why these
  std::string precision = "double";  ///< or "mixed": float inside the linear solver
  std::string simd;                  ///< instruction set used
  int threads = 1;
  std::uint64_t forecast_bytes = 0;  ///< predicted peak resident size of the process

  double setup_s = 0;  ///< sorting, indexing, allocating
  double solve_s = 0;  ///< after set-up

  int resumed_after = -1;  ///< the step after which a checkpoint was gone on from; -1: none was
  int checkpoints = 0;     ///< written by this process
  std::string checkpoint_failure;  ///< why one could not be; empty: none failed

  std::vector<std::uint64_t> behind_camera_before;  ///< observation indices
  std::vector<std::uint64_t> behind_camera_after;
  std::vector<std::uint64_t> rejected_observations;  ///< left out (Cheirality::hold_out)

  bool usable() const {
    return termination != Termination::no_usable_step && termination != Termination::zero_weights;
  }
};

/// The record of a photometric refinement. Costs are 1/2 sum rho in grey levels squared, and where
/// Summary says px its numbers are grey levels here.
struct PhotometricSummary {
  Summary solve;
  std::uint64_t patches_total = 0;    ///< a point in an image that is not its host
  std::uint64_t patches_visible = 0;  ///< of them, those that counted at the start
  std::uint64_t patches_left = 0;     ///< of those, the ones that are outside at the end
  /// They are of the residuals of patches visible at the start, read bilinearly, brightness as it
  /// was and as it became. A patch that left counts as it did, and no less than the mean did.
  double initial_rms_grey = 0, final_rms_grey = 0;
  double initial_median_grey = 0, final_median_grey = 0;    ///< of |r|
  double initial_inlier_share = 0, final_inlier_share = 0;  ///< |r| of at most 10 grey levels
  std::uint64_t measurements = 0;  ///< measured positions that the refinement was anchored to
  double initial_rms_px = 0, final_rms_px = 0;  ///< of their distances
  double anchor_sigma_grey = 0;  ///< of a pixel, as they were weighed against it in the last round
};

/// Refines the problem in place. The best state found is stored even when the run was stopped.
/// Throws Error (ErrorCode::usage) for a problem that `validate` refuses or options that
/// contradict it; `try_solve` returns it instead.
Summary solve(Problem& problem, const SolveOptions& options = {});
Result<Summary> try_solve(Problem& problem, const SolveOptions& options = {});

/// Refines poses, points and brightness from the pixels, in place. Errors: ErrorCode::usage for a
/// problem that `validate` refuses or options that contradict it.
Result<PhotometricSummary> refine_photometric(PhotometricProblem& problem,
                                              const PhotometricOptions& options = {});

/// Looks at a state as a round of `refine_photometric` with these options would: which patches
/// count, how well they fit, and how far the noise of the images leaves each point undetermined
/// (docs/photometric.md has the formulas). Errors: as above.
Result<PhotometricDetails> examine_photometric(const PhotometricProblem& problem,
                                               const PhotometricOptions& options = {});

}  // namespace sheaf
