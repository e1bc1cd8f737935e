// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/normal_equations.h"

#include <algorithm>
#include <cmath>

#include "covariance/small_cholesky.h"
#include "platform/cancel.h"
#include "scene/terms.h"

namespace sheaf {
namespace {

/// Far below what rounding leaves of a point's V: what is lost is not there.
constexpr double kSingular = 1e-13;

/// Passes over the points ask so often whether to go on: a point that a thousand images see takes a
/// tenth of a second.
void poll_at(std::size_t point) {
  if (point % 4 == 0) poll_cancelled();
}

/// Pairs of blocks that some row or some point couples: a bit of each pair that there may be, or a
/// list where these would be too many.
class CoupledPairs {
 public:
  explicit CoupledPairs(std::size_t blocks)
      : blocks_(blocks), bits_(blocks <= kManyBlocks ? blocks * (blocks + 1) / 2 : 0) {}

  void add(std::uint32_t row, std::uint32_t column) {  // row >= column
    if (blocks_ <= kManyBlocks) {
      bits_[std::size_t(row) * (row + 1) / 2 + column] = true;
      return;
    }
    keys_.push_back(std::uint64_t(row) << 32 | column);
    if (keys_.size() > kManyKeys && keys_.size() > 2 * sorted_) {
      sort_unique();
      sorted_ = keys_.size();
    }
  }
  /// Sorted, each once.
  std::vector<std::uint64_t> take() {
    std::size_t at = 0;
    for (std::uint64_t row = 0; blocks_ <= kManyBlocks && row < blocks_; ++row)
      for (std::uint64_t column = 0; column <= row; ++column)
        if (bits_[at++]) keys_.push_back(row << 32 | column);
    if (blocks_ > kManyBlocks) sort_unique();
    keys_.shrink_to_fit();
    return std::move(keys_);
  }

 private:
  static constexpr std::size_t kManyBlocks = 20000;  // 25 MB of bits
  static constexpr std::size_t kManyKeys = std::size_t(1) << 24;
  void sort_unique() {
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
  }

