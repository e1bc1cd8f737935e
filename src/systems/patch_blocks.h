// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/rigid_motion.h"
#include "platform/buffer.h"
#include "reduced/camera_solver.h"
#include "rows/photometric.h"

namespace sheaf {

/// The camera blocks of photometric rows. Points in the world: a block is an image. Points on the
/// rays of a host: a block is a pair of images, because such a patch depends on nothing but the
/// motion from host to target and on the brightness between them. Elimination then works on the
/// pairs' own eight columns, and its sums are folded to the images' columns at the end:
///   x_pair = Y x_target + Z x_host,
///   Y = [I, 0; 0, d(alpha, beta)/d(a, b)_target],  Z = [-Ad(T), 0; 0, d(alpha, beta)/d(a,
///   b)_host].
class PatchBlocks {
 public:
  using Map = std::array<double, 64>;  ///< 8 x 8, row-major
  struct Maps {
    Map target, host;  ///< Y, Z
  };

  /// Of these sights, whose blocks are numbered in the order of (target, host).
  PatchBlocks(const PatchScene& scene, const std::vector<Sight>& sights);

  std::uint32_t count() const { return static_cast<std::uint32_t>(targets_.size()); }
  std::uint32_t of(const PatchScene& scene, const Sight& sight) const;
  const std::vector<std::uint32_t>& targets() const { return targets_; }
  bool are_pairs() const { return !hosts_.empty(); }

  /// Pairs of images that the blocks couple, each row > column, for the camera solver.
  std::vector<Tile> image_tiles(const std::vector<Tile>& block_tiles) const;

  using Poses = std::vector<RigidMotion<double>>;
  /// kViewRecord doubles per block.
  void write_views(const Poses& poses, const std::vector<Brightness>& brightness,
                   double* views) const;

  /// Sums over blocks (layout of ReducedSums) to sums over images; tile_of: number of the image
  /// tile (row, column) by row * images + column.
  struct Fold {
    const std::vector<Tile>* block_tiles;
    const double *tiles, *diagonal;
    const std::vector<std::int64_t>* tile_of;
    double *image_tiles, *image_diagonal;
  };
  void fold(const Poses& poses, const std::vector<Brightness>& brightness, std::size_t images,
            const Fold& fold) const;

  /// The blocks' steps from the images': kBlockVector doubles each.
  void step(const Poses& poses, const std::vector<Brightness>& brightness,
            const double* image_steps, double* block_steps) const;

  /// Of all blocks, for many vectors at one state; empty where blocks are images.
  std::vector<Maps> all_maps(const Poses& poses, const std::vector<Brightness>& brightness) const;
  /// Blocks' vectors from images' and back: x_pair = Y x_target + Z x_host, and its transpose,
  /// which is added. kBlockVector doubles each.
  void to_blocks(const std::vector<Maps>& maps, const double* images, double* blocks) const;
  void add_to_images(const std::vector<Maps>& maps, const double* blocks, double* images) const;

 private:
  Maps maps_of(std::size_t block, const Poses& poses,
               const std::vector<Brightness>& brightness) const;

  std::size_t images_;
  std::vector<std::uint32_t> targets_, hosts_;
  std::vector<std::uint32_t> number_;  ///< by target * images + host
};

}  // namespace sheaf
