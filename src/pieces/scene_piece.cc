// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "pieces/scene_piece.h"

#include <algorithm>
#include <utility>

#include "pieces/piece_fields.h"
#include "solve/checkpoint_file.h"

namespace sheaf {
namespace {

constexpr CheckpointKind kPiece{"SHEAFPIE", "scene", 1, "piece"};

Error wrong(const std::filesystem::path& path, const std::string& what) {
  return Error(ErrorCode::unreadable_input, path.string() + ": " + what);
}

bool within(const std::vector<std::uint32_t>& numbers, std::uint64_t count) {
  return std::all_of(numbers.begin(), numbers.end(), [&](auto n) { return n < count; });
}

bool owned_elsewhere(const ScenePiece& p, const std::vector<Ghost>& ghosts) {
  return std::all_of(ghosts.begin(), ghosts.end(),
                     [&](const Ghost& g) { return g.piece < p.pieces && g.piece != p.number; });
}

/// Whether sizes and numbers fit together, so that nobody after this has to ask.
bool is_sensible(const ScenePiece& p) {
  const Problem& q = p.problem;
  return p.number < p.pieces && q.rigs.sensor_rig.empty() && p.image.size() == q.num_images() &&
         p.camera.size() == q.cameras.size() && p.point.size() == q.num_points() &&
         p.owned_images <= q.num_images() && p.owned_cameras <= q.cameras.size() &&
         p.ghost_images.size() == q.num_images() - p.owned_images &&
         p.ghost_cameras.size() == q.cameras.size() - p.owned_cameras &&
         within(p.image, p.scene_images) && within(p.point, p.scene_points) &&
         owned_elsewhere(p, p.ghost_images) && owned_elsewhere(p, p.ghost_cameras) &&
         validate(q).ok();
}

}  // namespace

std::filesystem::path piece_path(const std::filesystem::path& folder, std::uint32_t number) {
  return folder / ("piece-" + std::to_string(number) + ".bin");
}

Result<void> write_piece(const ScenePiece& piece, const std::filesystem::path& folder) {
  ArchiveWriter a;
  a(piece);
  return write_checkpoint_file(kPiece, a.bytes(), piece_path(folder, piece.number));
}

Result<ScenePiece> read_piece(const std::filesystem::path& folder, std::uint32_t number) {
  const std::filesystem::path path = piece_path(folder, number);
  const Result<std::string> bytes = read_checkpoint_file(kPiece, path.string());
  if (!bytes.ok()) return bytes.error();
  ScenePiece out;
  ArchiveReader a(bytes.value());
  a(out);
  if (!a.complete() || !is_sensible(out))
    return wrong(path, "the piece does not hold what it should");
  if (out.number != number)
    return wrong(path, "found piece " + std::to_string(out.number) + ", expected piece " +
                           std::to_string(number));
  return out;
}

Result<std::uint32_t> count_pieces(const std::filesystem::path& folder) {
  const Result<ScenePiece> first = read_piece(folder, 0);
  if (!first.ok()) return first.error();
  return first.value().pieces;
}

}  // namespace sheaf