  const std::size_t blocks_;
  std::vector<bool> bits_;
  std::vector<std::uint64_t> keys_;
  std::size_t sorted_ = 0;
};

}  // namespace

NormalEquations::NormalEquations(const Problem& problem, const Fixed& fixed, const ScaledLoss& loss)
    : problem_(problem),
      loss_(loss),
      points_held_(fixed.points),
      blocks_(number_parameters(problem, fixed)),
      rows_(problem, blocks_) {
  sort_by_point();
  if (!problem.terms.points.empty()) prior_.assign(problem.num_points(), -1);
  for (std::size_t k = 0; k < problem.terms.points.size(); ++k)
    prior_[problem.terms.points[k].point] = static_cast<std::int64_t>(k);
  CameraState state = camera_state(problem);
  for (const std::uint32_t p : blocks_.kept)
    state.kept.push_back({problem.points[3 * std::size_t(p)],
                          problem.points[3 * std::size_t(p) + 1],
                          problem.points[3 * std::size_t(p) + 2]});
  for (const auto& term :
       make_terms(problem, TermPlaces::of_parameters(problem), blocks_.kept, {}, nullptr))
    terms_.push_back(rows_of(*term, state));
  make_pattern();
  squares_.assign(static_cast<std::size_t>(blocks_.columns()), 0);
  add_terms();
  add_points();
}

double NormalEquations::weight_of(const ObservationRows::Row& row) const {
  const double s = row.r[0] * row.r[0] + row.r[1] * row.r[1];
  return loss_.kind == LossKind::none ? 1 : evaluate_loss(loss_, s).first;
}

/// Observations of kept points are terms.
void NormalEquations::sort_by_point() {
  std::vector<std::uint8_t> kept(problem_.num_points(), 0);
  for (const std::uint32_t p : blocks_.kept) kept[p] = 1;
  const auto takes_part = [&](std::uint64_t i) {
    const std::vector<double>& sigma = problem_.observation_sigma;
    return kept[problem_.observation_point[i]] == 0 && (sigma.empty() || !std::isinf(sigma[i]));
  };
  first_.assign(problem_.num_points() + 1, 0);
  for (std::uint64_t i = 0; i < problem_.num_observations(); ++i)
    if (takes_part(i)) ++first_[problem_.observation_point[i] + 1];
  for (std::size_t p = 0; p < problem_.num_points(); ++p) first_[p + 1] += first_[p];
  order_.resize(first_.back());
  std::vector<std::uint64_t> next(first_.begin(), first_.end() - 1);
  for (std::uint64_t i = 0; i < problem_.num_observations(); ++i)
    if (takes_part(i)) order_[next[problem_.observation_point[i]]++] = i;
}

NormalEquations::TermRowsOf NormalEquations::rows_of(const Term& term,
                                                     const CameraState& state) const {
  const std::vector<TermPlace>& places = term.places();
  const std::size_t rows = term.rows(), columns = places.size();
  std::vector<double> r(rows), J(rows * columns);
  term.evaluate(state, r.data(), J.data());
  double s = 0;
  for (const double x : r) s += x * x;
  const ScaledLoss loss = term.loss(loss_);
  const double root = loss.kind == LossKind::none ? 1 : std::sqrt(evaluate_loss(loss, s).first);
  TermRowsOf out;
  out.rows = rows;
  for (const double x : r) out.r.push_back(root * x);
  const auto add = [&](std::uint32_t block, std::size_t column, std::size_t row, double value) {
    std::size_t k = static_cast<std::size_t>(
        std::find(out.blocks.begin(), out.blocks.end(), block) - out.blocks.begin());
    if (k == out.blocks.size()) {
      out.blocks.push_back(block);
      out.J.resize(out.J.size() + 9 * rows, 0);
    }
    out.J[9 * (k * rows + row) + column] += root * value;
  };
  const std::size_t images = problem_.num_images(), lenses = problem_.cameras.size();
  for (std::size_t c = 0; c < columns; ++c) {
    const std::size_t block = places[c].block, column = places[c].column;
    if (!places[c].stands()) continue;
    for (std::size_t row = 0; row < rows; ++row) {
      const double value = J[columns * row + c];
      if (block < images) {
        for (const ObservationRows::PosePart& pose : rows_.pose_parts(block))
          for (std::size_t k = 0; k < 6; ++k)
            add(pose.block, k, row, value * pose.by_image[6 * column + k]);
      } else if (block < images + lenses) {
        const ParameterBlocks::Lens& lens = blocks_.lenses[block - images];
        const auto at = static_cast<std::size_t>(
            std::find(lens.of_column.begin(), lens.of_column.end(), static_cast<int>(column)) -
            lens.of_column.begin());
        if (at < lens.of_column.size())
          add(lens.block + static_cast<std::uint32_t>(at / 9), at % 9, row, value);
      } else if (const std::uint32_t kept = blocks_.kept_block[block - images - lenses];
                 kept != ParameterBlocks::kNone) {
        add(kept, column, row, value);
      }
    }
  }
  return out;
}

void NormalEquations::make_pattern() {
  CoupledPairs pairs(blocks_.count());
  for (std::uint32_t b = 0; b < blocks_.count(); ++b) pairs.add(b, b);
  for (const TermRowsOf& term : terms_)
    for (const std::uint32_t a : term.blocks)
      for (const std::uint32_t b : term.blocks) pairs.add(std::max(a, b), std::min(a, b));
  std::vector<std::uint32_t> seen;
  for (std::size_t p = 0; p < problem_.num_points(); ++p) {
    poll_at(p);
    seen.clear();
    for (const std::uint64_t* i = begin_of(p); i != end_of(p); ++i) {
      const std::uint32_t image = problem_.observation_image[*i];
      for (const ObservationRows::PosePart& pose : rows_.pose_parts(image))
        seen.push_back(pose.block);
      const ParameterBlocks::Lens& lens = blocks_.lenses[problem_.image_camera[image]];
      for (std::size_t at = 0; at < lens.of_column.size(); at += 9)
        seen.push_back(lens.block + static_cast<std::uint32_t>(at / 9));
    }
    std::sort(seen.begin(), seen.end());
    seen.erase(std::unique(seen.begin(), seen.end()), seen.end());
    for (std::size_t a = 0; a < seen.size(); ++a)
      for (std::size_t b = 0; b <= a; ++b) pairs.add(seen[a], seen[b]);
  }
  tiles_ = std::make_unique<BlockTiles>(blocks_.count(), pairs.take());
}

void NormalEquations::add_terms() {
  for (const TermRowsOf& term : terms_) {
    for (const double r : term.r) moments_.terms_square += r * r;
    moments_.terms += term.rows;
    for (std::size_t a = 0; a < term.blocks.size(); ++a)
      for (std::size_t b = 0; b < term.blocks.size(); ++b) {
        if (term.blocks[a] < term.blocks[b]) continue;
        double* tile = tiles_->of(term.blocks[a], term.blocks[b]);
        for (std::size_t row = 0; row < term.rows; ++row)
          for (std::size_t i = 0; i < 9; ++i)
            for (std::size_t k = 0; k < 9; ++k)
              tile[9 * i + k] +=
                  term.J[9 * (a * term.rows + row) + i] * term.J[9 * (b * term.rows + row) + k];
      }
    for (std::size_t a = 0; a < term.blocks.size(); ++a)
      for (std::size_t row = 0; row < term.rows; ++row)
        for (std::size_t i = 0; i < blocks_.width(term.blocks[a]); ++i) {
          const double x = term.J[9 * (a * term.rows + row) + i];
          squares_[static_cast<std::size_t>(blocks_.first[term.blocks[a]]) + i] += x * x;
        }
  }
}

void NormalEquations::add_observation(const ObservationRows::Row& row, double weight) {
  for (std::size_t a = 0; a < row.count; ++a) {
    const ObservationRows::Part& A = row.parts[a];
    for (std::size_t i = 0; i < A.width; ++i)
      squares_[static_cast<std::size_t>(blocks_.first[A.block]) + i] +=
          weight * (A.J[i] * A.J[i] + A.J[9 + i] * A.J[9 + i]);
    for (std::size_t b = 0; b < row.count; ++b) {
      const ObservationRows::Part& B = row.parts[b];
      if (A.block < B.block) continue;
      double* tile = tiles_->of(A.block, B.block);
      for (std::size_t i = 0; i < A.width; ++i) {
        const double x = weight * A.J[i], y = weight * A.J[9 + i];
        for (std::size_t k = 0; k < B.width; ++k) tile[9 * i + k] += x * B.J[k] + y * B.J[9 + k];
      }
    }
  }
}

std::array<double, 9> NormalEquations::point_prior_root(std::size_t point) const {
  return *whitening(problem_.terms.points[static_cast<std::size_t>(prior_[point])].covariance);
}

void NormalEquations::point(std::size_t index, Point& out, const Visit& visit) const {
  out.V = {};
  out.blocks.clear();
  out.W.clear();
  ObservationRows::Row row;
  for (const std::uint64_t* i = begin_of(index); i != end_of(index); ++i) {
    rows_.evaluate(*i, row);
    const double w = weight_of(row);
    if (visit) visit(row, w);
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b)
        out.V[3 * a + b] += w * (row.point[a] * row.point[b] + row.point[3 + a] * row.point[3 + b]);
    for (std::size_t k = 0; k < row.count; ++k) {
      const ObservationRows::Part& part = row.parts[k];
      const auto at = std::lower_bound(out.blocks.begin(), out.blocks.end(), part.block);
      const auto place = at - out.blocks.begin();
      if (at == out.blocks.end() || *at != part.block) {
        out.blocks.insert(at, part.block);
        out.W.insert(out.W.begin() + place, std::array<double, 27>{});
      }
      std::array<double, 27>& W = out.W[static_cast<std::size_t>(place)];
      for (std::size_t b = 0; b < 3; ++b)
        for (std::size_t i2 = 0; i2 < part.width; ++i2)
          W[9 * b + i2] += w * (part.J[i2] * row.point[b] + part.J[9 + i2] * row.point[3 + b]);
    }
  }
  if (!prior_.empty() && prior_[index] >= 0) {
    const auto U = point_prior_root(index);
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b)
        for (std::size_t r = 0; r < 3; ++r) out.V[3 * a + b] += U[3 * r + a] * U[3 * r + b];
  }
  out.seen = out.V[0] + out.V[4] + out.V[8] > 0;
  out.determined = out.seen && invert3(out.V, kSingular, out.inverse);
  if (!out.seen || out.determined) return;
  // A direction that nothing determines takes nothing from the cameras either.
  std::array<double, 9> ridged = out.V;
  const double trace = out.V[0] + out.V[4] + out.V[8];
  for (const std::size_t k : {0, 4, 8}) ridged[k] += 1e-12 * trace;
  invert3(ridged, 0, out.inverse);
}

