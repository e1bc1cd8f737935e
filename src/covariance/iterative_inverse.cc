// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/iterative_inverse.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

#include "platform/cancel.h"

namespace sheaf {
namespace {

/// Of the residual's length in the preconditioner's norm, against that of the right-hand side.
constexpr double kTolerance = 1e-11;
constexpr std::uint64_t kFewest = 1000;

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k] * b[k];
  return sum;
}

/// Residuals that every later one is orthogonal to, but for rounding, which a badly conditioned
/// matrix blows up: what is left of them is taken out again. As many as memory is set apart for.
class PastResiduals {
 public:
  void keep(const std::vector<double>& r, const std::vector<double>& z, double rz) {
    constexpr std::size_t kMost_bytes = std::size_t(64) << 20;
    if (16 * r.size() * (pairs_.size() + 1) > kMost_bytes) return;
    Pair& pair = pairs_.emplace_back(Pair{r, z});
    for (double& x : pair.z) x /= rz;
  }
  void leave(std::vector<double>& r) const {
    for (const Pair& pair : pairs_) {
      const double by = dot(r, pair.z);
      for (std::size_t c = 0; c < r.size(); ++c) r[c] -= by * pair.r[c];
    }
  }

 private:
  struct Pair {
    std::vector<double> r, z;  ///< z over r . z
  };
  std::vector<Pair> pairs_;
};

}  // namespace

IterativeInverse::IterativeInverse(const NormalEquations& equations, const SceneGauge& gauge,
                                   const GaugeWeights& weights,
                                   std::vector<LinearFunction> functions, Threads& threads)
    : equations_(equations),
      gauge_(gauge),
      weights_(weights),
      functions_(std::move(functions)),
      threads_(threads) {
  invert_diagonal();
  for (const LinearFunction& function : functions_) solved_.push_back(solve(function));
}

/// Columns that nothing determines have neither rows nor an inverse.
void IterativeInverse::invert_diagonal() {
  using Block = Eigen::Matrix<double, 9, 9, Eigen::RowMajor>;
  constexpr double kLittle = 1e-14;
  const ParameterBlocks& blocks = equations_.blocks();
  diagonal_.assign(81 * blocks.count(), 0);
  for (std::uint32_t b = 0; b < blocks.count(); ++b) {
    Block S = Block::Identity();
    const double* tile = equations_.tiles().of(b, b);
    for (Eigen::Index i = 0; i < blocks.width(b); ++i) {
      const double square = equations_.squares()[static_cast<std::size_t>(blocks.first[b] + i)];
      if (!(square > 0)) continue;
      for (Eigen::Index k = 0; k <= i; ++k) S(i, k) = S(k, i) = tile[9 * i + k];
      S(i, i) += kLittle * square;
    }
    const Eigen::LLT<Block> factor(S);
    const Block inverse = factor.info() == Eigen::Success
                              ? Block(factor.solve(Block::Identity()))
                              : Block(S.diagonal().asDiagonal().inverse());
    std::copy(inverse.data(), inverse.data() + 81, &diagonal_[81 * std::size_t(b)]);
  }
}

void IterativeInverse::multiply(const std::vector<double>& x, std::vector<double>& y) const {
  const ParameterBlocks& blocks = equations_.blocks();
  const BlockTiles& tiles = equations_.tiles();
  std::fill(y.begin(), y.end(), 0.0);
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    const std::uint32_t a = tiles.row(t), b = tiles.column(t);
    const double* S = tiles.at(t);
    const double *xa = &x[static_cast<std::size_t>(blocks.first[a])],
                 *xb = &x[static_cast<std::size_t>(blocks.first[b])];
    double *ya = &y[static_cast<std::size_t>(blocks.first[a])],
           *yb = &y[static_cast<std::size_t>(blocks.first[b])];
    for (std::size_t i = 0; i < blocks.width(a); ++i) {
      // Of a tile on the diagonal the lower triangle is what is kept.
      const std::size_t end = a == b ? i : blocks.width(b);
      double sum = 0;
      for (std::size_t k = 0; k < end; ++k) {
        sum += S[9 * i + k] * xb[k];
        yb[k] += S[9 * i + k] * xa[i];
      }
      ya[i] += a == b ? sum + S[10 * i] * xa[i] : sum;
    }
  }
}

void IterativeInverse::precondition(const std::vector<double>& r, std::vector<double>& z) const {
  const ParameterBlocks& blocks = equations_.blocks();
  for (std::uint32_t b = 0; b < blocks.count(); ++b) {
    const double* inverse = &diagonal_[81 * std::size_t(b)];
    const auto first = static_cast<std::size_t>(blocks.first[b]);
    for (std::size_t i = 0; i < blocks.width(b); ++i) {
      double sum = 0;
      for (std::size_t k = 0; k < blocks.width(b); ++k) sum += inverse[9 * i + k] * r[first + k];
      z[first + i] = equations_.squares()[first + i] > 0 ? sum : 0;
    }
  }
}

/// b <- P^T b = b - A^T G^T b.
void IterativeInverse::into_range(std::vector<double>& b) const {
  const std::size_t d = gauge_.count(), n = b.size();
  std::vector<double> free(d, 0);
  for (std::size_t c = 0; c < n; ++c)
    for (std::size_t k = 0; k < d; ++k) free[k] += gauge_.of_columns()[d * c + k] * b[c];
  for (std::size_t k = 0; k < d; ++k)
    for (std::size_t c = 0; c < n; ++c) b[c] -= weights_.of_columns[n * k + c] * free[k];
}

