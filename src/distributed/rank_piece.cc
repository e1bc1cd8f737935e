// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "distributed/rank_piece.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace sheaf {

Result<std::unique_ptr<RankPiece>> RankPiece::make(ScenePiece piece, const PieceRules& rules,
                                                   const Kernels& kernels, Threads& threads) {
  SolveOptions options = rules.options;
  options.points = rules.points.points;
  options.solver = CameraSolverKind::iterative_implicit;
  options.lend_observations = false;
  auto out = std::unique_ptr<RankPiece>(new RankPiece(std::move(piece)));
  const Problem& problem = out->piece_.problem;
  if (rules.fixed) {
    Result<Fixed> fixed = rules.fixed(problem);
    if (!fixed.ok()) return fixed.error();
    options.fixed = std::move(fixed).value();
  }
  Result<Build> build = Build::plan(problem, options, {}, kernels, threads, rules.lens_blocks);
  if (!build.ok()) return build.error();
  out->build_.emplace(std::move(build).value());
  const bool mixed = out->build_->choice().plan.mixed;
  Build::Parts parts = out->build_->make_parts(problem);
  parts.rules.crosses = rules.points.crosses;
  out->take(std::move(parts), threads, mixed);
  return out;
}

void RankPiece::take(Build::Parts parts, Threads& threads, bool mixed) {
  camera_columns_ = std::move(parts.camera_columns);
  columns_ = parts.columns;
  points_ = std::make_unique<PointPiece>(std::move(parts.rows), std::move(parts.cameras),
                                         piece_.problem.points, parts.rules, threads);
  products_ = points_->rows().make_operators(*columns_, mixed);
  diagonal_.emplace(*columns_, threads);
  x_.allocate(kBlockVector * num_blocks());
  y_.allocate(kBlockVector * num_blocks());
  x_.fill(0);
  from_ = column_vector();
  to_ = column_vector();
  own_blocks();
}

void RankPiece::own_blocks() {
  for (std::uint32_t i = 0; i < piece_.owned_images; ++i) owned_.push_back(i);
  const LensTracks* tracks = build_->tracks();
  for (std::uint32_t c = 0; tracks != nullptr && c < piece_.owned_cameras; ++c)
    for (std::uint32_t j = 0; j < tracks->lenses[c].blocks; ++j)
      owned_.push_back(tracks->lenses[c].first_block + j);
}

std::vector<double> RankPiece::lens_places() const {
  std::vector<double> out;
  const LensTracks* tracks = build_->tracks();
  std::uint32_t next = piece_.owned_images;
  for (std::uint32_t c = 0; c < piece_.owned_cameras; ++c) {
    const std::uint32_t blocks = tracks != nullptr ? tracks->lenses[c].blocks : 0;
    out.push_back(next);
    out.push_back(blocks);
    next += blocks;
  }
  return out;
}

void RankPiece::place_ghosts(const std::vector<double>& places) {
  for (std::size_t k = 0; k < piece_.ghost_images.size(); ++k) {
    ghost_.push_back(piece_.owned_images + static_cast<std::uint32_t>(k));
    ghosts_.push_back(piece_.ghost_images[k]);
  }
  const LensTracks* tracks = build_->tracks();
  for (std::size_t k = 0; tracks != nullptr && k < piece_.ghost_cameras.size(); ++k) {
    const LensPlaces& lens = tracks->lenses[piece_.owned_cameras + k];
    if (lens.blocks != places[2 * k + 1])
      throw std::runtime_error("pieces " + std::to_string(piece_.number) + " and " +
                               std::to_string(piece_.ghost_cameras[k].piece) +
                               " see a lens that they share in different ways");
    for (std::uint32_t j = 0; j < lens.blocks; ++j) {
      ghost_.push_back(lens.first_block + j);
      ghosts_.push_back(
          {piece_.ghost_cameras[k].piece, static_cast<std::uint32_t>(places[2 * k]) + j});
    }
  }
}

void RankPiece::prepare(bool precise, const double* squares) {
  product_ = products_.rounded && !precise ? products_.rounded.get() : products_.exact.get();
  product_->prepare(squares);
}

void RankPiece::multiply(const double* owned, const double* ghosts, double* to_owned,
                         double* to_ghosts) {
  for_each([&](std::size_t k,
               std::uint32_t b) { std::copy_n(owned + kWidth * k, kWidth, &x_[kBlockVector * b]); },
           [&](std::size_t k, std::uint32_t b) {
             std::copy_n(ghosts + kWidth * k, kWidth, &x_[kBlockVector * b]);
           });
  product_->apply(x_.data(), y_.data());
  const auto take = [&](std::uint32_t b, double* to) {
    const std::int32_t* columns = columns_->image(b);
    for (int k = 0; k < kWidth; ++k)
      to[k] = columns[k] >= 0 ? y_[kBlockVector * b + static_cast<std::size_t>(k)] : 0;
  };
  for_each([&](std::size_t k, std::uint32_t b) { take(b, to_owned + kWidth * k); },
           [&](std::size_t k, std::uint32_t b) { take(b, to_ghosts + kWidth * k); });
}

void RankPiece::precondition(const double* r, double* z) {
  from_.fill(0);
  for_each_owned([&](std::size_t k, std::uint32_t b) { to_columns(b, r + kWidth * k, from_); });
  diagonal_->solve(from_.data(), to_.data());
  for_each_owned([&](std::size_t k, std::uint32_t b) {
    for (int j = 0; j < kWidth; ++j) {
      const std::int32_t c = columns_->image(b)[j];
      z[kWidth * k + static_cast<std::size_t>(j)] = c >= 0 ? to_[static_cast<std::size_t>(c)] : 0;
    }
  });
}

Buffer<double> RankPiece::column_vector() const {
  Buffer<double> out((static_cast<std::size_t>(columns_->count) + 7) / 8 * 8);
  out.fill(0);
  return out;
}

void RankPiece::to_columns(std::uint32_t block, const double* from, Buffer<double>& columns) const {
  for (int k = 0; k < kWidth; ++k)
    if (const std::int32_t c = columns_->image(block)[k]; c >= 0)
      columns[static_cast<std::size_t>(c)] = from[k];
}

void RankPiece::to_columns(const double* owned, const double* ghosts,
                           Buffer<double>& columns) const {
  for_each([&](std::size_t k, std::uint32_t b) { to_columns(b, owned + kWidth * k, columns); },
           [&](std::size_t k, std::uint32_t b) { to_columns(b, ghosts + kWidth * k, columns); });
}

double RankPiece::step_cameras(const Buffer<double>& columns) {
  SteppedState& state = points_->state();
  return camera_columns_.step(state.held.cameras, columns, state.tried.cameras);
}

const ScenePiece& RankPiece::store() {
  build_->store(points_->state().held.cameras, piece_.problem);
  points_->store_points(piece_.problem.points);
  return piece_;
}

std::uint64_t RankPiece::bytes() const {
  return points_->bytes() + products_.exact->bytes() +
         (products_.rounded ? products_.rounded->bytes() : 0) + diagonal_->bytes() + x_.bytes() +
         y_.bytes() + from_.bytes() + to_.bytes();
}

}  // namespace sheaf
