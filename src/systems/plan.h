// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lists/batches.h"
#include "lists/block_map.h"
#include "lists/chunks.h"
#include "lists/columns.h"
#include "platform/parallel.h"
#include "reduced/clusters.h"
#include "reduced/symbolic_factor.h"

namespace sheaf {

/// How the camera system is solved.
enum class SolverKind { blocks, dense, sparse, explicit_cg, implicit_cg };

/// "blocks", "dense", "sparse", "iterative-explicit", "iterative-implicit".
const char* to_string(SolverKind kind);

/// What is different where lenses are of any model: their blocks count as images, and are none.
struct LensCounts {
  std::uint64_t images = 0, lenses = 0;
  std::uint64_t slices = 0;  ///< that sums are cut into, by the pairs of images alone
  bool listed = false;       ///< the process holds the lists already
  std::uint64_t scratch_doubles = 0, product_doubles = 0;  ///< of one thread
  std::uint64_t kept_fields = 0;  ///< of a batch's rows, where a mixed implicit solver keeps them
};

/// What decides how much a solver costs; counted before it allocates anything.
struct WorkCounts {
  std::uint64_t images = 0, columns = 0, groups = 0, batches = 0, observations = 0;
  std::uint64_t pairs = 0;  ///< of observations of one point: products to form S
  std::uint64_t tiles = 0;  ///< off-diagonal blocks of S; an upper bound above kExactImages
  std::uint64_t solved_tiles = 0;   ///< of what the rows' blocks hang on; 0: as tiles
  std::uint64_t solved_blocks = 0;  ///< likewise; 0: as images
  /// Of the sparse factor; where that has not been analysed, upper bounds: those of a dense one.
  double sparse_flops = 0;
  std::uint64_t sparse_doubles = 0;
  std::uint64_t sparse_bytes = 0;                  ///< beside these
  std::shared_ptr<const ColumnAnalysis> analysis;  ///< which these are counted from; or null
  /// Of the coarse space of the iterative solvers; 0: none.
  std::uint64_t clusters = 0, cluster_pairs = 0;
  std::uint32_t longest_track = 0;
  std::uint64_t pair_runs = 0;  ///< runs of pairs of one tile in a chunk, about
  bool lens_shared = false;
  bool images_couple = true;         ///< some free point or shared lens couples images
  bool weighted = false;             ///< a loss leaves a metric for each observation
  bool dogleg = false;               ///< the gradient is summed by image, steps are blended
  bool only_formed = false;          ///< there is no implicit product
  std::optional<LensCounts> lenses;  ///< of any model: implicit products are dearer
  std::uint64_t other_bytes = 0;     ///< held besides
  double iterations = 0;  ///< conjugate gradients of a step, where known; 0: typical ones

  static constexpr std::uint64_t kExactImages = 20000;
  static constexpr std::uint64_t kAnalysedTiles = 4000000;
};
/// Also finds the clusters of the coarse space. map: from the columns' blocks to what is solved
/// for; null where these are the same.
WorkCounts count_work(const Batches& batches, const Columns& columns, const BlockMap* map,
                      bool points_held, Clusters& clusters, Threads& threads);

/// Sets what depends on the factor of the formed matrix. tiles: of the columns' blocks, all of them
/// or, where they are too many to list, none.
void count_factor(const Columns& columns, const BlockMap* map, const std::vector<Tile>& tiles,
                  WorkCounts& counts);

/// Blocks of the formed matrix, both triangles and the diagonal.
inline std::uint64_t matrix_blocks(const WorkCounts& c) {
  return 2 * (c.solved_tiles > 0 ? c.solved_tiles : c.tiles) +
         (c.solved_blocks > 0 ? c.solved_blocks : c.images);
}

/// A solver and, in one line, why it was taken.
struct Plan {
  SolverKind kind = SolverKind::dense;
  std::string reason;
  bool mixed = false;                                ///< float inside the solver
  std::shared_ptr<const ColumnAnalysis> analysis{};  ///< of a sparse solver, where counted
  Clusters clusters{};  ///< of an iterative solver's coarse space, as count_work finds them
};

/// Whether the solver has a variant with float inside, and whether that is the quicker one: a pure
/// function of the kind.
bool has_mixed(SolverKind kind);
bool prefers_mixed(SolverKind kind);

/// The cheapest by a model of flops and bytes per step: a pure function of the counts.
Plan plan_solver(const WorkCounts& counts);

/// Once conjugate gradients have run: the plan that is cheaper by half at least than the present
/// kind, with so many iterations a step, or none.
std::optional<Plan> better_plan(WorkCounts counts, SolverKind present, double iterations);

/// The cheaper of the two iterative ones.
SolverKind cheaper_iterative(const WorkCounts& counts);

}  // namespace sheaf
