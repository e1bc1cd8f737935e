// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "pieces/scene_piece.h"

namespace sheaf {

/// What a split came to.
struct SplitSummary {
  struct Piece {
    std::uint64_t images = 0, ghosts = 0, points = 0, observations = 0;
  };
  std::vector<Piece> pieces;
  /// Most observations of a piece over their mean; 1 is even.
  double imbalance = 1;
};

/// The piece of each image: METIS's k-way partition of the camera graph, whose edges count the
/// points that two images share and whose vertices count observations; images that see nothing are
/// dealt out evenly. A function of the problem alone. Errors: usage for fewer than 1 piece or more
/// pieces than images.
Result<std::vector<std::uint32_t>> partition_images(const Problem& problem, std::uint32_t pieces);

/// Cuts the scene by the images' pieces and hands out one piece after the other, in their order; a
/// point goes to the piece that owns most of the images that see it. Errors: usage for rigs, and
/// for terms between images; what `take` returns.
Result<SplitSummary> split_scene(const Problem& problem,
                                 const std::vector<std::uint32_t>& piece_of_image,
                                 std::uint32_t pieces,
                                 const std::function<Result<void>(ScenePiece)>& take);

/// Writes the owned state of a piece into the scene that was split. Errors: usage where it is a
/// piece of another scene.
Result<void> join_piece(const ScenePiece& piece, Problem& scene);

/// Of the scene's structure and measurements; states do not count.
std::string digest_of_scene(const Problem& problem);

}  // namespace sheaf
