// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// What a piece has of something that another piece owns.
struct Ghost {
  std::uint32_t piece = 0;  ///< the owner
  std::uint32_t index = 0;  ///< there
};

/// One of the pieces that a scene is split into: points of its own with all their observations, and
/// the images that these need. Every image and every lens has one owner; elsewhere it is a ghost,
/// whose state and step are the owner's. Pieces, not the machines that work at them, fix the order
/// of all sums.
struct ScenePiece {
  std::uint32_t number = 0, pieces = 0;
  std::string scene;  ///< digest of what was split: all pieces have the same
  std::uint64_t scene_images = 0, scene_points = 0, scene_observations = 0;
  /// Images, lenses: those it owns first, then ghosts.
  Problem problem;
  std::uint32_t owned_images = 0, owned_cameras = 0;
  std::vector<std::uint32_t> image, camera, point;  ///< numbers in the scene
  std::vector<Ghost> ghost_images, ghost_cameras;
};

/// The name of a piece's file in its folder.
std::filesystem::path piece_path(const std::filesystem::path& folder, std::uint32_t number);

/// Written beside and renamed. Errors: unwritable_output.
Result<void> write_piece(const ScenePiece& piece, const std::filesystem::path& folder);

/// Errors: unreadable_input where the file is missing, cut off, damaged or another piece's, naming
/// it.
Result<ScenePiece> read_piece(const std::filesystem::path& folder, std::uint32_t number);

/// How many pieces a folder holds, as its first one says. Errors: those of read_piece.
Result<std::uint32_t> count_pieces(const std::filesystem::path& folder);

}  // namespace sheaf