/// S -= W V^-1 W^T. What is beyond a block's columns is 0 in W.
void NormalEquations::eliminate(const Point& point) {
  std::array<double, 27> Y;  // W V^-1, 9 x 3
  tiles_->for_pairs(point.blocks, [&](std::size_t at, std::size_t a, std::size_t b) {
    const std::size_t rows = blocks_.width(point.blocks[a]);
    for (std::size_t i = 0; b == 0 && i < rows; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        Y[3 * i + k] = point.W[a][i] * point.inverse[k] + point.W[a][9 + i] * point.inverse[3 + k] +
                       point.W[a][18 + i] * point.inverse[6 + k];
    double* tile = tiles_->at(at);
    const double* W = point.W[b].data();
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t k = 0; k < 9; ++k)
        tile[9 * i + k] -= Y[3 * i] * W[k] + Y[3 * i + 1] * W[9 + k] + Y[3 * i + 2] * W[18 + k];
  });
}

void NormalEquations::measure(const ObservationRows::Row& row) {
  const double s = row.r[0] * row.r[0] + row.r[1] * row.r[1];
  const LossValue<double> rho =
      loss_.kind == LossKind::none ? LossValue<double>{s, 1, 0} : evaluate_loss(loss_, s);
  ++moments_.observations;
  moments_.square += rho.first * rho.first * s;
  moments_.weight += rho.first;
  moments_.slope += rho.first + s * rho.second;
  moments_.weight_square += rho.first * rho.first;
  moments_.slope_square += slope_square(rho, s);
}

