// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/block_map.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "scene/rigs.h"

namespace sheaf {
namespace {

constexpr std::uint8_t kPose = 6, kLens = 3;

/// Images whose pose is of a frame and a sensor: 1 for each.
std::vector<std::uint8_t> rigid_images(const Rigs& rigs, std::size_t images) {
  std::vector<std::uint8_t> out(images, 0);
  if (rigs.empty()) return out;
  const std::vector<std::uint8_t> trivial = trivial_frames(rigs);
  for (std::size_t i = 0; i < images; ++i)
    out[i] = in_rig(rigs, i) && trivial[rigs.image_frame[i]] == 0;
  return out;
}

/// Numbers solved blocks and their columns.
class Numbering {
 public:
  explicit Numbering(BlockMap& map) : map_(map) {}

  std::uint32_t add_block() {
    map_.columns.of_image.resize(map_.columns.of_image.size() + 9, Columns::kFixed);
    return static_cast<std::uint32_t>(map_.columns.num_images() - 1);
  }
  std::uint32_t add_pose(bool moves) {
    if (!moves) return BlockMap::kNone;
    const std::uint32_t block = add_block();
    for (std::size_t k = 0; k < kPose; ++k) number(block, k);
    return block;
  }
  /// The block's column k, numbered if it is new.
  std::int32_t number(std::uint32_t block, std::size_t k) {
    std::int32_t& column = map_.columns.of_image[9 * std::size_t(block) + k];
    if (column == Columns::kFixed) column = map_.columns.count++;
    return column;
  }

 private:
  BlockMap& map_;
};

/// Builds a map, block of rows by block of rows.
class MapBuilder {
 public:
  MapBuilder(const Problem& problem, const Columns& rows, bool restated, BlockMap& map)
      : restated_(restated),
        rigs_(problem.rigs),
        rows_(rows),
        map_(map),
        numbers_(map),
        rigid_(rigid_images(problem.rigs, problem.num_images())) {
    map.solved_column.assign(static_cast<std::size_t>(rows.count), Columns::kFixed);
    for (std::size_t i = 0; i < rigid_.size(); ++i) ++users_[lens_columns(i)];
  }

  /// First images and frames, then sensors, then lenses: these come to be the border of a matrix in
  /// this order.
  void number_poses(const MovingPoses& moving) {
    map_.image_block.assign(rigid_.size(), BlockMap::kNone);
    map_.frame_block.assign(rigs_.num_frames(), BlockMap::kNone);
    for (std::size_t i = 0; i < rigid_.size(); ++i) {
      if (rigid_[i] == 0) {
        map_.image_block[i] = numbers_.add_pose(moving.images[i] != 0);
        if (map_.image_block[i] != BlockMap::kNone && rides(i)) number_lens(map_.image_block[i], i);
        continue;
      }
      map_.moved_images.push_back(static_cast<std::uint32_t>(i));
      const std::uint32_t frame = rigs_.image_frame[i];
      if (map_.frame_block[frame] == BlockMap::kNone)
        map_.frame_block[frame] = numbers_.add_pose(moving.frames[frame] != 0);
    }
    coarse_blocks_ = map_.columns.num_images();
    for (std::size_t s = 0; s < rigs_.num_sensors(); ++s)
      map_.sensor_block.push_back(numbers_.add_pose(moving.sensors[s] != 0));
  }

  void add_images() {
    for (std::size_t i = 0; i < rigid_.size(); ++i) {
      map_.first_part.push_back(static_cast<std::uint32_t>(map_.parts.size()));
      if (rigid_[i] != 0) {
        const std::uint32_t sensor = rigs_.image_sensor[i];
        const bool identity = !restated_ && rigs_.is_reference[sensor] != 0;
        add(map_.frame_block[rigs_.image_frame[i]], 0, kPose,
            identity ? BlockPart::kIdentity : static_cast<std::int32_t>(sensor));
        add(map_.sensor_block[sensor], 0, kPose);
      } else if (map_.image_block[i] != BlockMap::kNone) {
        add(map_.image_block[i], 0, rides(i) ? kPose + kLens : kPose);
        join(map_.image_block[i], i, 0, kPose);
        if (rides(i)) {
          join(map_.image_block[i], i, kPose, kLens);
          continue;
        }
      }
      add_lens_of(i);
    }
  }

