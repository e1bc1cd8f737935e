// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/alignment.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace sheaf {
namespace {

using Matrix4 = std::array<std::array<double, 4>, 4>;

double weight_at(const std::vector<double>& weights, std::size_t i) {
  return weights.empty() ? 1 : weights[i];
}

Vector3<double> mean_of(const std::vector<Vector3<double>>& points,
                        const std::vector<double>& weights) {
  Vector3<double> sum{};
  double total = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double w = weight_at(weights, i);
    total += w;
    for (int k = 0; k < 3; ++k) sum[k] += w * points[i][k];
  }
  for (double& x : sum) x /= total;
  return sum;
}

// One Jacobi rotation in the plane (p, q): A <- G^T A G, V <- V G, so that A[p][q] = 0.
void rotate(Matrix4& A, Matrix4& V, int p, int q) {
  if (A[p][q] == 0) return;
  const double theta = (A[q][q] - A[p][p]) / (2 * A[p][q]);
  const double t = (theta < 0 ? -1 : 1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
  const double c = 1 / std::sqrt(t * t + 1);
  const double s = t * c;
  for (int k = 0; k < 4; ++k) {
    const double x = A[k][p], y = A[k][q];
    A[k][p] = c * x - s * y, A[k][q] = s * x + c * y;
  }
  for (int k = 0; k < 4; ++k) {
    const double x = A[p][k], y = A[q][k];
    A[p][k] = c * x - s * y, A[q][k] = s * x + c * y;
  }
  for (int k = 0; k < 4; ++k) {
    const double x = V[k][p], y = V[k][q];
    V[k][p] = c * x - s * y, V[k][q] = s * x + c * y;
  }
}

// (eigenvalue, its eigenvector), largest first.
std::array<std::pair<double, Quaternion<double>>, 4> eigenvectors(Matrix4 A) {
  Matrix4 V{};
  for (int i = 0; i < 4; ++i) V[i][i] = 1;
  for (int sweep = 0; sweep < 30; ++sweep)
    for (int p = 0; p < 3; ++p)
      for (int q = p + 1; q < 4; ++q) rotate(A, V, p, q);
  std::array<std::pair<double, Quaternion<double>>, 4> out;
  for (int i = 0; i < 4; ++i) out[i] = {A[i][i], {V[0][i], V[1][i], V[2][i], V[3][i]}};
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  return out;
}

}  // namespace

Vector3<double> Similarity::operator()(const Vector3<double>& X) const {
  Vector3<double> out = multiply(matrix_from_quaternion(rotation), X);
  for (int k = 0; k < 3; ++k) out[k] = scale * out[k] + translation[k];
  return out;
}

Alignment align(const std::vector<Vector3<double>>& from, const std::vector<Vector3<double>>& to,
                const std::vector<double>& weights) {
  if (from.empty()) return {};
  const Vector3<double> a = mean_of(from, weights), b = mean_of(to, weights);
  double S[3][3] = {};  // sum of w (from - a) (to - b)^T
  double from_square = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double w = weight_at(weights, i);
    for (int r = 0; r < 3; ++r) {
      const double x = from[i][r] - a[r];
      from_square += w * x * x;
      for (int c = 0; c < 3; ++c) S[r][c] += w * x * (to[i][c] - b[c]);
    }
  }
  const double yz = S[1][2] - S[2][1], zx = S[2][0] - S[0][2], xy = S[0][1] - S[1][0];
  const Matrix4 N = {{{S[0][0] + S[1][1] + S[2][2], yz, zx, xy},
                      {yz, S[0][0] - S[1][1] - S[2][2], S[0][1] + S[1][0], S[2][0] + S[0][2]},
                      {zx, S[0][1] + S[1][0], S[1][1] - S[0][0] - S[2][2], S[1][2] + S[2][1]},
                      {xy, S[2][0] + S[0][2], S[1][2] + S[2][1], S[2][2] - S[0][0] - S[1][1]}}};
  const auto eigen = eigenvectors(N);
  Similarity out;
  out.rotation = normalized(eigen[0].second);
  // At the optimum trace(R S) is the largest eigenvalue, and s = trace(R S) / sum |from - a|^2.
  if (from_square > 0) out.scale = eigen[0].first / from_square;
  const Vector3<double> moved = out(a);
  for (int k = 0; k < 3; ++k) out.translation[k] = b[k] - moved[k];
  const double largest = std::fabs(eigen[0].first);
  return {out, largest > 0 ? (eigen[0].first - eigen[1].first) / largest : 0};
}

}  // namespace sheaf