/// y <- P y = y - G A y.
void IterativeInverse::into_gauge(std::vector<double>& y) const {
  const std::size_t d = gauge_.count(), n = y.size();
  std::vector<double> held(d, 0);
  for (std::size_t k = 0; k < d; ++k)
    for (std::size_t c = 0; c < n; ++c) held[k] += weights_.of_columns[n * k + c] * y[c];
  for (std::size_t c = 0; c < n; ++c)
    for (std::size_t k = 0; k < d; ++k) y[c] -= gauge_.of_columns()[d * c + k] * held[k];
}

/// z = P M^-1 P^T r, so that nothing of the gauge comes in by rounding.
void IterativeInverse::precondition_in_gauge(const std::vector<double>& r,
                                             std::vector<double>& z) const {
  std::vector<double> in_range = r;
  into_range(in_range);
  precondition(in_range, z);
  into_gauge(z);
}

bool IterativeInverse::descend(const std::vector<double>& b, std::vector<double>& y,
                               const std::function<bool()>* cancelled) const {
  const std::size_t n = b.size();
  const std::uint64_t most = std::max<std::uint64_t>(kFewest, 3 * n);
  std::vector<double> r = b, z(n), Sp(n);
  y.assign(n, 0);
  precondition_in_gauge(r, z);
  double rz = dot(r, z);
  const double goal = kTolerance * kTolerance * rz;
  std::vector<double> p = z;
  PastResiduals past;
  for (std::uint64_t k = 0; k < most && rz > goal; ++k) {
    if (cancelled != nullptr && (*cancelled)()) return false;
    past.keep(r, z, rz);
    multiply(p, Sp);
    const double curvature = dot(p, Sp);
    if (!(curvature > 0)) return false;
    const double step = rz / curvature;
    for (std::size_t c = 0; c < n; ++c) {
      y[c] += step * p[c];
      r[c] -= step * Sp[c];
    }
    past.leave(r);
    precondition_in_gauge(r, z);
    const double next = dot(r, z), keep = next / rz;
    rz = next;
    for (std::size_t c = 0; c < n; ++c) p[c] = z[c] + keep * p[c];
    ++iterations_;
  }
  return rz <= goal;
}

/// rows x columns: C_free of each row of the function; infinite where its solve does not end.
std::vector<double> IterativeInverse::solve(const LinearFunction& function) const {
  const ParameterBlocks& blocks = equations_.blocks();
  const auto n = static_cast<std::size_t>(blocks.columns());
  std::vector<double> out(function.rows * n, 0);
  // Rows are long, and those of other threads would be waited for: each asks by itself.
  const std::function<bool()>* cancelled = cancel_question();
  threads_.for_each(function.rows, [&](std::size_t row) {
    std::vector<double> b(n, 0), y;
    for (const LinearPart& part : function.parts)
      for (std::size_t k = 0; k < blocks.width(part.block); ++k)
        b[static_cast<std::size_t>(blocks.first[part.block]) + k] +=
            part.by[blocks.width(part.block) * row + k];
    into_range(b);
    if (!descend(b, y, cancelled)) {
      ++unfinished_;
      y.assign(n, std::numeric_limits<double>::infinity());
    } else {
      into_gauge(y);
    }
    std::copy(y.begin(), y.end(), &out[n * row]);
  });
  poll_cancelled();
  return out;
}

/// X function^T, X of `rows` rows; infinite on the diagonal and 0 beside it where X is infinite.
std::vector<double> IterativeInverse::applied(const std::vector<double>& X, std::size_t rows,
                                              const LinearFunction& function) const {
  const ParameterBlocks& blocks = equations_.blocks();
  const auto n = static_cast<std::size_t>(blocks.columns());
  std::vector<double> C(rows * function.rows, 0);
  for (std::size_t i = 0; i < rows; ++i) {
    if (std::isinf(X[n * i])) {
      if (i < function.rows) C[function.rows * i + i] = X[n * i];
      continue;
    }
    for (const LinearPart& part : function.parts)
      for (std::size_t j = 0; j < function.rows; ++j)
        for (std::size_t k = 0; k < blocks.width(part.block); ++k)
          C[function.rows * i + j] +=
              X[n * i + static_cast<std::size_t>(blocks.first[part.block]) + k] *
              part.by[blocks.width(part.block) * j + k];
  }
  return C;
}

std::vector<double> IterativeInverse::of(const LinearFunction& function) const {
  std::vector<double> C = applied(solve(function), function.rows, function);
  for (std::size_t i = 0; i < function.rows; ++i)  // what is symmetric but for the solves' ends
    for (std::size_t j = 0; j < i; ++j) {
      double &a = C[function.rows * i + j], &b = C[function.rows * j + i];
      a = b = (a + b) / 2;
    }
  return C;
}

std::vector<double> IterativeInverse::across(std::size_t a, std::size_t b) const {
  return applied(solved_[a], functions_[a].rows, functions_[b]);
}

/// V^-1 + B C_free B^T with B = -V^-1 W^T: where cameras alone are weighed the point's own step in
/// the gauge is what theirs makes of it.
std::array<double, 9> IterativeInverse::of(const NormalEquations::Point& point,
                                           const double* /*X*/) const {
  const ParameterBlocks& blocks = equations_.blocks();
  LinearFunction function;
  function.rows = 3;
  for (std::size_t b = 0; b < point.blocks.size(); ++b) {
    const std::size_t width = blocks.width(point.blocks[b]);
    std::vector<double> by(3 * width, 0);
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < width; ++k)
        for (std::size_t l = 0; l < 3; ++l)
          by[width * i + k] -= point.inverse[3 * i + l] * point.W[b][9 * l + k];
    function.parts.push_back({point.blocks[b], std::move(by)});
  }
  const std::vector<double> C = of(function);
  std::array<double, 9> out = point.inverse;
  for (std::size_t k = 0; k < 9; ++k) out[k] += C[k];
  return out;
}

}  // namespace sheaf
