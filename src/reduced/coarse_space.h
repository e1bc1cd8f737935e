// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "eliminate/kernels.h"
#include "lists/block_map.h"
#include "lists/columns.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "reduced/clusters.h"
#include "reduced/coarse_schedule.h"
#include "reduced/dense_cholesky.h"

namespace sheaf {

struct Couplings;

/// Clusters of images that move as rigid bodies which may also grow and zoom: Z has kCoarseModes
/// columns for each cluster, and E = Z^T (S + D) Z. Schur-Jacobi passes a correction on from image
/// to image; a solve with E carries it through the scene at once (docs/math.md, section 7). Z and S
/// in E may be those of an earlier state (CoarseSchedule), D is always the present one.
class CoarseSpace {
 public:
  /// columns: of the solved blocks. map: from the images of the rows to these; null where images
  /// are what is solved for.
  CoarseSpace(const Batches& batches, const Columns& columns, const BlockMap* map,
              Clusters clusters, std::size_t slices, const Kernels& kernels, Threads& threads);

  /// What Z is placed by: kCameraRecord per solved block and, where rows are mapped, 48 doubles per
  /// sensor, rows of the adjoint eight apart.
  struct State {
    const double* cameras;
    const double* adjoints = nullptr;
    std::size_t first_point = SIZE_MAX;  ///< from this block on records are of kept points: X, Y, Z
  };
  /// Before a state is linearised with this relative damping: whether E is needed, and if so summed
  /// anew with Z at this state.
  void begin(const State& state, double lambda);
  /// The sums of a slice of chunks, by the thread that works at it; nothing where E is kept.
  void clear(std::size_t slice);
  void add(std::size_t slice, const Chunk& chunk, const Records& records);
  /// Forms E, from the new sums and S's diagonal blocks or from those kept, and factors it. False
  /// where it is not needed or not positive definite to rounding: no correction then. diagonal: of
  /// the rows' blocks.
  bool factor(const double* diagonal, const double* damping, const Couplings& couplings);
  /// What a solve with the correction took, and the cost of a state that is gone on to.
  void solved(int iterations) { schedule_.solved(iterations); }
  void moved(double cost) { schedule_.moved(cost); }
  /// z += Z E^-1 Z^T r.
  void add_correction(const double* r, double* z) const;

  /// The matrix that is kept, and when it is to be summed anew.
  struct History {
    CoarseSchedule schedule;
    std::vector<double> basis, row_basis, sums, own;
  };
  History history() const;
  /// False, and nothing done, where it is of another space.
  bool restore(const History& history);

  std::int32_t num_clusters() const { return clusters_.count; }
  /// Z of a solved block: rows 0..6 of its nine x modes, row-major.
  const double* basis(std::size_t block) const { return &basis_[kCoarseBasis * block]; }
  std::uint64_t bytes() const;
  static std::uint64_t bytes(std::uint64_t images, std::uint64_t clusters, std::uint64_t tiles,
                             std::uint64_t slices);

 private:
  void place(const State& state);
  void place_point(std::size_t block, const double* X);
  void place_rows(const double* adjoints);
  const double* row_basis() const { return map_ ? row_basis_.data() : basis_.data(); }
  void place_image(std::size_t image, const double* camera);
  void sum_own(const double* diagonal);
  void add_tiles();
  void add_couplings(const Couplings& couplings);
  void add_damping(const double* damping);
  void scale();

  const Batches& batches_;
  const Columns& columns_;
  const BlockMap* map_;
  const Kernels& kernels_;
  Threads& threads_;
  Clusters clusters_;
  std::vector<char> zooms_;  ///< images whose focal length is free and their own
  std::size_t slices_;
  std::vector<Buffer<double>> scratch_;
  std::vector<std::array<double, 3>> centres_;  ///< of the clusters' cameras
  std::vector<double> scale_;                   ///< of each mode: E has a unit diagonal
  Buffer<double> basis_;
  Buffer<double> row_basis_;        ///< of each image of the rows, M Z; where these are mapped
  std::vector<std::int32_t> tile_;  ///< number_cluster_pairs
  std::size_t tiles_;
  Buffer<double> sums_;  ///< kCoarseTile per tile, one set per slice, the first ends up as the sum
  Buffer<double> own_;   ///< Z^T S Z of S's diagonal blocks alone, kCoarseTile per cluster
  CoarseSchedule schedule_;
  DenseCholesky cholesky_;
  mutable Buffer<double> coarse_;
};

/// The clusters of a coarse space, or none where there are too few images for one to pay.
Clusters coarse_clusters(const Batches& batches, const Columns& columns, const BlockMap* map,
                         Threads& threads);

}  // namespace sheaf
