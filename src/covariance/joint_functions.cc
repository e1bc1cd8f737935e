// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/joint_functions.h"

#include <map>

namespace sheaf {
namespace {

/// The lens's free columns, and behind them the mean motion of the images that see through it.
LinearFunction function_of_lens_and_motion(const Problem& problem, const NormalEquations& equations,
                                           std::size_t camera,
                                           const std::vector<std::uint8_t>& sees) {
  const ParameterBlocks& blocks = equations.blocks();
  LinearFunction out = function_of_lens(blocks, camera);
  const std::size_t free = out.rows;
  out.rows += 6;
  for (LinearPart& part : out.parts) part.by.resize(out.rows * blocks.width(part.block), 0);
  std::map<std::uint32_t, std::array<double, 36>> moved;
  double images = 0;
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    if (problem.image_camera[i] != camera || sees[i] == 0) continue;
    ++images;
    for (const ObservationRows::PosePart& pose : equations.rows().pose_parts(i))
      for (std::size_t k = 0; k < 36; ++k) moved[pose.block][k] += pose.by_image[k];
  }
  for (const auto& [block, by] : moved) {
    LinearPart& part = out.parts.emplace_back(LinearPart{block, {}});
    part.by.assign(out.rows * 6, 0);
    for (std::size_t k = 0; k < 36; ++k) part.by[6 * free + k] = by[k] / images;
  }
  return out;
}

}  // namespace

LinearFunction function_of_image(const NormalEquations& equations, std::size_t image) {
  LinearFunction out;
  out.rows = 6;
  for (const ObservationRows::PosePart& pose : equations.rows().pose_parts(image))
    out.parts.push_back({pose.block, {pose.by_image.begin(), pose.by_image.end()}});
  return out;
}

LinearFunction function_of_lens(const ParameterBlocks& blocks, std::size_t camera) {
  const ParameterBlocks::Lens& lens = blocks.lenses[camera];
  LinearFunction out;
  out.rows = lens.of_column.size();
  for (std::size_t at = 0; at < out.rows; at += ParameterBlocks::kWidest) {
    const auto block = lens.block + static_cast<std::uint32_t>(at / ParameterBlocks::kWidest);
    const std::size_t width = blocks.width(block);
    std::vector<double> by(out.rows * width, 0);
    for (std::size_t k = 0; k < width; ++k) by[width * (at + k) + k] = 1;
    out.parts.push_back({block, std::move(by)});
  }
  return out;
}

JointFunctions joint_functions(const Problem& problem, const NormalEquations& equations,
                               const CovarianceOptions& options) {
  JointFunctions out;
  if (options.lens_motions) {
    std::vector<std::uint8_t> sees(problem.num_images(), 0);
    for (const std::uint32_t image : problem.observation_image) sees[image] = 1;
    std::vector<std::uint8_t> used(problem.cameras.size(), 0);
    for (std::size_t i = 0; i < problem.num_images(); ++i)
      if (sees[i] != 0) used[problem.image_camera[i]] = 1;
    out.of_lens.assign(problem.cameras.size(), JointFunctions::kNone);
    for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
      if (used[c] == 0) continue;
      out.of_lens[c] = out.functions.size();
      out.functions.push_back(function_of_lens_and_motion(problem, equations, c, sees));
    }
  }
  std::map<std::uint32_t, std::size_t> of_image;
  for (const std::array<std::uint32_t, 2>& pair : options.image_pairs) {
    std::array<std::size_t, 2>& of = out.of_pair.emplace_back();
    for (std::size_t k = 0; k < 2; ++k) {
      const auto [at, is_new] = of_image.try_emplace(pair[k], out.functions.size());
      if (is_new) out.functions.push_back(function_of_image(equations, pair[k]));
      of[k] = at->second;
    }
  }
  return out;
}

}  // namespace sheaf
