// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/lens_plan.h"

#include <algorithm>

#include "eliminate/kept_product.h"
#include "eliminate/lens_kernels.h"
#include "lists/slices.h"

namespace sheaf {
namespace {

/// Columns of lenses that several images share; of others, beyond those that ride with the image.
struct LensColumns {
  double border = 0, own = 0;

  explicit LensColumns(const LensTracks& tracks) {
    for (const LensPlaces& lens : tracks.lenses)
      (lens.riders > 0 ? own : border) += lens.width[0] + lens.width[1];
  }
};

/// Blocks that an image has with it at most: its own, and those of a lens that it alone has.
std::uint64_t blocks_of_an_image(const LensTracks& tracks) {
  std::uint64_t most = 1;
  for (const LensPlaces& lens : tracks.lenses)
    if (lens.riders > 0) most = std::max<std::uint64_t>(most, 1 + lens.blocks);
  return most;
}

/// Before lists are cut, for which nothing but diagonal blocks is wanted of lenses.
LensCounts count_lenses(const Arrangement& arranged) {
  const Batches& batches = arranged.batches;
  const LensTracks& tracks = arranged.tracks;
  LensCounts out;
  out.images = tracks.image_lens.size();
  out.lenses = tracks.lenses.size();
  out.slices = static_cast<std::uint64_t>(
      count_slices(linearize_flops(batches.num_batches(), 0), 0, out.images));
  const std::uint64_t most =
      std::max<std::uint64_t>(Chunks::kBatchesPerChunk, batches.longest_track);
  const std::uint64_t chunk = std::min(most, batches.num_batches());
  // Rows of slots stand beside batches evenly.
  const std::uint64_t slots =
      chunk * tracks.first_slot.back() / std::max<std::uint64_t>(1, batches.num_batches());
  out.scratch_doubles =
      LensScratch(batches, tracks, {chunk, slots, most_group_slots(tracks), true}).doubles;
  out.product_doubles = product_scratch_doubles(batches, tracks);
  out.kept_fields = kept_row::fields(tracks.most_blocks);
  return out;
}

}  // namespace

WorkCounts estimate_lens_work(const Arrangement& arranged, bool points_held, Clusters& clusters,
                              Threads& threads) {
  const LensTracks& tracks = arranged.tracks;
  const BlockMap* map = arranged.map ? &*arranged.map : nullptr;
  WorkCounts c = count_work(arranged.batches, image_columns(tracks, arranged.columns, true), map,
                            points_held, clusters, threads);
  c.lenses = count_lenses(arranged);
  c.images_couple = c.images_couple || tracks.most_blocks > 0;
  const auto images = static_cast<double>(c.columns);
  const LensColumns more(tracks);
  // A border of columns is rows more of every panel; own columns widen the images' blocks.
  const double wider = images > 0 ? 1 + more.own / images : 1;
  c.sparse_flops = c.sparse_flops * wider * wider * wider +
                   2 * more.border * static_cast<double>(c.sparse_doubles) +
                   more.border * more.border * images;
  c.sparse_doubles = static_cast<std::uint64_t>(
      static_cast<double>(c.sparse_doubles) * wider * wider + more.border * images);
  c.columns = static_cast<std::uint64_t>(arranged.solved_columns().count);
  // Images that share a point couple all blocks of the one with all of the other; and each image is
  // coupled with its lens.
  const std::uint64_t coupled = blocks_of_an_image(tracks) * blocks_of_an_image(tracks);
  c.tiles *= coupled, c.pairs *= coupled, c.pair_runs *= coupled;
  c.tiles += c.images * static_cast<std::uint64_t>(tracks.most_blocks);
  c.images = arranged.columns.num_images();
  return c;
}

WorkCounts count_lens_work(const Arrangement& arranged, const LensChunks& lists,
                           const WorkCounts& estimate) {
  WorkCounts c = estimate;
  const Chunks &chunks = lists.chunks, &slots = lists.slots;
  // An observation's products with its lens are work of about a pair's.
  c.pairs = chunks.pairs.size() + slots.pairs.size() +
            static_cast<std::uint64_t>(arranged.tracks.most_blocks) * c.observations;
  c.pair_runs = chunks.pair_runs.size() + slots.pair_runs.size();
  c.tiles = chunks.tiles.size();
  c.only_formed = true;
  c.lenses->slices = chunks.slices.size() - 1;
  c.lenses->listed = true;
  c.lenses->scratch_doubles =
      LensScratch(arranged.batches, arranged.tracks, chunks, lists.tiles).doubles;
  if (c.images_couple)
    count_factor(arranged.columns, arranged.map ? &*arranged.map : nullptr, chunks.tiles, c);
  return c;
}

}  // namespace sheaf
