// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/leaving_rows.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "geometry/motion_log.h"
#include "scene/terms.h"

namespace sheaf {
namespace {

using Kind = GaussianPrior::Block::Kind;

Result<void> mark(const char* what, const std::vector<std::uint32_t>& indices,
                  std::vector<std::uint8_t>& marked) {
  for (const std::uint32_t i : indices) {
    if (i >= marked.size())
      return Error(ErrorCode::usage, std::string(what) + " " + std::to_string(i) +
                                         " is to leave, expected one below " +
                                         std::to_string(marked.size()));
    marked[i] = 1;
  }
  return {};
}

/// Points that some row is of, ascending.
std::vector<std::uint32_t> points_of(const Problem& problem, const LeavingBlocks& leaving) {
  std::vector<std::uint32_t> points = kept_points(problem.terms);
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    if (leaving.takes(problem, i)) points.push_back(problem.observation_point[i]);
  for (const PointPrior& prior : problem.terms.points)
    if (leaving.point[prior.point] != 0) points.push_back(prior.point);
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

std::vector<double> state_of(const Pose& pose) {
  std::vector<double> out(pose.rotation.begin(), pose.rotation.end());
  out.insert(out.end(), pose.translation.begin(), pose.translation.end());
  return out;
}

RigidMotion<double> motion_of(const std::vector<double>& state) {
  return {{state[0], state[1], state[2], state[3]}, {state[4], state[5], state[6]}};
}

LeavingRows::Block& add_block(Kind kind, std::uint32_t index, std::vector<double> state,
                              bool leaves, LeavingRows& out) {
  LeavingRows::Block& block = out.blocks.emplace_back();
  block.of.kind = kind;
  block.of.index = index;
  block.of.state = std::move(state);
  block.leaves = leaves;
  return block;
}

/// Every block at the problem's state.
void add_blocks(const Problem& problem, const LeavingBlocks& leaving, const Fixed& fixed,
                const std::vector<std::uint32_t>& points, LeavingRows& out) {
  const std::vector<ParameterSet> held = held_parameters(problem, fixed);
  for (std::uint32_t i = 0; i < problem.num_images(); ++i)
    add_block(Kind::pose, i, state_of(problem.poses[i]), leaving.image[i] != 0, out)
        .held.assign(6, fixed.poses);
  for (const std::uint32_t i : fixed.pose_ids)
    if (i < problem.num_images()) out.blocks[i].held.assign(6, true);
  for (std::uint32_t c = 0; c < problem.cameras.size(); ++c) {
    const double* values = problem.cameras[c].parameters.data();
    const std::size_t count = parameter_count(problem.cameras[c].model);
    LeavingRows::Block& block =
        add_block(Kind::camera, c, {values, values + count}, leaving.camera[c] != 0, out);
    for (std::size_t k = 0; k < count; ++k) block.held.push_back((held[c] >> k & 1) != 0);
  }
  for (const std::uint32_t p : points) {
    const double* X = &problem.points[3 * std::size_t(p)];
    add_block(Kind::point, p, {X, X + 3}, leaving.point[p] != 0, out).held.assign(3, fixed.points);
  }
}

void put(const GaussianPrior::Block& block, std::size_t kept, CameraState& state) {
  if (block.kind == Kind::pose) state.poses[block.index] = motion_of(block.state);
  if (block.kind == Kind::camera)
    std::copy(block.state.begin(), block.state.end(), state.sets[block.index].begin());
  if (block.kind == Kind::point) std::copy_n(block.state.begin(), 3, state.kept[kept].begin());
}

/// The difference d of a block from its state, as GaussianPrior has it.
std::vector<double> difference(const GaussianPrior::Block& from, const CameraState& at,
                               std::size_t kept) {
  if (from.kind == Kind::pose) {
    const auto d = log_of(composed(at.poses[from.index], inverse(motion_of(from.state))));
    return {d.begin(), d.end()};
  }
  std::vector<double> d(from.state.size());
  for (std::size_t k = 0; k < d.size(); ++k)
    d[k] = (from.kind == Kind::camera ? at.sets[from.index][k] : at.kept[kept][k]) - from.state[k];
  return d;
}

/// States that Gaussians name stay: the first one that names a block has it.
void keep_first_estimates(const Problem& problem, const std::vector<std::uint32_t>& points,
                          LeavingRows& out) {
  const std::size_t first_point = problem.num_images() + problem.cameras.size();
  std::vector<bool> known(out.blocks.size(), false);
  for (const GaussianPrior& prior : problem.terms.gaussians)
    for (const GaussianPrior::Block& block : prior.blocks) {
      std::size_t at = block.index;
      if (block.kind == Kind::camera) at += problem.num_images();
      if (block.kind == Kind::point)
        at = first_point +
             static_cast<std::size_t>(std::lower_bound(points.begin(), points.end(), block.index) -
                                      points.begin());
      if (known[at]) continue;
      known[at] = true;
      out.blocks[at].of.state = block.state;
    }
  for (std::size_t at = 0; at < out.blocks.size(); ++at) {
    LeavingRows::Block& block = out.blocks[at];
    const std::size_t kept = at - std::min(at, first_point);
    block.step = difference(block.of, out.now, kept);
    put(block.of, kept, out.first_estimates);
  }
}

}  // namespace

Result<LeavingBlocks> leaving_of(const Problem& problem, const std::vector<std::uint32_t>& images,
                                 const std::vector<std::uint32_t>& points) {
  LeavingBlocks out;
  out.image.assign(problem.num_images(), 0);
  out.point.assign(problem.num_points(), 0);
  if (Result<void> done = mark("image", images, out.image); !done.ok()) return done.error();
  if (Result<void> done = mark("point", points, out.point); !done.ok()) return done.error();
  std::vector<std::uint8_t> has_image(problem.cameras.size(), 0), stays(has_image);
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    has_image[problem.image_camera[i]] = 1;
    if (out.image[i] == 0) stays[problem.image_camera[i]] = 1;
  }
  for (std::size_t c = 0; c < stays.size(); ++c)
    out.camera.push_back(has_image[c] != 0 && stays[c] == 0);
  return out;
}

LeavingRows leaving_rows(const Problem& problem, const LeavingBlocks& leaving, const Fixed& fixed) {
  LeavingRows out;
  const std::vector<std::uint32_t> points = points_of(problem, leaving);
  add_blocks(problem, leaving, fixed, points, out);
  out.now = camera_state(problem);
  for (const std::uint32_t p : points) {
    const double* X = &problem.points[3 * std::size_t(p)];
    out.now.kept.push_back({X[0], X[1], X[2]});
  }
  out.first_estimates = out.now;
  keep_first_estimates(problem, points, out);
  std::vector<std::uint8_t> skip(problem.num_observations(), 0);
  for (std::size_t i = 0; i < skip.size(); ++i) skip[i] = !leaving.takes(problem, i);
  for (auto& term :
       make_terms(problem, TermPlaces::of_parameters(problem), points, skip, nullptr)) {
    const auto& places = term->places();
    const bool of_leaving = std::any_of(places.begin(), places.end(), [&](const TermPlace& place) {
      return out.blocks[place.block].leaves;
    });
    if (!of_leaving) continue;
    for (const TermPlace& place : places) out.blocks[place.block].touched = true;
    out.terms.push_back(std::move(term));
  }
  return out;
}

void LeavingRows::linearize(const Term& term, const ScaledLoss& of_observations,
                            Linear& out) const {
  const std::vector<TermPlace>& places = term.places();
  out.b.resize(term.rows());
  out.J.resize(term.rows() * places.size());
  term.evaluate(first_estimates, out.b.data(), out.J.data());
  term.evaluate(now, out.b.data(), nullptr);
  double s = 0;
  for (const double x : out.b) s += x * x;
  const ScaledLoss loss = term.loss(of_observations);
  const double root = loss.kind == LossKind::none ? 1 : std::sqrt(evaluate_loss(loss, s).first);
  for (std::size_t row = 0; row < out.b.size(); ++row) {
    double* J = &out.J[row * places.size()];
    for (std::size_t k = 0; k < places.size(); ++k) {
      out.b[row] -= J[k] * blocks[places[k].block].step[places[k].column];
      J[k] *= root;
    }
    out.b[row] *= root;
  }
}

}  // namespace sheaf
