// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include "eliminate/kernels.h"
#include "eliminate/row_kernels.h"
#include "geometry/rigid_motion.h"
#include "lists/chunks.h"
#include "lists/columns.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "rows/anchor.h"
#include "rows/photometric.h"
#include "systems/camera_stage.h"
#include "systems/mixed_rows.h"
#include "systems/patch_blocks.h"
#include "systems/system.h"

namespace sheaf {

struct PhotometricRules {
  bool poses_held = false, points_held = false;
  bool brightness = true;              ///< affine, one pair an image
  bool first_brightness_held = false;  ///< where only brightness between images can be told
  double prior_a = 1, prior_b = 100;   ///< standard deviations of the priors a = 1, b = 0
  bool loss_per_patch = false;
  bool leaving_is_free = false;
  bool exact_rows = false;  ///< where patches are warped
};

/// Photometric rows on CPU threads: patches collapse to two rows each, which are stored; from there
/// on points are eliminated, cameras solved and points back-substituted by the code of reprojection
/// rows. A camera block is an image's six pose columns, then a and b.
class PhotometricSystem : public System {
 public:
  /// Dense up to where its factor costs about as much as the patches' pixels; then by blocks.
  static constexpr std::int32_t kMostDenseColumns = 1200;

  /// Fewer than of reprojections, so that records are near: a point that all images see has its own
  /// read for every pair of them.
  static constexpr std::uint64_t kBatchesPerChunk = 32;

  /// Throws std::bad_alloc. The sights are the patches that count, in any order; those that are not
  /// in their image when a loss is first used count as having left. Measured positions have to be
  /// those of points in front of their cameras.
  PhotometricSystem(const PatchScene& scene, const PatchState& state,
                    const std::vector<Sight>& sights, const PhotometricRules& rules,
                    const Kernels& kernels, Threads& threads, Anchor anchor = {});

  Step propose(const StepRequest& request) override;
  Trial trial() override;
  void accept() override;
  double residual_scale(double quantile) override;

  /// The held state.
  PatchState state() const;
  /// Patches outside of their image at the held state.
  std::uint64_t left() const { return left_; }
  const char* solver_name() const { return solver_name_; }

 private:
  struct Half {  ///< all that belongs to one state: the held one or the one tried
    std::vector<RigidMotion<double>> poses;
    std::vector<Brightness> brightness;
    Buffer<double> views, points, brightness_sums, seen;
    Buffer<double> factors;  ///< of the patches; or, where some points' rows are others:
    Buffer<double> rows;     ///< as elimination takes them
    Buffer<double> patch_points, patch_rows;  ///< in the patches' arrangement where that differs
  };
  struct Totals {
    double cost = 0, square_sum = 0;
    std::uint64_t left = 0;
  };

  void fill_state(const PatchState& state);
  void allocate(Half& half) const;
  /// costs: of the patches (PhotometricOutput), or nullptr.
  Totals collapse(Half& half, double* costs);
  Totals collapse_patches(Half& half, double* costs);
  PhotometricInput patches_at(const Half& half) const;
  KeptRows kept(const PhotometricInput& patches) const;
  void gather_rows(Half& half, Totals& totals) const;
  void hold(const ScaledLoss& loss);
  void set_leaving();
  void add_brightness(const Chunk& chunk, double* diagonal) const;
  /// How the rows are arranged, and how the patches are.
  const Batches& rows() const { return mixed_ ? mixed_->batches() : batches_; }
  const Chunks& patch_chunks() const { return mixed_ ? patch_chunks_ : chunks_; }
  void add_priors();
  double prior_cost(const Half& half) const;
  void eliminate(double damping, std::vector<EliminateOutput>& outputs);
  void fold_to_images();
  double step_cameras();
  double median_motion() const;
  ReducedSums sums() const {
    return {&image_chunks_, blocks_.are_pairs() ? image_tiles_.data() : tiles_.data(),
            blocks_.are_pairs() ? image_diagonal_.data() : diagonal_.data()};
  }

  const PatchScene& scene_;
  const PhotometricRules rules_;
  const Kernels& kernels_;
  const RowKernels& row_kernels_;
  void (*const pose_pairs_)(const Chunks&, const Chunk&, const Records&, double* tiles);
  const PhotometricKernels& patch_kernels_;
  Threads& threads_;
  const Anchor anchor_;
  PatchBlocks blocks_;
  Batches batches_;                   ///< of the patches; what these call an image is a block
  std::unique_ptr<MixedRows> mixed_;  ///< null: every patch is one observation, and all there is
  Chunks chunks_;                     ///< of the rows
  Chunks patch_chunks_;               ///< empty where the patches' are the rows'
  Chunks image_chunks_;               ///< tiles of images alone: what the camera solver sees
  Columns columns_;
  std::vector<double> initial_points_;  ///< of points that no patch sees

  Half held_, tried_;
  Buffer<double> rays_;
  Buffer<double> leaving_, leaving_costs_;  ///< empty where leaving is free
  Buffer<double> factors_, tiles_, diagonal_;
  Buffer<double> image_tiles_, image_diagonal_;  ///< folded; empty where blocks are images
  std::vector<std::int64_t> tile_of_;            ///< of two images
  Buffer<double> image_steps_, steps_;           ///< kStepRecord per image, per block
  std::vector<Buffer<double>> scratch_;
  CameraStage stage_;
  const char* solver_name_ = "";
  Totals totals_, tried_totals_;
  std::uint64_t left_ = 0;
  double point_decrease_ = 0;
  ScaledLoss loss_;
  bool collapsed_ = false;  ///< held_'s rows are those of its state with loss_
};

}  // namespace sheaf
