// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/arrangement.h"

#include <string>

namespace sheaf {

Result<Arrangement> arrange_with_lenses(const Problem& problem, const Fixed& fixed,
                                        const std::vector<std::uint8_t>& skip, Threads& threads) {
  Arrangement out;
  out.batches = arrange(problem, skip, threads);
  out.tracks = arrange_lenses(problem, fixed, out.batches, threads);
  if (!LensChunks::possible(out.batches, out.tracks))
    return Error(ErrorCode::usage, "a point is seen " + std::to_string(out.batches.longest_track) +
                                       " times; with these camera models and lenses, at most " +
                                       std::to_string(Chunks::kLongestTrack) +
                                       " observations and lenses of one point can be solved for");
  out.columns = number_lens_columns(out.tracks, fixed_images(problem, fixed));
  out.coarse_columns = image_columns(out.tracks, out.columns, false);
  return out;
}

namespace {

/// Points that are held couple no images: no pairs. Lists number records with 16 bits, too few for
/// the longest tracks: sums then run over the records in their own order.
ChunkLists lists_for(SolverKind kind, bool points_held, std::uint32_t longest_track) {
  if (points_held)
    return longest_track > Chunks::kLongestTrack ? ChunkLists::none : ChunkLists::diagonal;
  switch (kind) {
    case SolverKind::dense:
    case SolverKind::sparse:
    case SolverKind::explicit_cg:
      return ChunkLists::pairs;
    case SolverKind::blocks:
      return ChunkLists::diagonal;
    case SolverKind::implicit_cg:
      return ChunkLists::none;
  }
  return ChunkLists::none;
}

}  // namespace

void cut_bal_lists(SolverKind kind, bool points_held, Threads& threads, Arrangement& arranged) {
  const Batches& batches = arranged.batches;
  arranged.lists.chunks =
      cut_into_chunks(batches, static_cast<std::uint32_t>(arranged.columns.num_images()),
                      lists_for(kind, points_held, batches.longest_track), threads);
}

}  // namespace sheaf
