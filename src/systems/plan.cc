// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/plan.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

#include "eliminate/kernels.h"
#include "lists/slices.h"
#include "platform/cancel.h"
#include "platform/shared_word.h"
#include "reduced/block_rows.h"
#include "reduced/coarse_space.h"
#include "reduced/sparse_cholesky.h"
#include "systems/forecast.h"

namespace sheaf {
namespace {

/// Distinct image pairs that share a point, by marking a triangular bitmap; listed if they are at
/// most kAnalysedTiles.
std::uint64_t count_tiles(const Batches& batches, std::uint64_t images, std::vector<Tile>& list,
                          Threads& threads) {
  constexpr std::size_t kGroups = 256, kWords = 65536;
  const auto row_start = [](std::uint64_t row) { return row * (row + 1) / 2; };
  std::vector<std::uint64_t> marked((row_start(images) + 63) / 64, 0);
  threads.for_ranges(batches.groups.size(), kGroups, [&](std::size_t g, std::size_t end) {
    poll_cancelled();
    for_each_image_set(batches, g, end, [&](const std::vector<std::uint32_t>& set) {
      for (std::size_t i = 0; i < set.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
          const std::uint64_t at = row_start(set[i]) + set[j];
          const std::uint64_t bit = std::uint64_t(1) << (at % 64);
          // Most are marked already: reading first keeps the line shared among threads.
          std::uint64_t& word = marked[at / 64];
          if ((load_shared(word) & bit) == 0) set_shared_bits(word, bit);
        }
    });
  });
  std::atomic<std::uint64_t> tiles{0};
  threads.for_ranges(marked.size(), kWords, [&](std::size_t w, std::size_t end) {
    std::uint64_t here = 0;
    for (; w < end; ++w) here += static_cast<std::uint64_t>(std::popcount(marked[w]));
    tiles += here;
  });
  if (tiles > WorkCounts::kAnalysedTiles) return tiles;
  list.reserve(tiles);
  for (std::uint64_t w = 0, row = 0; w < marked.size(); ++w)
    for (std::uint64_t word = marked[w]; word != 0; word &= word - 1) {
      const std::uint64_t at = 64 * w + static_cast<std::uint64_t>(std::countr_zero(word));
      while (at >= row_start(row + 1)) ++row;
      list.push_back(
          {static_cast<std::uint32_t>(row), static_cast<std::uint32_t>(at - row_start(row))});
    }
  return tiles;
}

double seconds(double nanoseconds) { return 1e-9 * nanoseconds; }

/// Times of one step's camera solve on one core, measured: 4.5 ns to multiply a pair and, spread
/// over half a dozen steps, nearly as much to have listed it; 5 ns an observation for an implicit
/// product in mixed precision, 12 ns a block for an explicit one. To place a tile: a guess.
constexpr double kPairNs = 8, kImplicitNs = 5, kBlockNs = 12, kPlaceNs = 200, kDenseFlopsPerNs = 85;
/// An observation's part in an implicit product through lenses of any model.
constexpr double kLensImplicitNs = 30;
/// Conjugate gradient steps of a typical solve: with a coarse space as many on streets as in
/// collections.
double iterations(const WorkCounts& c) {
  if (c.iterations > 0) return c.iterations;
  return c.clusters > 0 ? 9 : 15;
}
/// The coarse matrix: an observation's part in it, every other step; its factor's entries to
/// substitute with.
constexpr double kCoarseNs = 6, kCoarseEntryNs = 0.5;
double coarse_seconds(const WorkCounts& c) {
  const double n = kCoarseModes * static_cast<double>(c.clusters);
  return seconds(kCoarseNs * static_cast<double>(c.observations) * (c.clusters > 0) +
                 n * n * n / 3 / kDenseFlopsPerNs + iterations(c) * kCoarseEntryNs * n * n);
}

/// S's blocks as slices of sums: multiplied into, and 704 bytes of each cleared, added to and
/// summed, which for many slices outweighs the products where they are more than a cache holds. Set
/// so that the order of solvers comes out as timed for dubrovnik-356 and for 64 to 90 images.
constexpr double kSliceTileNs = 400, kCachedSliceTileNs = 80, kCachedBytes = 32e6;
double forming_seconds(const WorkCounts& c) {
  const int slices = count_slices(linearize_flops(c.batches, c.pairs), c.tiles, c.images);
  const double tiles = slices * static_cast<double>(c.tiles);
  const bool cached = 8 * kTileDoubles * tiles < kCachedBytes;
  return seconds(kPairNs * static_cast<double>(c.pairs) +
                 (cached ? kCachedSliceTileNs : kSliceTileNs) * tiles);
}

/// Measured: below a thousand columns clearing, filling and substituting weigh as much as flops.
constexpr double kDenseEntryNs = 1.5;
double dense_seconds(const WorkCounts& c) {
  const double n = static_cast<double>(c.columns);
  return forming_seconds(c) + seconds(n * n * n / 3 / kDenseFlopsPerNs + kDenseEntryNs * n * n);
}
/// Measured. Panels are also cleared, filled and read twice to substitute.
constexpr double kSparseFlopsPerNs = 65, kSparseEntryNs = 2.5;
double sparse_seconds(const WorkCounts& c) {
  return forming_seconds(c) + seconds(c.sparse_flops / kSparseFlopsPerNs +
                                      kSparseEntryNs * static_cast<double>(c.sparse_doubles));
}
double explicit_seconds(const WorkCounts& c) {
  const auto blocks = static_cast<double>(matrix_blocks(c));
  return forming_seconds(c) + coarse_seconds(c) +
         seconds(kPlaceNs * static_cast<double>(c.tiles) + iterations(c) * kBlockNs * blocks);
}
double implicit_seconds(const WorkCounts& c) {
  if (c.only_formed) return std::numeric_limits<double>::infinity();
  return coarse_seconds(c) + seconds(iterations(c) * (c.lenses ? kLensImplicitNs : kImplicitNs) *
                                     static_cast<double>(c.observations));
}

/// Seconds a step.
constexpr double kWorthIterating = 1e-3;

std::string milliseconds(double s) { return std::to_string(std::lround(1e3 * s)) + " ms"; }

}  // namespace

const char* to_string(SolverKind kind) {
  switch (kind) {
    case SolverKind::blocks:
      return "blocks";
    case SolverKind::dense:
      return "dense";
    case SolverKind::sparse:
      return "sparse";
    case SolverKind::explicit_cg:
      return "iterative-explicit";
    case SolverKind::implicit_cg:
      return "iterative-implicit";
  }
  return "dense";
}

void count_factor(const Columns& columns, const BlockMap* map, const std::vector<Tile>& tiles,
                  WorkCounts& c) {
  if (map != nullptr) c.columns = static_cast<std::uint64_t>(map->columns.count);
  const auto n = static_cast<double>(c.columns);
  c.sparse_flops = n * n * n / 3;
  c.sparse_doubles = c.columns * (c.columns + 8);
  if (tiles.size() == c.tiles) {
    const std::vector<Tile> solved = map == nullptr ? tiles : map->solved_tiles(tiles);
    if (map != nullptr) {
      c.solved_tiles = solved.size();
      c.solved_blocks = map->columns.num_images();
    }
    c.analysis = analyse_columns(map == nullptr ? columns : map->columns, solved);
    const SymbolicFactor& symbolic = c.analysis->symbolic;
    c.sparse_flops = symbolic.flops;
    c.sparse_doubles = symbolic.panel_doubles;
    c.sparse_bytes = SparseCholesky::bytes(symbolic) - 8 * symbolic.panel_doubles;
  }
  c.lens_shared = columns.lens_shared;
}

WorkCounts count_work(const Batches& batches, const Columns& columns, const BlockMap* map,
                      bool points_held, Clusters& clusters, Threads& threads) {
  WorkCounts c;
  c.images = columns.num_images();
  c.columns = static_cast<std::uint64_t>(columns.count);
  c.groups = batches.groups.size();
  c.batches = batches.num_batches();
  c.observations = batches.observations;
  c.longest_track = batches.longest_track;
  c.images_couple = !points_held || columns.lens_shared;
  if (points_held) {
    if (map != nullptr) {
      c.images_couple = c.images_couple || !map->solved_tiles({}).empty();
      count_factor(columns, map, {}, c);
    }
    return c;
  }
  for (const Batches::Group& group : batches.groups)
    c.pairs += std::uint64_t(group.track) * (group.track - 1) / 2 * group.lanes;
  const std::uint64_t all = c.images * (c.images + 1) / 2;
  std::vector<Tile> tiles;
  c.tiles = c.images <= WorkCounts::kExactImages ? count_tiles(batches, c.images, tiles, threads)
                                                 : std::min(all, c.pairs);
  count_factor(columns, map, tiles, c);
  c.pair_runs = estimate_pair_runs(batches, c);
  clusters = coarse_clusters(batches, columns, map, threads);
  c.clusters = static_cast<std::uint64_t>(clusters.count);
  c.cluster_pairs = count_cluster_pairs(clusters.pairs);
  return c;
}

Plan plan_solver(const WorkCounts& c) {
  if (!c.images_couple)
    return {SolverKind::blocks, "nothing free couples the images: one small system for each of " +
                                    std::to_string(c.images)};
  const double dense = dense_seconds(c), sparse = sparse_seconds(c),
               explicit_cg = explicit_seconds(c), implicit_cg = implicit_seconds(c);
  const std::uint64_t images = c.lenses ? c.lenses->images : c.images;
  const std::uint64_t of_lenses = c.images - std::min(images, c.images);
  const std::string counts =
      std::to_string(images) + " images, " +
      (of_lenses > 0 ? std::to_string(of_lenses) + " blocks of lenses, " : std::string()) +
      std::to_string(c.tiles) + " blocks, " + std::to_string(c.pairs) + " pairs";
  const std::string costs =
      ": about " + milliseconds(dense) + " a step dense, " + milliseconds(sparse) + " sparse, " +
      milliseconds(explicit_cg) + " iterative explicit" +
      (c.only_formed ? std::string() : ", " + milliseconds(implicit_cg) + " iterative implicit");
  const bool too_long = c.longest_track > Chunks::kLongestTrack;
  if (too_long)
    return {SolverKind::implicit_cg, counts + ": a point is seen " +
                                         std::to_string(c.longest_track) +
                                         " times, too often to form the camera matrix"};
  // Exact steps are fewer: conjugate gradients must save something that can be felt.
  const double iterative = std::min(explicit_cg, implicit_cg) + kWorthIterating;
  if (std::min(dense, sparse) <= iterative)
    return {sparse < dense ? SolverKind::sparse : SolverKind::dense, counts + costs};
  if (explicit_cg <= implicit_cg) return {SolverKind::explicit_cg, counts + costs};
  return {SolverKind::implicit_cg, counts + costs};
}

std::optional<Plan> better_plan(WorkCounts c, SolverKind present, double iterations) {
  constexpr double kWorthIt = 1.5;
  c.iterations = iterations;
  const auto cost = [&c](SolverKind kind) {
    switch (kind) {
      case SolverKind::blocks:
        break;
      case SolverKind::dense:
        return dense_seconds(c);
      case SolverKind::sparse:
        return sparse_seconds(c);
      case SolverKind::explicit_cg:
        return explicit_seconds(c);
      case SolverKind::implicit_cg:
        return implicit_seconds(c);
    }
    return 0.0;
  };
  Plan plan = plan_solver(c);
  if (plan.kind == present || kWorthIt * cost(plan.kind) > cost(present)) return std::nullopt;
  return plan;
}

SolverKind cheaper_iterative(const WorkCounts& c) {
  const bool formed = explicit_seconds(c) <= implicit_seconds(c);
  return formed && c.longest_track <= Chunks::kLongestTrack ? SolverKind::explicit_cg
                                                            : SolverKind::implicit_cg;
}

bool has_mixed(SolverKind kind) {
  return kind == SolverKind::implicit_cg || kind == SolverKind::explicit_cg;
}

bool prefers_mixed(SolverKind kind) { return has_mixed(kind); }

}  // namespace sheaf
