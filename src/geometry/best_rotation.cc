// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/best_rotation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace sheaf {
namespace {

using Matrix4 = std::array<std::array<double, 4>, 4>;

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

BestRotation best_rotation(const Matrix3<double>& S) {
  const double yz = S[5] - S[7], zx = S[6] - S[2], xy = S[1] - S[3];
  const Matrix4 N = {{{S[0] + S[4] + S[8], yz, zx, xy},
                      {yz, S[0] - S[4] - S[8], S[1] + S[3], S[6] + S[2]},
                      {zx, S[1] + S[3], S[4] - S[0] - S[8], S[5] + S[7]},
                      {xy, S[6] + S[2], S[5] + S[7], S[8] - S[0] - S[4]}}};
  const auto eigen = eigenvectors(N);
  const double largest = std::fabs(eigen[0].first);
  return {normalized(eigen[0].second), eigen[0].first,
          largest > 0 ? (eigen[0].first - eigen[1].first) / largest : 0};
}

}  // namespace sheaf
