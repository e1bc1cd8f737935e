// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "eliminate/row_kernels.h"
#include "rows/anchor.h"
#include "rows/photometric.h"
#include "systems/mixed_rows.h"
#include "systems/patch_blocks.h"
#include "systems/point_rows.h"

namespace sheaf {

struct PhotometricRules {
  bool poses_held = false, points_held = false;
  bool brightness = true;              ///< affine, one pair an image
  bool first_brightness_held = false;  ///< where only brightness between images can be told
  double prior_a = 1, prior_b = 100;   ///< standard deviations of the priors a = 1, b = 0
  bool loss_per_patch = false;
  bool leaving_is_free = false;
  bool exact_rows = false;  ///< where patches are warped
  CameraSolverKind solver = CameraSolverKind::automatic;
};

/// Rows of pixels: patches collapse to two rows each, from there on points are eliminated and
/// back-substituted as of reprojections. A camera block is an image's six pose columns, then a and
/// b; with points on rays it is a pair of images, whose sums are folded to the images' at the end.
class PixelRows : public PointRows {
 public:
  /// Fewer than of reprojections, so that records are near: a point that all images see has its own
  /// read for every pair of them.
  static constexpr std::uint64_t kBatchesPerChunk = 32;

  /// The sights are the patches that count, in any order; those that are not in their image when a
  /// loss is first used count as having left. Measured positions have to be those of points in
  /// front of their cameras. Throws std::bad_alloc.
  PixelRows(const PatchScene& scene, const std::vector<Sight>& sights, std::size_t points,
            const PhotometricRules& rules, const Kernels& kernels, Threads& threads, Anchor anchor);

  const Columns& columns() const { return columns_; }
  /// Those of poses, which a coarse space moves.
  const Columns& pose_columns() const { return pose_columns_; }
  /// Whether a block is an image; else a pair of them, whose records a coarse space cannot take.
  bool blocks_are_images() const { return !blocks_.are_pairs(); }
  /// Patches outside of their image at the held state.
  std::uint64_t left() const { return totals_.left; }
  /// What patches that leave cost, in the order of the arrangement; of another refinement that was
  /// arranged likewise: taken in place of what a loss that is first used would find. False where
  /// there are not as many.
  const Buffer<double>& leaving() const { return leaving_; }
  bool take_leaving(const std::vector<double>& costs);

  const Batches& batches() const override { return mixed_ ? mixed_->batches() : batches_; }
  const Chunks& chunks() const override { return chunks_; }
  std::size_t num_blocks() const override { return blocks_.count(); }
  const Chunks& reduced_chunks() const override { return image_chunks_; }
  std::size_t scratch() const override { return scratch_doubles(batches(), chunks_); }
  bool keeps_metric() const override { return false; }
  void attach(const SteppedState& state) override;
  const double* held_cameras() const override { return held_.views.data(); }
  void begin(const StepRequest& request) override { hold(request.loss); }
  Records eliminate(const Elimination& in, std::uint32_t chunk, double* scratch, double* tiles,
                    double* diagonal, EliminateOutput& out) override;
  Costs held_costs(const Costs&) const override { return {totals_.square_sum, totals_.cost}; }
  ReducedSums finish(double* tiles, double* diagonal) override;
  void step(const Buffer<double>& columns) override;
  void trial(const PointTrial& in, std::uint32_t chunk, TrialOutput& out) override;
  Costs tried_costs(const PointTrial& in, const Costs& summed, Settling& points,
                    Trial& out) override;
  void accepted() override;
  double residual_scale(double quantile) const override;
  Operators make_operators(const Columns& columns, bool mixed) override;
  std::uint64_t bytes() const override;

 private:
  class Operator;
  struct Half {  ///< all that belongs to one state: the held one or the one tried
    Buffer<double> views, brightness_sums, seen;
    Buffer<double> costs;           ///< of the patches (PhotometricOutput)
    Buffer<double> measured_costs;  ///< twice, of each point's measured positions; where rows mix
    Buffer<double> factors;         ///< of the patches; or, where some points' rows are others:
    Buffer<double> rows;            ///< as elimination takes them
    Buffer<double> patch_points, patch_rows;  ///< in the patches' arrangement where that differs
  };
  struct Totals {
    double cost = 0, square_sum = 0;
    std::uint64_t left = 0;
  };

  void allocate(Half& half) const;
  Totals collapse(const PointState& state, Half& half);
  Totals collapse_patches(const PointState& state, Half& half);
  PhotometricInput patches_at(const PointState& state, const Half& half) const;
  KeptRows kept(const PhotometricInput& patches) const;
  void gather_rows(const PointState& state, Half& half, Totals& totals) const;
  void hold(const ScaledLoss& loss);
  void set_leaving();
  bool send_back(const Chunk& chunk, double lambda, Settling& points) const;
  void settle(double lambda, Settling& points);
  void add_brightness(const Chunk& chunk, double* diagonal) const;
  /// How the patches are arranged into chunks; batches() is how the rows are.
  const Chunks& patch_chunks() const { return mixed_ ? patch_chunks_ : chunks_; }
  void add_priors(double* diagonal) const;
  double prior_cost(const CameraState& cameras) const;
  PatchState held_state() const;
  double median_motion() const;

  const PatchScene& scene_;
  const PhotometricRules rules_;
  const Kernels& kernels_;
  const RowKernels& row_kernels_;
  void (*const pose_pairs_)(const Chunks&, const Chunk&, const Records&, double* tiles);
  const PhotometricKernels& patch_kernels_;
  Threads& threads_;
  Anchor anchor_;
  PatchBlocks blocks_;
  Batches batches_;                   ///< of the patches; what these call an image is a block
  std::unique_ptr<MixedRows> mixed_;  ///< null: every patch is one observation, and all there is
  Chunks chunks_;                     ///< of the rows
  Chunks patch_chunks_;               ///< empty where the patches' are the rows'
  Chunks image_chunks_;               ///< tiles of images alone: what the camera solver sees
  Columns columns_, pose_columns_;
  const SteppedState* state_ = nullptr;

  Half held_, tried_;
  Buffer<double> rays_;
  Buffer<double> leaving_;                       ///< empty where leaving is free
  Buffer<double> image_tiles_, image_diagonal_;  ///< folded; empty where blocks are images
  std::vector<std::int64_t> tile_of_;            ///< of two images
  Buffer<double> image_steps_, steps_;           ///< kBlockVector per image, per block
  Totals totals_, tried_totals_;
  ScaledLoss loss_;
  bool collapsed_ = false;    ///< held_'s rows are those of its state with loss_
  bool left_before_ = false;  ///< leaving_ is another refinement's
};

}  // namespace sheaf