  void add_other_blocks() {
    for (std::size_t b = rigid_.size(); b < rows_.num_images(); ++b) {
      map_.first_part.push_back(static_cast<std::uint32_t>(map_.parts.size()));
      const std::uint32_t block = numbers_.add_block();
      add(block, 0, kPose + kLens);
      for (std::size_t k = 0; k < 9; ++k) take(block, b, k);
    }
    map_.first_part.push_back(static_cast<std::uint32_t>(map_.parts.size()));
    map_.coarse_columns = map_.columns;
    map_.first_kept = static_cast<std::uint32_t>(map_.columns.num_images()) - map_.kept;
    for (std::size_t b = 0; b < map_.first_kept; ++b)
      for (std::size_t k = b < coarse_blocks_ ? kPose : 0; k < 9; ++k)
        map_.coarse_columns.of_image[9 * b + k] = Columns::kFixed;
  }

 private:
  using LensColumns = std::array<std::int32_t, 3>;

  LensColumns lens_columns(std::size_t image) const {
    const std::int32_t* c = rows_.image(image) + kPose;
    return {c[0], c[1], c[2]};
  }
  static bool none(const LensColumns& lens) {
    return std::all_of(lens.begin(), lens.end(), [](std::int32_t c) { return c < 0; });
  }
  /// Whether the columns of an image's lens are in one block with its pose.
  bool rides(std::size_t image) const {
    const LensColumns lens = lens_columns(image);
    return rigid_[image] == 0 && !none(lens) && users_.at(lens) == 1;
  }
  void add(std::uint32_t block, std::uint8_t first, std::uint8_t count,
           std::int32_t sensor = BlockPart::kIdentity) {
    if (block != BlockMap::kNone) map_.parts.push_back({block, first, count, sensor});
  }
  /// The block's column k is the rows' in the block `from`, where that is free.
  void take(std::uint32_t block, std::size_t from, std::size_t k) {
    const std::int32_t column = rows_.image(from)[k];
    if (column >= 0)
      map_.solved_column[static_cast<std::size_t>(column)] = numbers_.number(block, k);
  }
  void join(std::uint32_t block, std::size_t from, std::size_t first, std::size_t count) {
    for (std::size_t k = first; k < first + count; ++k) take(block, from, k);
  }
  void number_lens(std::uint32_t block, std::size_t image) { join(block, image, kPose, kLens); }
  void add_lens_of(std::size_t image) {
    const LensColumns lens = lens_columns(image);
    if (none(lens)) return;
    const auto [known, is_new] = lens_block_.try_emplace(lens, 0);
    if (is_new) known->second = numbers_.add_block();
    number_lens(known->second, image);
    add(known->second, kPose, kLens);
  }

