// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/parameter_blocks.h"

#include <algorithm>

#include "lists/block_map.h"
#include "scene/rigs.h"
#include "scene/terms.h"

namespace sheaf {
namespace {

std::uint32_t add_block(ParameterBlocks& to, std::int32_t width) {
  to.first.push_back(to.first.back() + width);
  return static_cast<std::uint32_t>(to.first.size() - 2);
}

void number_poses(const Problem& problem, const Fixed& fixed, ParameterBlocks& out) {
  const MovingPoses moving = moving_poses(problem, fixed);
  const std::vector<std::uint8_t> trivial = trivial_frames(problem.rigs);
  const Rigs& rigs = problem.rigs;
  std::vector<std::uint8_t> has_images(rigs.num_frames(), 0);
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    const bool rigid = in_rig(rigs, i) && trivial[rigs.image_frame[i]] == 0;
    out.rigid.push_back(rigid ? 1 : 0);
    if (rigid) has_images[rigs.image_frame[i]] = 1;
    out.image.push_back(!rigid && moving.images[i] != 0 ? add_block(out, 6)
                                                        : ParameterBlocks::kNone);
  }
  for (std::size_t f = 0; f < rigs.num_frames(); ++f)
    out.frame.push_back(has_images[f] != 0 && moving.frames[f] != 0 ? add_block(out, 6)
                                                                    : ParameterBlocks::kNone);
  for (std::size_t s = 0; s < rigs.num_sensors(); ++s)
    out.sensor.push_back(moving.sensors[s] != 0 ? add_block(out, 6) : ParameterBlocks::kNone);
}

void number_lenses(const Problem& problem, const Fixed& fixed, ParameterBlocks& out) {
  const std::vector<ParameterSet> held = held_parameters(problem, fixed);
  std::vector<std::uint8_t> used(problem.cameras.size(), 0);
  for (const std::uint32_t c : problem.image_camera) used[c] = 1;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    ParameterBlocks::Lens& lens = out.lenses.emplace_back();
    for (std::size_t p = 0; used[c] != 0 && p < parameter_count(problem.cameras[c].model); ++p)
      if ((held[c] >> p & 1) == 0) lens.of_column.push_back(static_cast<std::int8_t>(p));
    const auto columns = static_cast<std::int32_t>(lens.of_column.size());
    constexpr auto kWidest = static_cast<std::int32_t>(ParameterBlocks::kWidest);
    for (std::int32_t at = 0; at < columns; at += kWidest) {
      const std::uint32_t block = add_block(out, std::min(kWidest, columns - at));
      if (at == 0) lens.block = block;
    }
  }
}

}  // namespace

Columns ParameterBlocks::as_columns() const {
  Columns out;
  out.of_image.assign(9 * count(), Columns::kFixed);
  for (std::size_t b = 0; b < count(); ++b)
    for (std::uint32_t k = 0; k < width(b); ++k)
      out.of_image[9 * b + k] = first[b] + static_cast<std::int32_t>(k);
  out.count = columns();
  return out;
}

ParameterBlocks number_parameters(const Problem& problem, const Fixed& fixed) {
  ParameterBlocks out;
  out.first.push_back(0);
  number_poses(problem, fixed, out);
  number_lenses(problem, fixed, out);
  out.kept = kept_points(problem.terms);
  for (std::size_t k = 0; k < out.kept.size(); ++k)
    out.kept_block.push_back(fixed.points ? ParameterBlocks::kNone : add_block(out, 3));
  return out;
}

}  // namespace sheaf
