// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "eliminate/kernels.h"
#include "lists/image_batches.h"
#include "lists/lent_observations.h"
#include "lists/refill.h"
#include "platform/parallel.h"
#include "sheaf/options.h"
#include "systems/arrangement.h"
#include "systems/bal_view.h"
#include "systems/choose_points.h"
#include "systems/choose_solver.h"
#include "systems/home.h"
#include "systems/point_piece.h"
#include "systems/term.h"

namespace sheaf {

/// From a problem and options to a System, in one place: which home, how observations are arranged,
/// which camera solver. The problem is read and not touched until store(), but for its
/// observations where these are lent.
class Build {
 public:
  /// Arranges the problem and chooses the solver; nothing of that is allocated yet. skip: 1 for
  /// each observation to leave out, or empty. lens_blocks: lenses that images share have blocks of
  /// their own, whatever their model. Errors: usage, what cannot be solved so; memory_limit.
  static Result<Build> plan(const Problem& problem, const SolveOptions& options,
                            const std::vector<std::uint8_t>& skip, const Kernels& kernels,
                            Threads& threads, bool lens_blocks = false);

  const Choice& choice() const { return choice_; }
  const PointChoice& points() const { return points_; }
  /// Whether the problem's observations are to be lent while home() lives.
  bool lends() const { return lends_; }
  /// Frees the problem's observations until `lent` goes, which must outlive neither of them.
  void lend(Problem& problem, std::optional<LentObservations>& lent) const;

  /// What a home of these points is made of, for one that brings its own camera stage: what Build
  /// holds is referred to. Not where images are solved by themselves. Throws std::bad_alloc.
  struct Parts {
    std::unique_ptr<PointRows> rows;
    CameraState cameras;
    CameraColumns camera_columns;
    PointRules rules;
    const Columns* columns;  ///< of what is solved for
  };
  Parts make_parts(const Problem& problem, const CameraState* held = nullptr);
  bool images_alone() const { return by_image_.has_value(); }
  /// Where the lenses' own blocks stand; null where each image has its lens in its block.
  const LensTracks* tracks() const { return view_ ? nullptr : &arranged_->tracks; }

  /// The home, which the Build must outlive; its cameras are the problem's, or `held` as another
  /// home had them. Throws std::bad_alloc.
  std::unique_ptr<Home> make_home(const Problem& problem, const CameraState* held = nullptr);
  /// Whether these are cameras of a home of this problem.
  bool fits(const CameraState& held, const Problem& problem) const;
  /// Writes the state of cameras into the problem.
  void store(const CameraState& cameras, Problem& problem) const;
  /// Writes the home's held state into the problem.
  void store(const Home& home, Problem& problem) const;

  /// Whether restart() may be called once stay() was: not where observations are left out or lent,
  /// nor with kept points or images alone, which hold measurements of their own.
  bool can_stay() const { return !skips_ && !lends_ && !by_image_ && kept_.empty(); }
  /// Remembers where the problem's observations stand. Throws std::bad_alloc.
  void stay(const Problem& problem);
  /// Begins again with a problem of the same structure that differs in its state, measurements and
  /// sigmas alone, as a home of a new plan would; allocates nothing. False where the plan would be
  /// another one or the home does not know how: both are then to be made anew.
  bool restart(const Problem& problem, Home& home);

 private:
  Build(const SolveOptions& options, const Kernels& kernels, Threads& threads);
  Result<void> plan_bal(const Problem& problem, const std::vector<std::uint8_t>& skip);
  Result<void> plan_images(const Problem& problem, const std::vector<std::uint8_t>& skip,
                           Columns columns);
  Result<void> plan_points(const Problem& problem, const std::vector<std::uint8_t>& skip,
                           Columns columns);
  Result<void> plan_lenses(const Problem& problem, const std::vector<std::uint8_t>& skip);
  /// Where blocks of rows are not what is solved for: rigs, terms.
  void map_blocks_of(const Problem& problem, const std::vector<std::uint8_t>& skip);
  void cameras(const Problem& problem, CameraState& out) const;
  bool watches_behind() const { return options_.cheirality != Cheirality::formula; }

  SolveOptions options_;  ///< with the points' coordinates chosen
  const PointParametrisation asked_points_;
  PointChoice points_;
  const Kernels* kernels_;
  Threads* threads_;
  std::optional<BalView> view_;           ///< of lenses that BAL's formula describes
  std::optional<ImageBatches> by_image_;  ///< points held and no lens shared
  std::unique_ptr<Arrangement> arranged_;
  Choice choice_;
  bool lends_ = false;
  std::vector<std::uint32_t> kept_;  ///< points that are not eliminated
  std::vector<std::unique_ptr<Term>> terms_;
  bool skips_ = false;  ///< observations are left out

  // Of a home that stays.
  Refill refill_;
  CameraState start_;
  ParallaxScratch parallax_;
  PointChoice new_points_;
};

/// The kernels of an instruction set. Errors: usage, this machine cannot run it.
Result<const Kernels*> choose_kernels(Simd simd);

}  // namespace sheaf