void NormalEquations::add_points() {
  Point of;
  const Visit add = [this](const ObservationRows::Row& row, double weight) {
    measure(row);
    add_observation(row, weight);
  };
  for (std::size_t p = 0; p < problem_.num_points(); ++p) {
    poll_at(p);
    point(p, of, add);
    if (points_held_ || !of.seen) continue;
    ++eliminated_;
    eliminate(of);
    if (prior_.empty() || prior_[p] < 0) continue;
    const auto U = point_prior_root(p);
    const PointPrior& prior = problem_.terms.points[static_cast<std::size_t>(prior_[p])];
    moments_.terms += 3;
    for (std::size_t r = 0; r < 3; ++r) {
      double x = 0;
      for (std::size_t k = 0; k < 3; ++k)
        x += U[3 * r + k] * (problem_.points[3 * p + k] - prior.position[k]);
      moments_.terms_square += x * x;
    }
  }
}

std::vector<double> NormalEquations::gram(const std::vector<double>& G, std::size_t count,
                                          const PointDirections& of_point) const {
  std::vector<double> sum(count * count, 0), moved(count), of(3 * count, 0);
  const auto add = [&] {
    for (std::size_t a = 0; a < count; ++a)
      for (std::size_t b = 0; b < count; ++b) sum[count * a + b] += moved[a] * moved[b];
  };
  const auto by_block = [&](std::uint32_t block, const double* J, std::size_t g) {
    double x = 0;
    for (std::size_t c = 0; c < blocks_.width(block); ++c)
      x += J[c] * G[count * (static_cast<std::size_t>(blocks_.first[block]) + c) + g];
    return x;
  };
  const auto by_point = [&](const double* J, std::size_t g) {
    return points_held_ ? 0 : J[0] * of[g] + J[1] * of[count + g] + J[2] * of[2 * count + g];
  };
  ObservationRows::Row row;
  for (std::size_t p = 0; p < problem_.num_points(); ++p) {
    poll_at(p);
    of_point(p, of.data());
    for (const std::uint64_t* i = begin_of(p); i != end_of(p); ++i) {
      rows_.evaluate(*i, row);
      const double root = std::sqrt(weight_of(row));
      for (std::size_t r = 0; r < 2; ++r) {
        for (std::size_t g = 0; g < count; ++g) {
          double x = by_point(&row.point[3 * r], g);
          for (std::size_t k = 0; k < row.count; ++k)
            x += by_block(row.parts[k].block, &row.parts[k].J[9 * r], g);
          moved[g] = root * x;
        }
        add();
      }
    }
    if (prior_.empty() || prior_[p] < 0) continue;
    const auto U = point_prior_root(p);
    for (std::size_t r = 0; r < 3; ++r) {
      for (std::size_t g = 0; g < count; ++g) moved[g] = by_point(&U[3 * r], g);
      add();
    }
  }
  for (const TermRowsOf& term : terms_)
    for (std::size_t r = 0; r < term.rows; ++r) {
      for (std::size_t g = 0; g < count; ++g) {
        moved[g] = 0;
        for (std::size_t k = 0; k < term.blocks.size(); ++k)
          moved[g] += by_block(term.blocks[k], &term.J[9 * (k * term.rows + r)], g);
      }
      add();
    }
  return sum;
}

}  // namespace sheaf
