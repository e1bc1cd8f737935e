// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "lists/batches.h"
#include "lists/block_map.h"
#include "lists/columns.h"
#include "lists/lens_chunks.h"
#include "lists/lens_tracks.h"
#include "sheaf/error.h"
#include "systems/plan.h"

namespace sheaf {

/// How the observations of a problem are laid out for points to be eliminated: a function of which
/// image sees which point through which lens, of what is fixed and of the camera solver. It holds
/// no part of the state; what it holds of measurements is Batches::xy.
struct Arrangement {
  Batches batches;
  LensTracks tracks;       ///< of lenses of any model; empty where the rows are BAL's
  Columns columns;         ///< of the images' blocks, and of the lenses' own blocks behind them
  Columns coarse_columns;  ///< of lens rows the images' poses alone: what the coarse space moves
  LensChunks lists;        ///< of BAL rows the chunks alone
  std::optional<BlockMap> map;  ///< of the rows' blocks to what is solved for, where these differ
  Columns row_columns;          ///< with it: `columns`, and those of kept points
  /// Columns that are solved for, and those that the coarse space moves.
  const Columns& solved_columns() const { return map ? map->columns : columns; }
  const Columns& solved_coarse_columns() const {
    return map ? map->coarse_columns : coarse_columns.of_image.empty() ? columns : coarse_columns;
  }
};

/// Of a problem with lenses of any model, before lists are cut. Errors: usage, a track is too long.
Result<Arrangement> arrange_with_lenses(const Problem& problem, const Fixed& fixed,
                                        const std::vector<std::uint8_t>& skip, Threads& threads);

/// Cuts the lists that this solver needs of BAL rows.
void cut_bal_lists(SolverKind kind, bool points_held, Threads& threads, Arrangement& arranged);

}  // namespace sheaf
