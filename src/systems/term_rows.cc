// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/term_rows.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/row_metric.h"
#include "systems/dogleg_passes.h"

namespace sheaf {
namespace {

double square_of(const std::vector<double>& r) {
  double sum = 0;
  for (const double x : r) sum += x * x;
  return sum;
}

/// What a loss makes of rows and their residual (geometry/row_metric.h), however many they are.
void apply_loss(const ScaledLoss& loss, std::size_t columns, std::vector<double>& J,
                std::vector<double>& r) {
  const double s = square_of(r);
  const LossValue<double> rho = evaluate_loss(loss, s);
  const double phi = curvature_along(loss, rho, s), root = std::sqrt(rho.first);
  const double shorter = s > 0 ? (1 - std::sqrt(phi)) / s : 0;
  for (std::size_t k = 0; k < columns; ++k) {
    double along = 0;
    for (std::size_t row = 0; row < r.size(); ++row) along += r[row] * J[row * columns + k];
    for (std::size_t row = 0; row < r.size(); ++row) {
      double& x = J[row * columns + k];
      x = root * (x - r[row] * shorter * along);
    }
  }
  for (double& x : r) x *= root / std::sqrt(phi);
}

/// The tile of two blocks among those of the terms, which are in this order.
std::size_t number_of(const Couplings& tiles, std::uint32_t row, std::uint32_t column) {
  const auto before = [](const Tile& x, const Tile& y) {
    return x.row != y.row ? x.row < y.row : x.column < y.column;
  };
  const Tile* found =
      std::lower_bound(tiles.tiles, tiles.tiles + tiles.count, Tile{row, column}, before);
  return static_cast<std::size_t>(found - tiles.tiles);
}

}  // namespace

/// S x of the rows, and what the terms add.
class TermRows::Operator : public StateOperator {
 public:
  Operator(const TermRows& rows, std::unique_ptr<StateOperator> of_rows)
      : rows_(rows), of_rows_(std::move(of_rows)) {}

  void prepare(const double* squares) override { of_rows_->prepare(squares); }
  void apply(const double* x, double* y) override {
    of_rows_->apply(x, y);
    std::fill_n(y + kBlockVector * rows_.num_blocks(), kBlockVector * rows_.kept_, 0.0);
    rows_.multiply(x, y);
  }
  std::uint64_t bytes() const override { return of_rows_->bytes(); }

 private:
  const TermRows& rows_;
  std::unique_ptr<StateOperator> of_rows_;
};

class TermRows::Dogleg : public DoglegSource {
 public:
  Dogleg(const TermRows& rows, std::unique_ptr<DoglegSource> of_rows)
      : rows_(rows), of_rows_(std::move(of_rows)) {}

  void write_steps(const double* x, std::size_t blocks) override {
    of_rows_->write_steps(x, rows_.num_blocks());
    x_.assign(x, x + kBlockVector * blocks);
  }
  void gradient(const Chunk& chunk, double* sums) override { of_rows_->gradient(chunk, sums); }
  void gather(const double* sums, std::size_t blocks, double* solved) const override {
    of_rows_->gather(sums, blocks, solved);
    std::fill_n(solved + kBlockVector * rows_.num_blocks(), kBlockVector * rows_.kept_, 0.0);
    for (std::size_t t = 0; t < rows_.terms_.size(); ++t) {
      const auto& places = rows_.terms_[t]->places();
      const Linear& of = rows_.linear_[t];
      for (std::size_t k = 0; k < places.size(); ++k)
        for (std::size_t row = 0; row < of.r.size() && places[k].stands(); ++row)
          solved[kBlockVector * places[k].block + places[k].column] -=
              of.J[row * places.size() + k] * of.r[row];
    }
  }
  void curvature(const Chunk& chunk, double lambda, bool points_held,
                 CurvatureOutput& out) override {
    of_rows_->curvature(chunk, lambda, points_held, out);
  }
  double other_curvature() const override {
    std::vector<double> y(x_.size());
    rows_.multiply(x_.data(), y.data());
    double sum = of_rows_->other_curvature();
    for (std::size_t i = 0; i < y.size(); ++i) sum += x_[i] * y[i];
    return sum;
  }
  double point_damping(const Chunk& chunk) override { return of_rows_->point_damping(chunk); }

