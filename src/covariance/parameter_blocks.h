// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "lists/columns.h"
#include "sheaf/problem.h"

namespace sheaf {

/// The camera side of a problem in blocks of up to nine columns: images of no rig, frames,
/// sensors, lenses (of one block or two) and kept points. What is held has no block or no column.
struct ParameterBlocks {
  static constexpr std::uint32_t kNone = 0xffffffff;
  static constexpr std::uint32_t kWidest = 9;

  std::vector<std::uint32_t> image, frame, sensor;  ///< block of each pose, or kNone
  std::vector<std::uint8_t> rigid;  ///< of each image: it is of a frame and a sensor
  struct Lens {
    std::uint32_t block = kNone;         ///< the first of its blocks
    std::vector<std::int8_t> of_column;  ///< parameter of each of its columns
  };
  std::vector<Lens> lenses;
  std::vector<std::uint32_t> kept;        ///< points that are blocks, ascending
  std::vector<std::uint32_t> kept_block;  ///< of each of them, or kNone

  std::vector<std::int32_t> first;  ///< column of each block; and in all
  std::size_t count() const { return first.size() - 1; }
  std::uint32_t width(std::size_t block) const {
    return static_cast<std::uint32_t>(first[block + 1] - first[block]);
  }
  std::int32_t columns() const { return first.back(); }
  /// As orderings and factorisations of the camera matrix read them.
  Columns as_columns() const;
};

ParameterBlocks number_parameters(const Problem& problem, const Fixed& fixed);

}  // namespace sheaf
