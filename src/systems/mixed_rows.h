// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "lists/batches.h"
#include "lists/chunks.h"
#include "platform/buffer.h"
#include "rows/anchor.h"
#include "rows/photometric.h"
#include "systems/patch_blocks.h"

namespace sheaf {

/// The rows of points whose observations are not one patch each: patches of several pairs of rows,
/// and measured positions beside patches. Elimination knows observations of two rows only, and
/// several of one point in one block are as good as any; so each pair, and each measurement,
/// becomes one. The patches keep the arrangement in which their pixels are read.
class MixedRows {
 public:
  /// Of patches in their own arrangement, each with so many pairs of rows. `lanes`: of RowKernels.
  MixedRows(const PatchScene& scene, const PatchBlocks& blocks, const Batches& patches, int pairs,
            const Anchor& anchor, std::size_t points, int lanes);

  const Batches& batches() const { return batches_; }

  /// 8 x group + lane of a point in the rows' arrangement.
  std::uint64_t place_of(std::uint32_t point) const { return place_[point]; }

  /// Points in the arrangement of the rows to that of the patches.
  void spread_points(const Batches& patches, const double* points, double* patch_points) const;

  struct State {
    const double* views;       ///< kViewRecord per block
    const double* points;      ///< kPointGroup per group of the rows
    const double* patch_rows;  ///< `pairs` batches of rows for each of the patches
    double* measured_costs;    ///< to be written: twice, of each point's measurements, 8 per group
  };
  struct Totals {
    double cost = 0, square_sum = 0;  ///< of the measurements, twice
  };
  /// The rows of groups [first, end): those of patches copied, those of measurements computed.
  Totals gather(const State& state, std::uint32_t first, std::uint32_t end, double* rows) const;

 private:
  void copy_rows(const double* patch_rows, std::uint64_t pair, int lane, double* to) const;
  AnchorRow measure(const State& state, std::size_t group, std::uint64_t batch, int lane,
                    const Measurement& of) const;

  const PatchScene& scene_;
  const Anchor& anchor_;
  const int pairs_, lanes_;
  std::uint64_t patch_pairs_ = 0;  ///< 8 x pairs x batches of patches: what sources go up to
  Batches batches_;
  std::vector<std::uint64_t> source_;  ///< of 8 lanes of a batch: pair of a patch's lane, then
                                       ///< measurements
  std::vector<std::uint64_t> place_;   ///< of a point: 8 x group + lane
};

}  // namespace sheaf
