// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <utility>
#include <vector>

#include "scene/renumber.h"
#include "sheaf/solver.h"
#include "solve/leaving_rows.h"

namespace sheaf {
namespace {

/// New numbers of what stays, in its order.
std::vector<std::uint32_t> numbers_of(const std::vector<std::uint8_t>& leaves) {
  std::vector<std::uint32_t> out;
  std::uint32_t next = 0;
  for (const std::uint8_t gone : leaves) out.push_back(gone != 0 ? Slide::kGone : next++);
  return out;
}

void take_out(const LeavingBlocks& leaving, const NewNumbers& to, Problem& p) {
  std::vector<bool> observation_stays(p.num_observations());
  for (std::size_t i = 0; i < observation_stays.size(); ++i)
    observation_stays[i] = !leaving.takes(p, i);
  const auto observation = [&](std::size_t i) { return bool(observation_stays[i]); };
  const auto image = [&](std::size_t i) { return leaving.image[i] == 0; };
  shorten(p.observation_image, 1, observation);
  shorten(p.observation_point, 1, observation);
  shorten(p.observation_xy, 2, observation);
  shorten(p.observation_sigma, 1, observation);
  shorten(p.poses, 1, image);
  shorten(p.image_camera, 1, image);
  shorten(p.bal_angle_axis, 3, image);
  shorten(p.rigs.image_frame, 1, image);
  shorten(p.rigs.image_sensor, 1, image);
  shorten(p.cameras, 1, [&](std::size_t c) { return leaving.camera[c] == 0; });
  shorten(p.points, 3, [&](std::size_t j) { return leaving.point[j] == 0; });
  for (std::uint32_t& i : p.observation_image) i = to.image[i];
  for (std::uint32_t& j : p.observation_point) j = to.point[j];
  for (std::uint32_t& c : p.image_camera) c = to.camera[c];
  p.metadata = nullptr;
}

}  // namespace

Result<Slide> slide(Problem& problem, const std::vector<std::uint32_t>& images,
                    const std::vector<std::uint32_t>& points, const MarginaliseOptions& options) {
  Result<GaussianPrior> prior = marginalise(problem, images, points, options);
  if (!prior.ok()) return prior.error();
  const LeavingBlocks leaving = leaving_of(problem, images, points).value();
  NewNumbers to{numbers_of(leaving.image), numbers_of(leaving.camera), numbers_of(leaving.point)};
  take_out(leaving, to, problem);
  renumber(to, problem.terms);
  if (!prior.value().blocks.empty()) {
    renumber(to, prior.value());
    problem.terms.gaussians.push_back(std::move(prior).value());
  }
  return Slide{std::move(to.image), std::move(to.camera), std::move(to.point)};
}

}  // namespace sheaf
