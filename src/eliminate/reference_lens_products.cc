// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The sums of lenses' blocks once more as plain scalar code (reference_lens.cc).
#include "eliminate/reference_lens.h"

namespace sheaf {
namespace {

using TwoRows = std::array<std::array<double, 9>, 2>;

TwoRows image_C(const Records& records, std::size_t record) {
  const double *C = records.C + kCRecord * record, *T = records.T + kTRecord * record;
  TwoRows out;
  for (int e = 0; e < 2; ++e)
    for (int k = 0; k < 9; ++k) out[std::size_t(e)][std::size_t(k)] = c_entry(T, C, e, k);
  return out;
}

/// C of a lens's block, then G.
std::array<TwoRows, 2> lens_C_and_G(const double* lens) {
  using namespace lens_pair_record;
  std::array<TwoRows, 2> out;
  for (std::size_t e = 0; e < 2; ++e)
    for (std::size_t k = 0; k < 9; ++k) {
      out[0][e][k] = lens[k < 8 ? kC + 8 * e + k : kC8 + e];
      out[1][e][k] = lens[k < 8 ? kG + 8 * e + k : kG8 + e];
    }
  return out;
}

double dot(const TwoRows& a, int i, const TwoRows& b, int k) {
  const auto p = static_cast<std::size_t>(i), q = static_cast<std::size_t>(k);
  return a[0][p] * b[0][q] + a[1][p] * b[1][q];
}

/// tile -= row^T column; a tile holds what is taken away.
void take_from_tile(const TwoRows& row, const TwoRows& column, double* tile) {
  for (int i = 0; i < 9; ++i)
    for (int k = 0; k < 9; ++k) tile[tile_layout::at(i, k)] -= dot(row, i, column, k);
}

/// What one observation adds to the blocks of its lens; record: of the chunk.
void add_observation(const LensTracks& tracks, const LensTiles& tiles_of, std::uint32_t image,
                     const LensRecords& records, std::size_t record, double* diagonal,
                     double* tiles) {
  const std::uint32_t lens = tracks.image_lens[image];
  const LensPlaces& places = tracks.lenses[lens];
  const double* own =
      records.lens + kLensPairRecord * static_cast<std::size_t>(tracks.most_blocks) * record;
  const TwoRows C_image = image_C(records.image, record);
  const double* h = records.image.T + kTRecord * record + t_record::kH;
  for (std::size_t j = 0; j < places.blocks; ++j) {
    const auto [C, G] = lens_C_and_G(own + kLensPairRecord * j);
    if (!tiles_of.of_image.empty())
      take_from_tile(G, C_image, tiles + kTileDoubles * tiles_of.of_image[2 * image + j]);
    double* block = diagonal + kDiagonalDoubles * (places.first_block + j);
    for (int i = 0; i < 9; ++i) {
      for (int k = 0; k < 9; ++k)
        if (diagonal_layout::is_stored(i, k)) block[diagonal_layout::at(i, k)] += dot(C, i, G, k);
      block[diagonal_layout::right_side(i)] +=
          C[0][std::size_t(i)] * h[0] + C[1][std::size_t(i)] * h[1];
    }
    if (j == 1 && !tiles_of.of_lens.empty())
      take_from_tile(C, lens_C_and_G(own)[1], tiles + kTileDoubles * tiles_of.of_lens[lens]);
  }
}

/// The squares of T_l, by which a block's columns are scaled.
void add_slot_squares(const LensTracks& tracks, const Chunk& chunk, const double* slots,
                      double* diagonal) {
  const std::uint64_t first = 8 * tracks.first_slot[chunk.first_group];
  for (std::uint64_t at = first; at < 8 * tracks.first_slot[chunk.end_group]; ++at) {
    if (tracks.slot_block[at] < 0) continue;
    const double* T = slots + kTRecord * (at - first);
    for (int i = 0; i < 9; ++i)
      for (int c = 0; c < 3; ++c)
        diagonal[kDiagonalDoubles * static_cast<std::size_t>(tracks.slot_block[at]) +
                 static_cast<std::size_t>(diagonal_layout::squares(i))] +=
            T[t_record::at(c, i)] * T[t_record::at(c, i)];
  }
}

}  // namespace

void lens_products_by_reference(const LensTracks& tracks, const LensTiles& tiles_of,
                                const Chunks& chunks, const Chunk& chunk,
                                const LensRecords& records, double* diagonal, double* tiles) {
  if (records.blocks != nullptr) {
    for (std::size_t b = 0; b < lens_blocks(tracks); ++b)
      for (std::size_t i = 0; i < kDiagonalDoubles; ++i)
        diagonal[kDiagonalDoubles * (tracks.image_lens.size() + b) + i] +=
            records.blocks[kBlockSums * b + i];
    return;
  }
  for (std::uint64_t i = chunk.first_diagonal_run; i < chunk.end_diagonal_run; ++i) {
    const DiagonalRun& run = chunks.diagonal_runs[i];
    for (std::uint64_t r = run.first; r < run.first + run.count; ++r)
      add_observation(tracks, tiles_of, run.image, records, chunks.diagonal[r], diagonal, tiles);
  }
  const std::uint64_t observations = 8 * (chunk.end_batch - chunk.first_batch);
  if (tracks.most_blocks > 0)
    add_slot_squares(tracks, chunk, records.image.T + kTRecord * observations, diagonal);
}

}  // namespace sheaf
