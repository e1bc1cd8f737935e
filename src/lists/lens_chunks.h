// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "lists/block_layout.h"
#include "lists/chunks.h"
#include "lists/columns.h"

namespace sheaf {

/// Chunks of observations through lenses that have blocks of their own. Images are coupled as they
/// are without such lenses; what lenses add is beside it.
struct LensChunks {
  Chunks chunks;  ///< its tiles: those of image pairs, then all others
  /// Pairs with a slot in them, of an image and another's lens or of two lenses; only the chunks'
  /// runs of pairs are set.
  Chunks slots;
  LensTiles tiles;

  /// Local record numbers have 16 bits: whether they suffice for the longest track.
  static bool possible(const Batches& batches, const LensTracks& tracks);
};
/// Which tiles a solver needs: none, those of a lens with itself and its own images (all there are
/// where points are held), or those of all pairs.
enum class LensLists { diagonal, own_lens, pairs };

LensChunks cut_lens_chunks(const Batches& batches, const LensTracks& tracks, LensLists lists,
                           Threads& threads);

/// Nine columns for each block: first the images', then the lenses', which so come to be the border
/// of a matrix in this order.
Columns number_lens_columns(const LensTracks& tracks, const Fixed& fixed);
/// Those of the images alone; without riders their poses'.
Columns image_columns(const LensTracks& tracks, const Columns& columns, bool riders);

}  // namespace sheaf
