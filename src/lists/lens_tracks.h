// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "lists/batches.h"
#include "platform/buffer.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Where the free parameters of a lens stand. A camera block has nine columns, one block for each
/// image: its pose, then three more. Up to three parameters of a lens of one image alone ride
/// there; all others have blocks of the lens's own, one or two of nine columns.
struct LensPlaces {
  static constexpr int kHeld = -1;
  static constexpr int kRiders = 3;

  CameraModel model = CameraModel::bal;
  /// Of each parameter of the model: 0 to 2, a rider; 3 + 9 j + i, column i of the lens's block j.
  std::array<std::int8_t, kMaxCameraParameters> place{};
  std::uint32_t first_block = 0;  ///< blocks of lenses are numbered from the number of images on
  std::uint8_t blocks = 0;
  std::uint8_t riders = 0;
  std::array<std::uint8_t, 2> width{};  ///< columns used of its blocks
  std::uint32_t kind = 0;               ///< lenses of one kind have the same model and places

  bool operator==(const LensPlaces&) const = default;
};

/// Lenses of the observations as Batches arranges them. A point sees each lens through one or
/// several observations; a *slot* of a point is one block of one of the lenses that see it. The
/// slots of a group's eight points stand in rows of eight, as observations stand in batches.
struct LensTracks {
  std::vector<LensPlaces> lenses;
  std::vector<std::uint32_t> image_lens;
  std::vector<LensPlaces> kinds;             ///< one lens of each kind
  std::uint32_t num_blocks = 0;              ///< of images and of lenses
  int most_blocks = 0;                       ///< of any lens
  int most_parameters = 0;                   ///< of any lens's model
  std::array<std::uint8_t, 2> most_width{};  ///< of any lens's first and second block

  Buffer<std::uint32_t> lens;         ///< 8 per batch
  Buffer<std::int32_t> uniform_lens;  ///< per batch: the lens of all lanes, or -1
  Buffer<std::int32_t> uniform_kind;  ///< per batch: the kind of all lanes' lenses, or -1

  std::vector<std::uint64_t> first_slot;  ///< rows of slots before each group's; and in all
  Buffer<std::int32_t> slot_block;        ///< 8 per row: the block; -1: the point has no such slot
  Buffer<std::uint16_t> slot;             ///< 8 per batch: row in the group of the first block
  Buffer<std::int32_t> uniform_slot;      ///< per batch: the row of all lanes, or -1

  std::uint32_t slots_of(std::size_t group) const {
    return static_cast<std::uint32_t>(first_slot[group + 1] - first_slot[group]);
  }
};

/// Rows of slots of any group, at most.
inline std::uint32_t most_group_slots(const LensTracks& tracks) {
  std::uint32_t most = 0;
  for (std::size_t g = 0; g + 1 < tracks.first_slot.size(); ++g)
    most = std::max(most, tracks.slots_of(g));
  return most;
}

/// Blocks of lenses' own.
inline std::size_t lens_blocks(const LensTracks& tracks) {
  return tracks.num_blocks - tracks.image_lens.size();
}

LensTracks arrange_lenses(const Problem& problem, const Fixed& fixed, const Batches& batches,
                          Threads& threads);

}  // namespace sheaf
