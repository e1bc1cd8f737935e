// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "piece_folder.h"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "pieces/split_scene.h"
#include "sheaf/error.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

bool is_piece(const fs::path& path) {
  const std::string name = path.filename().string();
  return name.starts_with("piece-") && name.ends_with(".bin");
}

}  // namespace

void make_piece_folder(const std::string& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed)
    throw Error(ErrorCode::unwritable_output,
                fmt::format("{}: the folder cannot be made: {}", folder, failed.message()));
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (!is_piece(entry.path()))
      throw Error(ErrorCode::usage,
                  fmt::format("{}: found {}, expected an empty folder or one of pieces alone",
                              folder, entry.path().filename().string()));
}

void remove_other_pieces(const std::string& folder, std::uint32_t pieces) {
  for (std::uint32_t k = pieces; fs::remove(piece_path(folder, k)); ++k) continue;
}

std::uint32_t join_pieces(const std::string& folder, Problem& scene) {
  const std::string digest = digest_of_scene(scene);
  std::uint32_t count = 1;
  for (std::uint32_t k = 0; k < count; ++k) {
    const ScenePiece piece = read_piece(folder, k).value();
    if (k == 0) count = piece.pieces;
    join_piece(piece, scene).value();
    if (piece.scene != digest || piece.pieces != count)
      throw Error(ErrorCode::usage,
                  fmt::format("{}: is a piece of another scene, or of another split of this one",
                              piece_path(folder, k).string()));
  }
  return count;
}

}  // namespace sheaf
