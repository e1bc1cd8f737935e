// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <vector>

#include "geometry/known_kinds.h"
#include "scene/rigs.h"
#include "sheaf/solver.h"
#include "solve/leaving_rows.h"
#include "solve/row_elimination.h"

namespace sheaf {
namespace {

using Kind = GaussianPrior::Block::Kind;

/// Rows that leave, brought together: points that are tied to nothing but through their own rows go
/// first, each by itself; then all else that leaves; what is left is the Gaussian.
class Marginal {
 public:
  Marginal(const LeavingRows& rows, const ScaledLoss& loss)
      : rows_(rows), loss_(loss), alone_(find_points_alone()), all_(number_columns()) {}

  GaussianPrior find() {
    std::vector<std::vector<std::size_t>> of_block(rows_.blocks.size());
    std::vector<std::size_t> others;
    for (std::size_t t = 0; t < rows_.terms.size(); ++t) {
      const std::uint32_t block = rows_.terms[t]->places().back().block;
      (alone_[block] ? of_block[block] : others).push_back(t);
    }
    for (std::size_t block = 0; block < of_block.size(); ++block)
      if (!of_block[block].empty()) eliminate_point(block, of_block[block]);
    for (const std::size_t t : others) add_rows({t}, column_, all_);
    all_.eliminate(leaving_columns_);
    return made();
  }

 private:
  static constexpr std::int32_t kNone = -1;
  using Places = std::vector<std::vector<std::int32_t>>;  ///< of each column of each block

  /// A point that leaves and that no term ties to others: its rows are its own and those of what
  /// sees it. Its place is the last of each of them.
  std::vector<bool> find_points_alone() const {
    std::vector<bool> alone;
    for (const LeavingRows::Block& block : rows_.blocks)
      alone.push_back(block.of.kind == Kind::point && block.leaves);
    for (const auto& term : rows_.terms)
      if (term->part() == Term::Part::distances || term->part() == Term::Part::gaussians)
        for (const TermPlace& place : term->places()) alone[place.block] = false;
    return alone;
  }

  /// Of what leaves first, then of what stays. Returns room for rows of them.
  DenseRows number_columns() {
    std::int32_t next = 0;
    column_.resize(rows_.blocks.size());
    for (const bool leaves : {true, false}) {
      for (std::size_t at = 0; at < rows_.blocks.size(); ++at) {
        const LeavingRows::Block& block = rows_.blocks[at];
        if (block.leaves != leaves) continue;
        for (const bool held : block.held)
          column_[at].push_back(held || !block.touched || alone_[at] ? kNone : next++);
      }
      if (leaves) leaving_columns_ = static_cast<std::size_t>(next);
    }
    return DenseRows(static_cast<std::size_t>(next));
  }

  /// Rows of some terms, by these columns.
  void add_rows(const std::vector<std::size_t>& terms, const Places& column, DenseRows& to) {
    for (const std::size_t t : terms) {
      const Term& term = *rows_.terms[t];
      const auto& places = term.places();
      rows_.linearize(term, loss_, linear_);
      for (std::size_t row = 0; row < term.rows(); ++row) {
        double* of_row = to.add();
        for (std::size_t k = 0; k < places.size(); ++k) {
          const std::int32_t c = column[places[k].block][places[k].column];
          if (c != kNone) of_row[c] += linear_.J[row * places.size() + k];
        }
        of_row[to.columns()] = linear_.b[row];
      }
    }
  }

  /// Its rows by its own columns and those alone that they have.
  void eliminate_point(std::size_t point, const std::vector<std::size_t>& terms) {
    Places local(rows_.blocks.size());
    std::vector<std::int32_t> global;
    std::int32_t next = 0;
    for (const bool held : rows_.blocks[point].held) local[point].push_back(held ? kNone : next++);
    const auto own = static_cast<std::size_t>(next);
    for (const std::size_t t : terms)
      for (const TermPlace& place : rows_.terms[t]->places()) {
        if (!local[place.block].empty()) continue;
        for (const std::int32_t c : column_[place.block]) {
          local[place.block].push_back(c == kNone ? kNone : next++);
          if (c != kNone) global.push_back(c);
        }
      }
    DenseRows rows(static_cast<std::size_t>(next));
    add_rows(terms, local, rows);
    rows.eliminate(own);
    for (std::size_t i = 0; i < rows.count(); ++i) {
      double* to = all_.add();
      for (std::size_t k = 0; k < global.size(); ++k) to[global[k]] = rows.row(i)[k];
      to[all_.columns()] = rows.row(i)[global.size()];
    }
    // As many rows as columns say the same.
    if (all_.count() > 2 * all_.columns() + kMostMore) all_.compress();
  }
  static constexpr std::size_t kMostMore = 256;

  GaussianPrior made() {
    GaussianPrior out;
    const std::vector<double> mean = all_.compress();
    std::vector<std::int32_t> from;  // of each column of the prior
    for (std::size_t at = 0; at < rows_.blocks.size(); ++at) {
      const LeavingRows::Block& block = rows_.blocks[at];
      const auto& columns = column_[at];
      if (block.leaves ||
          std::all_of(columns.begin(), columns.end(), [](std::int32_t c) { return c == kNone; }))
        continue;
      out.blocks.push_back(block.of);
      for (const std::int32_t c : columns)
        from.push_back(c == kNone ? kNone : c - static_cast<std::int32_t>(leaving_columns_));
    }
    if (all_.count() == 0) return {};
    for (std::size_t i = 0; i < all_.count(); ++i)
      for (const std::int32_t c : from) out.square_root.push_back(c == kNone ? 0 : all_.row(i)[c]);
    for (const std::int32_t c : from)
      out.mean.push_back(c == kNone ? 0 : mean[static_cast<std::size_t>(c)]);
    return out;
  }

  const LeavingRows& rows_;
  const ScaledLoss loss_;
  const std::vector<bool> alone_;
  Places column_;
  std::size_t leaving_columns_ = 0;
  DenseRows all_;
  LeavingRows::Linear linear_;
};

}  // namespace

Result<GaussianPrior> marginalise(const Problem& problem, const std::vector<std::uint32_t>& images,
                                  const std::vector<std::uint32_t>& points,
                                  const MarginaliseOptions& options) {
  if (Result<void> valid = validate(problem); !valid.ok()) return valid.error();
  if (has_rigid_frames(problem.rigs))
    return Error(ErrorCode::usage,
                 "images of rigs cannot be marginalised: a Gaussian has poses of "
                 "images, not of frames and sensors");
  if (!is_known(options.loss.kind))
    return Error(ErrorCode::usage, "to marginalise: the loss is none that there is");
  if (options.loss.kind != LossKind::none && !(options.loss.scale_px > 0))
    return Error(ErrorCode::usage,
                 "to marginalise, the loss needs a scale above 0: the last one of "
                 "the solve (Summary::rounds)");
  const Result<LeavingBlocks> leaving = leaving_of(problem, images, points);
  if (!leaving.ok()) return leaving.error();
  const LeavingRows rows = leaving_rows(problem, leaving.value(), options.fixed);
  return Marginal(rows, {options.loss.kind, options.loss.scale_px}).find();
}

}  // namespace sheaf
