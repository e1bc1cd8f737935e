// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "eliminate/dogleg_kernels.h"
#include "eliminate/kept_product.h"
#include "eliminate/kernels.h"
#include "lists/lens_tracks.h"

namespace sheaf {

/// A state: kImageRecord per image, kLensRecord per lens, kPointGroup per group.
struct LensState {
  const double *images, *lenses, *points;
};

struct LensInput {
  const Batches* batches;
  const LensTracks* tracks;
  LensState at;
};

struct LensEliminateInput {
  LensInput of;
  double damping;
  bool points_held;
  ScaledLoss loss{};
  ChartRules chart{};
  const double* own_damping = nullptr;  ///< as EliminateInput
};

/// Records of one chunk. Those of observations are as elimination of any rows leaves them; the T
/// records of the points' slots, T_l = sum T over the observations through one lens, follow them
/// in T. `lens` has, for each observation and block of its lens, what the products between the
/// lens and itself or the image need: with J the lens's columns,
///   C = Lm^T J,   G = Lm^-1 (J - B T_l^T),   so that a^T G = J_a^T J - T_a T_l^T for C_a = Lm^T
///   J_a;
/// kLensPairRecord doubles. Where only diagonal blocks of a few lenses are wanted, `blocks` holds
/// these as they are summed, and there are no records of lenses and slots.
struct LensRecords {
  Records image;
  double* lens;
  double* slots;   ///< of one group's sums T_l
  double* blocks;  ///< kBlockSums per block of a lens and one more; nullptr: not so summed
};
/// What the size of a chunk's records depends on.
struct LensSizes {
  std::size_t batches;      ///< of any chunk, at most
  std::size_t slots;        ///< rows of slots of any chunk, at most
  std::size_t group_slots;  ///< rows of slots of any group, at most
  bool only_diagonal;       ///< nothing but the lenses' diagonal blocks is wanted of them
};
/// The records laid out for any of these chunks in one thread's scratch.
struct LensScratch {
  std::size_t C, lens, slots, blocks, jacobians, doubles;  ///< from the start, T's; in all

  LensScratch(const Batches& batches, const LensTracks& tracks, const LensSizes& sizes);
  LensScratch(const Batches& batches, const LensTracks& tracks, const Chunks& chunks,
              const LensTiles& tiles);
  LensRecords in(double* scratch) const {
    return {{scratch, scratch + C, scratch + jacobians},
            scratch + lens,
            scratch + slots,
            jacobians > blocks ? scratch + blocks : nullptr};
  }
};
struct LensTrialInput {
  const Batches* batches;
  const LensTracks* tracks;
  LensState held;   ///< with the step
  LensState tried;  ///< stepped; its points are not read
  const double* factors;
  int inner_iterations;
  double mean_square;
  ScaledLoss loss{};
  const double* metric = nullptr;
  ChartRules chart{};  ///< as in elimination; ChartBase::none where points are held
  PointBlend blend{};
  OwnIterations own{};
};

/// x: kProductRecord doubles for each block of an image or a lens, nine of them used.
struct LensProductInput {
  LensInput of;
  const double* factors;
  const double* metric = nullptr;  ///< as elimination left it; nullptr: no loss
  const double* x = nullptr;
};
/// Doubles of `saved` that a product needs.
std::size_t product_scratch_doubles(const Batches& batches, const LensTracks& tracks);

/// One instruction set's kernels for lenses of any model, over one chunk.
struct LensKernels {
  const char* name;
  /// As Kernels::linearize, with the slots' and the lenses' records.
  void (*linearize)(const LensEliminateInput&, const Chunk&, const LensRecords&,
                    EliminateOutput& out);
  /// Adds to the sums of a slice what concerns lenses' blocks: all of their diagonal blocks, and
  /// the tiles of a lens with itself or an image of its own. Pairs of an image and another's lens
  /// are pairs of T records like any other.
  void (*products)(const LensTracks&, const LensTiles&, const Chunks&, const Chunk&,
                   const LensRecords&, double* diagonal, double* tiles);
  /// As Kernels::pairs, of images whose blocks are poses alone.
  void (*pose_pairs)(const Chunks&, const Chunk&, const Records&, double* tiles);
  /// As Kernels::trial; newly_behind is not counted.
  void (*trial)(const LensTrialInput&, const Chunk&, TrialOutput& out);
  /// y += (U - W (V + D)^-1 W^T) x of the chunk's points, likewise by blocks.
  void (*product)(const LensProductInput&, const Chunk&, double* saved, double* y);
  /// |r_x| of a batch's eight lanes, then |r_y|, 16 per batch of the chunk.
  void (*residuals)(const LensInput&, const Chunk&, double* out);

  // What a dogleg needs beyond a damped step (eliminate/dogleg_kernels.h), x being the cameras'
  // step.

  /// Adds -Jc^T r to the blocks' sums, kProductRecord each.
  void (*gradient)(const LensProductInput&, const Chunk&, double* sums);
  void (*curvature)(const LensProductInput&, double damping, bool points_held, const Chunk&,
                    CurvatureOutput& out);
  /// Sum over the chunk's points of d^T D d, d back-substituted.
  double (*point_damping)(const LensProductInput&, const Chunk&);

  /// Rows in single precision for products to come (eliminate/kept_product.h), the points' times
  /// 1 / unit; x and the factors are not read.
  void (*keep)(const LensProductInput&, double unit, const Chunk&, float* rows);
};

/// Plain scalar code, one observation at a time: the twin that the others are tested against.
const LensKernels& reference_lens_kernels();

/// simd_name: as of Kernels; "scalar" gives the reference.
const LensKernels& lens_kernels(const char* simd_name);

}  // namespace sheaf
