// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/forecast.h"

#include <algorithm>
#include <vector>

#include "eliminate/kernels.h"
#include "lists/slices.h"
#include "platform/pages.h"
#include "reduced/block_rows.h"
#include "reduced/coarse_space.h"
#include "reduced/recycled_modes.h"
#include "reduced/sparse_cholesky.h"
#include "reduced/steihaug_path.h"
#include "systems/camera_state.h"

namespace sheaf {
namespace {

/// Code and libraries that are first run while solving; a thread's stack and heap. Measured.
constexpr std::uint64_t kCode = 384 << 10, kThread = 128 << 10;

/// Adds up what arrays will be resident with.
class Footprint {
 public:
  explicit Footprint(std::uint64_t bytes) : bytes_(bytes) {}
  void add(std::uint64_t count, std::uint64_t each, std::uint64_t copies = 1) {
    bytes_ += copies * resident_bytes_of(count * each);
  }
  std::uint64_t bytes() const { return bytes_; }

 private:
  std::uint64_t bytes_;
};

std::uint64_t count_chunks(const WorkCounts& c) { return 1 + c.batches / Chunks::kBatchesPerChunk; }

void add_lists(const WorkCounts& c, SolverKind kind, Footprint& sum) {
  if (c.lenses && c.lenses->listed) return;
  sum.add(count_chunks(c), sizeof(Chunk));
  if (kind == SolverKind::implicit_cg && !c.lenses) return;
  sum.add(c.observations, sizeof(std::uint16_t));
  sum.add(std::min(c.observations, count_chunks(c) * c.images), sizeof(DiagonalRun));
  if (kind == SolverKind::blocks || kind == SolverKind::implicit_cg) return;
  sum.add(c.pairs, sizeof(RecordPair));
  sum.add(c.pair_runs, sizeof(PairRun));
  sum.add(c.tiles, sizeof(Tile) + sizeof(std::uint32_t));
}

void add_state(const WorkCounts& c, Footprint& sum) {
  const std::uint64_t images = c.lenses ? c.lenses->images : c.images;
  const std::uint64_t lenses = c.lenses ? c.lenses->lenses : c.images;
  sum.add(images, sizeof(RigidMotion<double>), 2);
  sum.add(lenses, sizeof(CameraState::Parameters), 2);
  sum.add(images, 8 * (c.lenses ? kImageRecord : kCameraRecord), 2);
  if (c.lenses) sum.add(lenses, 8 * kLensRecord, 2);
  sum.add(c.groups, 8 * kPointGroup, 2);
  sum.add(c.groups, 8 * kFactorGroup);
  if (c.weighted) {
    sum.add(c.batches, 8 * kMetricBatch);
    sum.add(c.groups, 64, 2);  // the points' own damping, what they cost
  }
  sum.add(c.columns, 8, 4);  // right-hand side, squares, damping, step
}

/// Of threads that take slices.
void add_scratch(const WorkCounts& c, SolverKind kind, std::uint64_t each, Footprint& sum) {
  const std::uint64_t track = c.longest_track, batches = std::max(Chunks::kBatchesPerChunk, track);
  const std::uint64_t bal =
      8 * std::min(batches, c.batches) * (kTRecord + kCRecord) + kRowBatch * track;
  sum.add(c.lenses ? c.lenses->scratch_doubles : bal, 8, each);
  if (kind == SolverKind::implicit_cg)
    sum.add(c.lenses ? c.lenses->product_doubles : kProductScratch * track, 8, each);
  if (c.clusters > 0) sum.add(kCoarseScratch * std::min(c.clusters, track), 8, each);
}

void add_iterative(const WorkCounts& c, const Plan& plan, std::uint64_t slices, Footprint& sum) {
  constexpr std::uint64_t kVector = 8 * kBlockVector, kBlock = 72;
  sum.add(c.images, 81 * 8);
  sum.add(c.images, kBlock + 4);
  sum.add(c.columns, 8, 4);
  sum.add(c.images, kVector, 2);
  sum.add(RecycledModes::most_bytes(c.columns), 1);
  if (plan.kind == SolverKind::explicit_cg) {
    sum.add(matrix_blocks(c), 8 * kBlockEntry);  // in the end double, mixed or not
    sum.add(matrix_blocks(c), 4);
    sum.add(2 * c.tiles, 8);
    sum.add(c.images, kVector, 2);
  }
  if (plan.kind == SolverKind::implicit_cg) {
    sum.add(slices * c.images, 8 * kProductRecord);
    if (plan.mixed && !c.lenses) sum.add(c.images, 4 * kFloatCameraRecord);
    if (plan.mixed && c.lenses) sum.add(8 * c.lenses->kept_fields * c.batches, 4);
  }
  if (c.clusters == 0) return;
  const std::uint64_t modes = kCoarseModes * c.clusters;
  sum.add(slices * c.cluster_pairs, 8 * kCoarseTile);
  sum.add(DenseCholesky::bytes(modes), 1);
  sum.add(c.clusters * (c.clusters + 1) / 2, 4);
  sum.add(c.images, 8 * kCoarseBasis);
}

/// What the first rejected step of a dogleg takes.
void add_dogleg(const WorkCounts& c, SolverKind kind, std::uint64_t slices, Footprint& sum) {
  sum.add(slices * c.images, 8 * kProductRecord);
  sum.add(c.columns, 8, 2);
  if (kind == SolverKind::explicit_cg || kind == SolverKind::implicit_cg)
    sum.add(SteihaugPath::most_bytes(c.columns), 1);
}

/// Pairs looked at in one sample, and worth sampling for.
constexpr std::uint64_t kWorthCounting = 500000;

/// The images of each pair of observations of one point, as far as there is room.
void list_pairs(const Batches& batches, const Batches::Group& group,
                std::vector<std::uint64_t>& keys) {
  const std::uint32_t* image = &batches.image[8 * group.first_batch];
  for (std::uint32_t l = 0; l < group.lanes; ++l)
    for (std::uint32_t o = 1; o < group.track && keys.size() < kWorthCounting; ++o)
      for (std::uint32_t i = 0; i < o && keys.size() < kWorthCounting; ++i)
        keys.push_back(std::uint64_t(image[8 * o + l]) << 32 | image[8 * i + l]);
}

}  // namespace

std::uint64_t forecast_bytes(const WorkCounts& c, const Plan& plan, int threads) {
  const SolverKind kind = plan.kind;
  const bool pairs = kind != SolverKind::blocks && kind != SolverKind::implicit_cg;
  const std::uint64_t tiles = pairs ? c.tiles : 0;
  const auto slices = c.lenses
                          ? c.lenses->slices
                          : static_cast<std::uint64_t>(count_slices(
                                linearize_flops(c.batches, pairs ? c.pairs : 0), tiles, c.images));
  Footprint sum(kCode + kThread * static_cast<std::uint64_t>(threads - 1));
  sum.add(c.other_bytes, 1);
  add_lists(c, kind, sum);
  add_state(c, sum);
  sum.add(slices * tiles, 8 * kTileDoubles);
  sum.add(slices * c.images, 8 * kDiagonalDoubles);
  add_scratch(c, kind, std::min(slices, static_cast<std::uint64_t>(threads)), sum);
  if (kind == SolverKind::dense) sum.add(c.columns * (c.columns + 8), 8);
  if (kind == SolverKind::sparse) {
    sum.add(c.sparse_doubles, 8);
    sum.add(c.sparse_bytes, 1);
    // The way of each tile into the factor, listed and sorted; several where lenses are shared.
    sum.add((c.lens_shared ? 4 : 1) * (c.tiles + c.images), 24, 2);
    sum.add((c.lens_shared ? 4 : 1) * (c.tiles + c.images), 4);
  }
  if (kind == SolverKind::explicit_cg || kind == SolverKind::implicit_cg)
    add_iterative(c, plan, slices, sum);
  if (c.dogleg) add_dogleg(c, kind, slices, sum);
  if (kind == SolverKind::blocks) sum.add(c.images, 81 * 8 + 76);
  return sum.bytes();
}

std::uint64_t estimate_pair_runs(const Batches& batches, const WorkCounts& c) {
  constexpr std::uint64_t kSampled = 16;
  const std::uint64_t chunks = count_chunks(c);
  const std::uint64_t bound = std::min(c.pairs, chunks * c.tiles);
  if (bound < kWorthCounting) return bound;
  double runs = 0, pairs = 0;
  std::vector<std::uint64_t> keys;
  for (std::uint64_t s = 0; s < kSampled; ++s) {
    keys.clear();
    auto group = std::partition_point(
        batches.groups.begin(), batches.groups.end(),
        [&](const Batches::Group& g) { return g.first_batch < c.batches / kSampled * s; });
    if (group == batches.groups.end()) --group;
    const std::uint64_t end = group->first_batch + Chunks::kBatchesPerChunk;
    do list_pairs(batches, *group++, keys);
    while (group != batches.groups.end() && group->first_batch + group->track <= end &&
           keys.size() < kWorthCounting);
    pairs += static_cast<double>(keys.size());
    std::sort(keys.begin(), keys.end());
    runs += static_cast<double>(std::unique(keys.begin(), keys.end()) - keys.begin());
  }
  return pairs > 0 ? static_cast<std::uint64_t>(runs / pairs * static_cast<double>(c.pairs)) : 0;
}

}  // namespace sheaf