  const bool restated_;
  const Rigs& rigs_;
  const Columns& rows_;
  BlockMap& map_;
  Numbering numbers_;
  const std::vector<std::uint8_t> rigid_;
  std::map<LensColumns, std::uint32_t> users_, lens_block_;
  std::size_t coarse_blocks_ = 0;
};

}  // namespace

MovingPoses moving_poses(const Problem& problem, const Fixed& fixed) {
  const Rigs& rigs = problem.rigs;
  MovingPoses out;
  out.images.assign(problem.num_images(), !fixed.poses);
  out.frames.assign(rigs.num_frames(), !fixed.poses);
  out.sensors.assign(rigs.num_sensors(), !fixed.sensors);
  std::vector<std::uint8_t> has_reference(rigs.count, 0);
  for (std::size_t i = 0; i < rigs.image_sensor.size(); ++i)
    if (in_rig(rigs, i) && rigs.is_reference[rigs.image_sensor[i]] != 0)
      has_reference[rigs.frame_rig[rigs.image_frame[i]]] = 1;
  for (std::size_t s = 0; s < rigs.num_sensors(); ++s)
    if (rigs.is_reference[s] != 0 || has_reference[rigs.sensor_rig[s]] == 0) out.sensors[s] = 0;
  for (const std::uint32_t f : fixed.frame_ids) out.frames[f] = 0;
  for (const std::uint32_t s : fixed.sensor_ids) out.sensors[s] = 0;
  for (const std::uint32_t i : fixed.pose_ids) {
    out.images[i] = 0;
    if (!in_rig(rigs, i)) continue;
    out.frames[rigs.image_frame[i]] = 0;
    out.sensors[rigs.image_sensor[i]] = 0;
  }
  for (std::size_t i = 0; i < rigs.image_frame.size(); ++i)
    if (in_rig(rigs, i)) out.images[i] = out.images[i] && out.frames[rigs.image_frame[i]];
  return out;
}

Fixed fixed_images(const Problem& problem, const Fixed& fixed) {
  const MovingPoses moving = moving_poses(problem, fixed);
  const std::vector<std::uint8_t> rigid = rigid_images(problem.rigs, problem.num_images());
  Fixed out = fixed;
  out.poses = false;
  out.pose_ids.clear();
  for (std::uint32_t i = 0; i < problem.num_images(); ++i) {
    const bool moves = rigid[i] != 0 ? moving.frames[problem.rigs.image_frame[i]] != 0 ||
                                           moving.sensors[problem.rigs.image_sensor[i]] != 0
                                     : moving.images[i] != 0;
    if (!moves) out.pose_ids.push_back(i);
  }
  return out;
}

Columns with_kept_points(const Columns& columns, std::uint32_t count, bool held) {
  Columns out = columns;
  for (std::uint32_t j = 0; j < count; ++j)
    for (int k = 0; k < 9; ++k)
      out.of_image.push_back(k < 3 && !held ? out.count++ : Columns::kFixed);
  return out;
}

BlockMap map_blocks(const Problem& problem, const Fixed& fixed, const Columns& columns,
                    std::uint32_t kept, bool restated) {
  BlockMap map;
  map.kept = kept;
  MapBuilder builder(problem, columns, restated, map);
  builder.number_poses(moving_poses(problem, fixed));
  builder.add_images();
  builder.add_other_blocks();
  return map;
}

std::vector<std::uint32_t> BlockMap::coarse_block() const {
  std::vector<std::uint32_t> out = image_block;
  for (const std::uint32_t i : moved_images)
    for (const BlockPart* part = begin(i); part != end(i); ++part)
      if (coarse_columns.image(part->block)[0] >= 0) out[i] = part->block;
  return out;
}

std::vector<Tile> BlockMap::solved_tiles(const std::vector<Tile>& of_rows) const {
  std::vector<std::uint64_t> keys;
  const auto couple = [&](const BlockPart& a, const BlockPart& b) {
    if (a.block != b.block)
      keys.push_back(std::uint64_t(std::max(a.block, b.block)) << 32 | std::min(a.block, b.block));
  };
  for (std::size_t i = 0; i < row_blocks(); ++i)
    for (const BlockPart* a = begin(i); a != end(i); ++a)
      for (const BlockPart* b = begin(i); b != a; ++b) couple(*a, *b);
  const auto couple_tile = [&](const Tile& tile) {
    for (const BlockPart* a = begin(tile.row); a != end(tile.row); ++a)
      for (const BlockPart* b = begin(tile.column); b != end(tile.column); ++b) couple(*a, *b);
  };
  for (const Tile& tile : of_rows) couple_tile(tile);
  for (const Tile& tile : term_tiles) couple_tile(tile);
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  std::vector<Tile> out;
  out.reserve(keys.size());
  for (const std::uint64_t key : keys)
    out.push_back({static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)});
  return out;
}

}  // namespace sheaf
