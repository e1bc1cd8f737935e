// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/lens_plan.h"

#include <algorithm>

#include "eliminate/kept_product.h"

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

}  // namespace

WorkCounts estimate_lens_work(const Arrangement& arranged, bool points_held, Clusters& clusters,
                              Threads& threads) {
  const LensTracks& tracks = arranged.tracks;
  WorkCounts c = count_work(arranged.batches, image_columns(tracks, arranged.columns, true),
                            points_held, clusters, threads);
  c.any_lens = true;
  c.kept_fields = kept_row::fields(tracks.most_blocks);
  c.images_couple = !points_held || tracks.most_blocks > 0;
  const auto images = static_cast<double>(c.columns);
  const LensColumns more(tracks);
  // A border of columns is rows more of every panel; own columns widen the images' blocks.
  const double wider = images > 0 ? 1 + more.own / images : 1;
  c.sparse_flops = c.sparse_flops * wider * wider * wider +
                   2 * more.border * static_cast<double>(c.sparse_doubles) +
                   more.border * more.border * images;
  c.sparse_doubles = static_cast<std::uint64_t>(
      static_cast<double>(c.sparse_doubles) * wider * wider + more.border * images);
  c.columns = static_cast<std::uint64_t>(arranged.columns.count);
  if (more.own > 0) c.tiles *= 4, c.pairs *= 4, c.pair_runs *= 4;
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
  if (c.images_couple) count_factor(arranged.columns, chunks.tiles, c);
  return c;
}

std::uint64_t listed_bytes(const LensChunks& chunks) {
  std::uint64_t sum = 0;
  for (const Chunks* c : {&chunks.chunks, &chunks.slots})
    sum += c->pairs.bytes() + c->pair_runs.bytes() + c->diagonal.bytes() +
           c->diagonal_runs.bytes() + c->tiles.size() * sizeof(Tile);
  return sum;
}

}  // namespace sheaf
