// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>

#include "eliminate/kernels.h"
#include "lists/batches.h"
#include "lists/chunks.h"
#include "lists/columns.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "reduced/camera_solver.h"
#include "reduced/coarse_space.h"
#include "systems/camera_state.h"
#include "systems/costs.h"
#include "systems/implicit_solver.h"
#include "systems/system.h"

namespace sheaf {

/// A state of cameras and points.
struct PointState {
  CameraState cameras;
  Buffer<double> points;  ///< kPointGroup per group of the arrangement
};

/// The state that steps start from and the one that they lead to. Buffers and vectors change places
/// when a step is accepted; the objects stay where they are, so that rows may point at them.
struct SteppedState {
  PointState held, tried;
  Buffer<double> factors;  ///< kFactorGroup per group, of the last elimination
  Buffer<double> metric;   ///< of the held state, kMetricBatch per batch; empty without a loss
  /// Of each point, 8 per group: what it damps itself by beside the common damping; empty without a
  /// loss. It outlives accepted and rejected steps.
  Buffer<double> own_damping;
  Buffer<double> point_costs;  ///< of the held state under a loss, 8 per group
};

/// How points are eliminated.
struct Elimination {
  double damping = 0;
  bool points_held = false;
  ScaledLoss loss{};
  ChartRules chart{};
  const double* own_damping = nullptr;  ///< of the points (SteppedState)
};

/// How points follow a step of the cameras.
struct PointTrial {
  bool watch_behind = false;
  int inner_iterations = 0;
  double mean_square = 0;  ///< of the held state by observation
  ScaledLoss loss{};
  ChartRules chart{};
  PointBlend blend{};
  OwnIterations own{};
};

/// What rows may do about points that a step has made worse.
struct Settling {
  double* tried;             ///< points of the tried state
  double* own_damping;       ///< as SteppedState has it; nullptr: points have none
  double left_decrease = 0;  ///< as TrialOutput
};

class DoglegSource;

/// The rows of one kind, such as reprojections through BAL lenses, through lenses of any model, or
/// patches of pixels: everything that PointSystem does not know of its observations. Rows hold
/// records of the cameras, in the layout of their kernels; the state itself is the home's.
class PointRows {
 public:
  virtual ~PointRows() = default;

  // The arrangement.
  virtual const Batches& batches() const = 0;
  virtual const Chunks& chunks() const = 0;    ///< with the tiles of the rows' own blocks
  virtual std::size_t num_blocks() const = 0;  ///< diagonal blocks
  /// What finish() adds behind the sums of the rows: diagonal blocks and tiles.
  virtual std::size_t more_blocks() const { return 0; }
  virtual std::size_t more_tiles() const { return 0; }
  /// With the tiles that the camera solver sees.
  virtual const Chunks& reduced_chunks() const { return chunks(); }
  /// Doubles of scratch that a thread needs to eliminate a chunk.
  virtual std::size_t scratch() const = 0;
  /// Whether elimination leaves the loss's metric for later passes.
  virtual bool keeps_metric() const { return true; }

  /// Takes the state, which must outlive the rows, and writes the records of the held one.
  virtual void attach(const SteppedState& state) = 0;
  /// Records of the held cameras, kCameraRecord per image, of which the first are R, t and, where
  /// an image has a focal length of its own, f.
  virtual const double* held_cameras() const = 0;
  /// What the coarse space is placed by, and the map of the rows' blocks to the solved ones, where
  /// these differ.
  virtual CoarseSpace::State coarse_state() { return {held_cameras()}; }
  virtual const BlockMap* map() const { return nullptr; }

  /// Before an elimination of the held state.
  virtual void begin(const StepRequest&) {}
  /// Linearises a chunk at the held state, eliminates its points and adds what is left to the sums
  /// of a slice; returns the records in `scratch`.
  virtual Records eliminate(const Elimination& in, std::uint32_t chunk, double* scratch,
                            double* tiles, double* diagonal, EliminateOutput& out) = 0;
  /// Of the held state; summed: what elimination came to.
  virtual Costs held_costs(const Costs& summed) const { return summed; }
  /// What the camera solver sees, from the sums of all slices; there is room for more behind them.
  virtual ReducedSums finish(double* tiles, double* diagonal) {
    return {&chunks(), tiles, diagonal};
  }

  /// Writes the records of the tried cameras, and into those of the held ones the step that the
  /// points follow.
  virtual void step(const Buffer<double>& columns) = 0;
  /// Back-substitutes the points of a chunk and adds the cost there.
  virtual void trial(const PointTrial& in, std::uint32_t chunk, TrialOutput& out) = 0;
  /// Once all chunks were tried; may replace the costs and add to `out`.
  virtual Costs tried_costs(const PointTrial&, const Costs& summed, Settling&, Trial&) {
    return summed;
  }
  /// The tried state became the held one.
  virtual void accepted() = 0;

  /// The root of the mean |r|^2 of the observations at the held state, px, whatever their sigmas;
  /// negative: not known.
  virtual double pixel_rms() const { return -1; }
  /// The quantile that System::residual_scale asks for.
  virtual double residual_scale(double quantile) const = 0;
  /// Observations behind their camera at the held state, or as many as there may be.
  virtual std::uint64_t count_behind() const { return batches().observations; }

  /// Products computed again from the held state, for conjugate gradients; rounded: in single
  /// precision, where it is mixed and to be had. columns: of the rows' own blocks.
  struct Operators {
    std::unique_ptr<StateOperator> exact, rounded;
  };
  virtual Operators make_operators(const Columns& columns, bool mixed) = 0;
  /// What a dogleg asks of the rows; null: not to be had.
  virtual std::unique_ptr<DoglegSource> make_dogleg();

  virtual std::uint64_t bytes() const = 0;  ///< held beside arrangement and state
};

}  // namespace sheaf
