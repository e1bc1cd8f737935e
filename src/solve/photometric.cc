// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <new>

#include "linear/kernel_table.h"
#include "linear/photometric_system.h"
#include "platform/clock.h"
#include "sheaf/solve.h"
#include "solve/patch_statistics.h"
#include "solve/trust_region.h"

namespace sheaf {
namespace {

Taps taps_of(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::bilinear:
      return Taps::bilinear_central;
    case Interpolation::bilinear_exact:
      return Taps::bilinear;
    case Interpolation::bicubic:
      break;
  }
  return Taps::catmull_rom;
}

PatchScene scene_of(const PhotometricProblem& problem, const PhotometricOptions& options) {
  PatchScene scene;
  scene.camera = problem.camera;
  for (const GreyImage& image : problem.images)
    scene.planes.emplace_back(image.width, image.height, image.pixels.data());
  scene.grid = make_grid(problem.patch);
  scene.taps = taps_of(options.interpolation);
  const std::size_t cells = scene.grid.cells(), pixels = problem.patch.size();
  scene.references.assign(cells * problem.num_points(), 0);
  for (std::size_t i = 0; i < problem.num_points(); ++i)
    for (std::size_t k = 0; k < pixels; ++k)
      scene.references[cells * i + scene.grid.place[k]] = problem.patches[pixels * i + k];
  return scene;
}

PatchState state_of(const PhotometricProblem& problem) {
  PatchState state{problem.poses, problem.brightness, problem.points};
  state.brightness.resize(problem.poses.size());
  return state;
}

std::vector<Sight> all_sights(const PhotometricProblem& problem) {
  std::vector<Sight> sights;
  for (std::uint32_t i = 0; i < problem.num_points(); ++i)
    for (std::uint32_t j = 0; j < problem.images.size(); ++j)
      if (!problem.has_hosts() || problem.host[i] != j) sights.push_back({i, j});
  return sights;
}

/// The usual constants keep 95% of the least-squares efficiency on one component.
double pixel_tuning_constant(LossKind kind) {
  switch (kind) {
    case LossKind::none:
      break;
    case LossKind::huber:
      return 1.345;
    case LossKind::soft_l1:
      return 1.174;
    case LossKind::cauchy:
      return 2.385;
    case LossKind::tukey:
      return 4.685;
    case LossKind::geman_mcclure:
      return 3.648;
  }
  return 1;
}

class Refinement {
 public:
  Refinement(PhotometricProblem& problem, const PhotometricOptions& options)
      : problem_(problem),
        options_(options),
        threads_(options.threads),
        kernels_(*available_kernels().front()),
        scene_(scene_of(problem, options)),
        state_(state_of(problem)) {}

  PhotometricSummary run() {
    Summary& solve = summary_.solve;
    solve.simd = kernels_.name;
    solve.threads = threads_.count();
    solve.loss = options_.loss.kind;
    select_sights();
    PatchStatistics statistics(scene_, seen_);
    statistics.measure_before(state_);
    const ScaledLoss loss = fit_brightness();
    descend(loss);
    solve.solve_s = clock_.seconds() - solve.setup_s;
    statistics.measure_after(state_);
    summary_.initial_rms_grey = statistics.before().rms;
    summary_.initial_median_grey = statistics.before().median;
    summary_.final_rms_grey = statistics.after().rms;
    summary_.final_median_grey = statistics.after().median;
    problem_.poses = state_.poses;
    problem_.points = state_.points;
    problem_.brightness = state_.brightness;
    return summary_;
  }

 private:
  PhotometricRules rules() const {
    return {options_.fix_poses,
            options_.fix_points,
            options_.affine_brightness,
            options_.prior_a,
            options_.prior_b,
            options_.loss_per_patch,
            options_.leaving == Leaving::free};
  }

  SolveOptions loop_options() const {
    SolveOptions out;
    out.max_iterations = options_.max_iterations;
    out.tolerance = options_.tolerance;
    out.initial_damping = options_.initial_damping > 0 ? options_.initial_damping
                                                       : default_damping(problem_.poses.size());
    out.time_limit_s = options_.time_limit_s;
    out.on_iteration = options_.on_iteration;
    out.stop = options_.stop;
    return out;
  }

  void select_sights() {
    const std::vector<Sight> all = all_sights(problem_);
    summary_.patches_total = all.size();
    std::copy_if(all.begin(), all.end(), std::back_inserter(seen_),
                 [&](const Sight& sight) { return is_seen(scene_, state_, sight); });
    summary_.patches_visible = seen_.size();
    sights_ = options_.leaving == Leaving::free ? all : seen_;
  }

  /// Brightness alone, poses and points held, then the loss's scale from what is left.
  ScaledLoss fit_brightness() {
    const bool automatic =
        options_.loss.kind != LossKind::none && options_.loss.scale_px == kAutomaticScale;
    ScaledLoss loss{options_.loss.kind, options_.loss.scale_px};
    if (options_.affine_brightness && automatic) {
      PhotometricRules held = rules();
      held.poses_held = held.points_held = true;
      PhotometricSystem system(scene_, state_, seen_, held, kernels_, threads_);
      SolveOptions steps;
      steps.max_iterations = 10;
      steps.tolerance = 1e-4;
      Summary ignored;
      minimize(system, {LossKind::huber, 10}, steps, clock_, ignored);
      state_ = system.state();
    }
    if (automatic) {
      PhotometricSystem system(scene_, state_, seen_, rules(), kernels_, threads_);
      const double sigma = std::max(kLeastSigma, kSigmaPerMedian * system.residual_scale(0.5));
      const double pixels =
          options_.loss_per_patch ? std::sqrt(static_cast<double>(problem_.patch.size())) : 1;
      loss.scale_px = pixel_tuning_constant(loss.kind) * sigma * pixels;
      sigma_ = sigma;
    }
    return loss;
  }

  void descend(const ScaledLoss& loss) {
    Summary& solve = summary_.solve;
    PhotometricSystem system(scene_, state_, sights_, rules(), kernels_, threads_);
    solve.setup_s = clock_.seconds();
    solve.solver = system.solver_name();
    LossRound round;
    round.scale_px = loss.kind == LossKind::none ? 0 : loss.scale_px;
    round.sigma_px = sigma_;
    solve.rounds.push_back(round);
    minimize(system, loss, loop_options(), clock_, solve, options_.motion_px);
    solve.rounds.back().initial_cost = solve.initial_cost;
    solve.rounds.back().final_cost = solve.final_cost;
    solve.rounds.back().steps = static_cast<int>(solve.iterations.size()) - 1;
    state_ = system.state();
  }

  static constexpr double kSigmaPerMedian = 1.4826022185056018;
  static constexpr double kLeastSigma = 1;  ///< grey levels: no camera is better

  const Stopwatch clock_;
  PhotometricProblem& problem_;
  const PhotometricOptions& options_;
  Threads threads_;
  const Kernels& kernels_;
  PatchScene scene_;
  PatchState state_;
  std::vector<Sight> sights_, seen_;
  double sigma_ = 0;
  PhotometricSummary summary_;
};

}  // namespace

Result<PhotometricSummary> refine_photometric(PhotometricProblem& problem,
                                              const PhotometricOptions& options) {
  if (Result<void> valid = validate(problem); !valid.ok()) return valid.error();
  try {
    return Refinement(problem, options).run();
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, "the machine has no memory left for these images");
  }
}

}  // namespace sheaf
