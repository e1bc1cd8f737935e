// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/recycled_modes.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace sheaf {
namespace {

/// Shorter runs show no eigenvector well enough.
constexpr std::size_t kFewestIterations = 4;
/// Modes that cost iterations: the preconditioner brings most eigenvalues near 1.
constexpr double kSmall = 0.5;
/// Of |S y - theta H^-1 y|^2 against theta: how well a mode must be known.
constexpr double kKnown = 0.1;

}  // namespace

void RecycledModes::begin() { iterates_.clear(); }

void RecycledModes::add(const double* z, double rz, double alpha) {
  if (iterates_.size() == kBasis) return;
  if (basis_.size() == 0) basis_.allocate(kBasis * length_);
  float* to = &basis_[length_ * iterates_.size()];
  const double by = 1 / std::sqrt(rz);
  for (std::size_t i = 0; i < length_; ++i) to[i] = static_cast<float>(by * z[i]);
  iterates_.push_back({rz, alpha});
}

/// Lanczos' tridiagonal matrix from the coefficients of conjugate gradients (Saad 2003, 6.7.3).
void RecycledModes::end(double rz) {
  const std::size_t n = iterates_.size();
  if (n < kFewestIterations || !(rz > 0)) return;
  Eigen::VectorXd diagonal(n), off(n - 1);
  double left = 0;  // beta / alpha of the iteration before
  double last = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const double beta = (i + 1 < n ? iterates_[i + 1].rz : rz) / iterates_[i].rz;
    const double alpha = iterates_[i].alpha;
    const auto at = static_cast<Eigen::Index>(i);
    diagonal[at] = 1 / alpha + left;
    left = beta / alpha;
    last = std::sqrt(beta) / alpha;
    if (i + 1 < n) off[at] = -last;
  }
  if (!diagonal.allFinite() || !off.allFinite()) return;
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver;
  solver.computeFromTridiagonal(diagonal, off);
  if (solver.info() != Eigen::Success) return;
  for (Eigen::Index j = 0; j < static_cast<Eigen::Index>(n); ++j) {  // ascending
    const double theta = solver.eigenvalues()[j];
    if (!(theta > 0)) continue;
    if (theta > kSmall) break;
    const double off_by = last * solver.eigenvectors()(static_cast<Eigen::Index>(n) - 1, j);
    if (off_by * off_by > kKnown * theta) continue;
    std::vector<double> of_basis(n);
    for (std::size_t i = 0; i < n; ++i)
      of_basis[i] = solver.eigenvectors()(static_cast<Eigen::Index>(i), j);
    keep(of_basis, theta);
  }
}

void RecycledModes::keep(const std::vector<double>& of_basis, double theta) {
  if (modes_.size() == 0) modes_.allocate(kMost * length_);
  weight_.resize(kMost);
  float* y = &modes_[length_ * next_];
  constexpr std::size_t kBlock = 512;
  double sum[kBlock];
  for (std::size_t first = 0; first < length_; first += kBlock) {
    const std::size_t count = std::min(kBlock, length_ - first);
    std::fill_n(sum, count, 0.0);
    for (std::size_t b = 0; b < of_basis.size(); ++b) {
      const float* u = &basis_[length_ * b + first];
      for (std::size_t i = 0; i < count; ++i) sum[i] += of_basis[b] * u[i];
    }
    for (std::size_t i = 0; i < count; ++i) y[first + i] = static_cast<float>(sum[i]);
  }
  weight_[next_] = 1 / theta - 1;
  next_ = (next_ + 1) % kMost;
  kept_ = std::min(kept_ + 1, kMost);
}

void RecycledModes::correct(const double* r, double* z) const {
  for (std::size_t j = 0; j < kept_; ++j) {
    const float* y = &modes_[length_ * j];
    double lanes[8] = {};
    for (std::size_t i = 0; i < length_; i += 8)
      for (std::size_t l = 0; l < 8; ++l) lanes[l] += y[i + l] * r[i + l];
    const double by = weight_[j] * (((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
                                    ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7])));
    for (std::size_t i = 0; i < length_; ++i) z[i] += by * y[i];
  }
}

RecycledModes::History RecycledModes::history() const {
  History out{kept_, next_, {}, weight_};
  out.modes.assign(modes_.begin(), modes_.begin() + kept_ * length_);
  return out;
}

bool RecycledModes::restore(const History& history) {
  if (history.kept > kMost || history.next >= kMost || history.weights.size() > kMost ||
      history.weights.size() < history.kept || history.modes.size() != history.kept * length_)
    return false;
  kept_ = history.kept;
  next_ = history.next;
  weight_ = history.weights;
  if (kept_ == 0) return true;
  if (modes_.size() == 0) modes_.allocate(kMost * length_);
  std::copy(history.modes.begin(), history.modes.end(), modes_.begin());
  return true;
}

}  // namespace sheaf
