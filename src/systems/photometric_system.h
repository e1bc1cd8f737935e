// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "systems/pixel_rows.h"
#include "systems/point_system.h"

namespace sheaf {

/// The home of photometric rows: PointSystem on PixelRows, with the state as patches have it.
class PhotometricSystem : public PointSystem {
 public:
  /// Dense up to where its factor costs about as much as the patches' pixels; then by blocks.
  static constexpr std::int32_t kMostDenseColumns = 1200;

  /// The solver asked for, or by this rule.
  static SolverKind kind_of(CameraSolverKind asked, std::int32_t columns);

  /// As PixelRows. Throws std::bad_alloc.
  PhotometricSystem(const PatchScene& scene, const PatchState& state,
                    const std::vector<Sight>& sights, const PhotometricRules& rules,
                    const Kernels& kernels, Threads& threads, Anchor anchor = {});

  /// The held state.
  PatchState state() const;
  /// Patches outside of their image at the held state.
  std::uint64_t left() const { return pixels_.left(); }
  /// What patches cost that leave their image, which the first step of a round finds.
  std::vector<double> leaving() const;
  /// Goes on from the held state, leaving costs and history of another system of the same scene,
  /// sights and rules. False where they are of others.
  bool resume(const std::vector<double>& leaving, const HomeHistory& history);
  const char* solver_name() const { return to_string(kind_); }

 private:
  struct Parts {
    std::unique_ptr<PixelRows> rows;
    PixelRows* pixels;  ///< these rows
    Start start;
    PointRules rules;
    Plan plan;
  };
  static Parts make(const PatchScene& scene, const PatchState& state,
                    const std::vector<Sight>& sights, const PhotometricRules& rules,
                    const Kernels& kernels, Threads& threads, Anchor anchor);
  PhotometricSystem(Parts parts, const PatchState& state, const Kernels& kernels, Threads& threads);

  PixelRows& pixels_;
  const SolverKind kind_;
  const std::vector<double> initial_points_;  ///< of points that no patch sees
};

}  // namespace sheaf
