// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/photometric_system.h"

#include <utility>

namespace sheaf {

SolverKind PhotometricSystem::kind_of(CameraSolverKind asked, std::int32_t columns) {
  switch (asked) {
    case CameraSolverKind::dense:
      return SolverKind::dense;
    case CameraSolverKind::sparse:
      return SolverKind::sparse;
    case CameraSolverKind::iterative:
    case CameraSolverKind::iterative_explicit:
      return SolverKind::explicit_cg;
    case CameraSolverKind::iterative_implicit:
      return SolverKind::implicit_cg;
    case CameraSolverKind::automatic:
      break;
  }
  return columns <= kMostDenseColumns ? SolverKind::dense : SolverKind::sparse;
}

PhotometricSystem::Parts PhotometricSystem::make(const PatchScene& scene, const PatchState& state,
                                                 const std::vector<Sight>& sights,
                                                 const PhotometricRules& rules,
                                                 const Kernels& kernels, Threads& threads,
                                                 Anchor anchor) {
  auto rows = std::make_unique<PixelRows>(scene, sights, state.points.size() / 3, rules, kernels,
                                          threads, std::move(anchor));
  CameraState cameras;
  for (const Pose& pose : state.poses) cameras.poses.push_back({pose.rotation, pose.translation});
  for (const Brightness& of : state.brightness) cameras.sets.push_back({of.a, of.b});
  const Columns& columns = rows->columns();
  Plan plan{kind_of(rules.solver, columns.count), ""};
  const bool iterates =
      plan.kind == SolverKind::explicit_cg || plan.kind == SolverKind::implicit_cg;
  if (iterates && rows->blocks_are_images() && !rules.points_held)
    plan.clusters = coarse_clusters(rows->batches(), rows->pose_columns(), nullptr, threads);
  Start start{std::move(cameras), CameraColumns::of_brightness(columns), &state.points};
  PixelRows* const pixels = rows.get();
  return {std::move(rows), pixels, std::move(start), {rules.points_held}, std::move(plan)};
}

PhotometricSystem::PhotometricSystem(const PatchScene& scene, const PatchState& state,
                                     const std::vector<Sight>& sights,
                                     const PhotometricRules& rules, const Kernels& kernels,
                                     Threads& threads, Anchor anchor)
    : PhotometricSystem(make(scene, state, sights, rules, kernels, threads, std::move(anchor)),
                        state, kernels, threads) {}

PhotometricSystem::PhotometricSystem(Parts parts, const PatchState& state, const Kernels& kernels,
                                     Threads& threads)
    : PointSystem(std::move(parts.rows), std::move(parts.start),
                  {&parts.pixels->columns(), &parts.pixels->pose_columns()}, parts.rules,
                  parts.plan, kernels, threads),
      pixels_(*parts.pixels),
      kind_(parts.plan.kind),
      initial_points_(state.points) {}

std::vector<double> PhotometricSystem::leaving() const {
  const Buffer<double>& costs = pixels_.leaving();
  return {costs.data(), costs.data() + costs.size()};
}

bool PhotometricSystem::resume(const std::vector<double>& leaving, const HomeHistory& history) {
  return pixels_.take_leaving(leaving) && restore(history);
}

PatchState PhotometricSystem::state() const {
  PatchState out;
  for (const RigidMotion<double>& pose : cameras().poses)
    out.poses.push_back({pose.rotation, pose.translation});
  for (const CameraState::Parameters& set : cameras().sets)
    out.brightness.push_back({set[0], set[1]});
  out.points = initial_points_;
  store_points(out.points);
  return out;
}

}  // namespace sheaf