 private:
  const TermRows& rows_;
  std::unique_ptr<DoglegSource> of_rows_;
  std::vector<double> x_;
};

TermRows::TermRows(std::unique_ptr<PointRows> rows, std::vector<std::unique_ptr<Term>> terms,
                   const Columns& row_columns, std::size_t kept)
    : rows_(std::move(rows)),
      terms_(std::move(terms)),
      row_columns_(row_columns),
      kept_(kept),
      linear_(terms_.size()) {
  with_tiles_.tiles = rows_->chunks().tiles;
  for (const Tile& tile : tiles_of(terms_)) with_tiles_.tiles.push_back(tile);
}

TermRows::~TermRows() = default;

void TermRows::attach(const SteppedState& state) {
  state_ = &state;
  rows_->attach(state);
}

void TermRows::begin(const StepRequest& request) {
  loss_ = request.loss;
  rows_->begin(request);
}

Costs TermRows::add_costs(const CameraState& at, const Costs& of_rows,
                          const ScaledLoss& of_observations) const {
  Costs out = of_rows;
  std::vector<double> r;
  for (const auto& term : terms_) {
    r.resize(term->rows());
    term->evaluate(at, r.data(), nullptr);
    const double s = square_of(r);
    out.robust += evaluate_loss(term->loss(of_observations), s).value;
    if (term->part() == Term::Part::observations) out.square += s;
  }
  return out;
}

Costs TermRows::held_costs(const Costs& summed) const {
  return add_costs(state_->held.cameras, rows_->held_costs(summed), loss_);
}

Costs TermRows::tried_costs(const PointTrial& in, const Costs& summed, Settling& points,
                            Trial& out) {
  return add_costs(state_->tried.cameras, rows_->tried_costs(in, summed, points, out), in.loss);
}

void TermRows::linearize() {
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    const Term& term = *terms_[t];
    Linear& of = linear_[t];
    of.r.resize(term.rows());
    of.J.resize(term.rows() * term.places().size());
    term.evaluate(state_->held.cameras, of.r.data(), of.J.data());
    apply_loss(term.loss(loss_), term.places().size(), of.J, of.r);
  }
}

ReducedSums TermRows::finish(double* tiles, double* diagonal) {
  ReducedSums sums = rows_->finish(tiles, diagonal);
  linearize();
  const std::size_t first = chunks().tiles.size();
  std::fill_n(tiles + kTileDoubles * first, kTileDoubles * more_tiles(), 0.0);
  std::fill_n(diagonal + kDiagonalDoubles * num_blocks(), kDiagonalDoubles * kept_, 0.0);
  double* const more = tiles + kTileDoubles * first;
  sums.chunks = &with_tiles_;
  sums.couplings = {with_tiles_.tiles.data() + first, more, more_tiles()};
  for (std::size_t t = 0; t < terms_.size(); ++t)
    add_to_sums(*terms_[t], linear_[t], sums.couplings, more, diagonal);
  return sums;
}

void TermRows::add_to_sums(const Term& term, const Linear& of, const Couplings& couplings,
                           double* more_tiles, double* diagonal) {
  const auto& places = term.places();
  const std::size_t n = places.size();
  // J^T J, row by row: a Gaussian of a window has some fifty rows and columns.
  products_.assign(n * n, 0);
  for (std::size_t row = 0; row < of.r.size(); ++row)
    for (std::size_t a = 0; a < n; ++a)
      for (std::size_t b = 0; b < n; ++b)
        products_[a * n + b] += of.J[row * n + a] * of.J[row * n + b];
  for (std::size_t a = 0; a < n; ++a) {
    const TermPlace& row = places[a];
    if (!row.stands()) continue;
    double* block = diagonal + kDiagonalDoubles * row.block;
    for (std::size_t r = 0; r < of.r.size(); ++r)
      block[diagonal_layout::right_side(row.column)] += of.J[r * n + a] * of.r[r];
    std::uint32_t known = TermPlace::kHeld;
    double* tile = nullptr;
    for (std::size_t b = 0; b < n; ++b) {
      const TermPlace& column = places[b];
      if (!column.stands()) continue;
      if (column.block == row.block && diagonal_layout::is_stored(row.column, column.column))
        block[diagonal_layout::at(row.column, column.column)] += products_[a * n + b];
      if (column.block >= row.block) continue;
      if (column.block != known)
        tile = more_tiles + kTileDoubles * number_of(couplings, row.block, column.block);
      known = column.block;
      tile[tile_layout::at(row.column, column.column)] -= products_[a * n + b];
    }
  }
}

void TermRows::multiply(const double* x, double* y) const {
  for (std::size_t t = 0; t < terms_.size(); ++t) {
    const auto& places = terms_[t]->places();
    const Linear& of = linear_[t];
    for (std::size_t row = 0; row < of.r.size(); ++row) {
      const double* J = &of.J[row * places.size()];
      double e = 0;
      for (std::size_t k = 0; k < places.size(); ++k)
        if (places[k].stands()) e += J[k] * x[kBlockVector * places[k].block + places[k].column];
      for (std::size_t k = 0; k < places.size(); ++k)
        if (places[k].stands()) y[kBlockVector * places[k].block + places[k].column] += J[k] * e;
    }
  }
}

PointRows::Operators TermRows::make_operators(const Columns&, bool mixed) {
  Operators of_rows = rows_->make_operators(row_columns_, mixed);
  Operators out;
  out.exact = std::make_unique<Operator>(*this, std::move(of_rows.exact));
  if (of_rows.rounded) out.rounded = std::make_unique<Operator>(*this, std::move(of_rows.rounded));
  return out;
}

std::unique_ptr<DoglegSource> TermRows::make_dogleg() {
  return std::make_unique<Dogleg>(*this, rows_->make_dogleg());
}

std::uint64_t TermRows::bytes() const {
  std::uint64_t sum = rows_->bytes();
  for (const Linear& of : linear_) sum += 8 * (of.J.capacity() + of.r.capacity());
  return sum;
}

}  // namespace sheaf
