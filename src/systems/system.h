// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <limits>

#include "geometry/loss.h"

namespace sheaf {

struct StepRequest {
  double damping = 0;    ///< lambda: J^T J + lambda diag(J^T J)
  double forcing = 0.1;  ///< how exactly an iterative solver solves (CameraSystem::forcing)
  ScaledLoss loss{};     ///< of the held state's cost, of the step and of its trial
  /// Relative decrease of the cost by the last step: points settle as exactly as this is worth.
  double last_decrease = 1;
  /// The trial is this many times the step; its predicted decrease is that of the step itself. Not
  /// with a dogleg. A system may not know how and try the step.
  double stretch = 1;
  const std::function<bool()>* cancelled = nullptr;  ///< asked now and then during long solves
  bool precise = false;  ///< solve in double, even where float would do for the way there
  /// Keep what a smaller radius at the same state needs, and the trial within the radius.
  bool dogleg = false;
  /// Of the step in the metric C = clamp(diag(J^T J)): |s|_C = sqrt(s^T C s), px.
  double radius = std::numeric_limits<double>::infinity();
};

/// A damped Gauss-Newton step was computed (or not), points eliminated, from the held state.
struct Step {
  bool solved =
      false;        ///< false: the camera system was not positive definite, not finite or cancelled
  double cost = 0;  ///< 1/2 sum rho(|r|^2) at the held state, px^2
  double plain_cost = 0;    ///< 1/2 sum |r|^2 there
  double gradient_max = 0;  ///< px: largest |J_i^T r| / |J_i| over the free columns
  int linear_iterations = 0;
  bool reused = false;  ///< nothing was linearised or factored: only the radius is new
};

/// The state that the step leads to.
struct Trial {
  double cost = 0;                ///< 1/2 sum rho(|r|^2) there; not finite where the formula is not
  double plain_cost = 0;          ///< 1/2 sum |r|^2 there
  double predicted_decrease = 0;  ///< of the cost, by the linear model
  double step_norm = 0;           ///< largest relative change of any one block
  std::uint64_t newly_behind = 0;  ///< observations that went behind their camera (if watched)
  double motion_px = 0;            ///< median move in the images, where there are images
  // Of a dogleg:
  double length = 0;   ///< |s|_C of the step that was tried
  double damping = 0;  ///< for which the step is, or comes nearest to being, the damped one
};

/// The one seam between the trust region and everything below it. Only scalars cross: state and
/// vectors live behind it, wherever that is. The loop above calls
///   propose(request) -> trial() -> accept() or propose(with more damping, less radius) -> ...
class System {
 public:
  virtual ~System() = default;

  /// Linearises at the held state, eliminates the points under (J^T J + damping diag(J^T J)) and
  /// solves for the cameras. Asked again without accept(), the state is the same and only the
  /// damping differs. Asked again for a dogleg of which the radius alone is new, it does none of
  /// this: what is known of the model serves any radius.
  virtual Step propose(const StepRequest& request) = 0;

  /// Back-substitutes the points and evaluates the cost at the stepped state, in one pass.
  virtual Trial trial() = 0;

  /// The stepped state becomes the held one.
  virtual void accept() = 0;

  /// The given quantile of |r_x| and |r_y| together over all observations at the held state, px:
  /// the smallest of these values that no less than this fraction of them reaches down to.
  virtual double residual_scale(double quantile) = 0;
};

}  // namespace sheaf
