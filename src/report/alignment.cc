// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/alignment.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "geometry/best_rotation.h"

namespace sheaf {
namespace {

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

}  // namespace

Alignment align(const std::vector<Vector3<double>>& from, const std::vector<Vector3<double>>& to,
                const std::vector<double>& weights, AlignScale scale) {
  if (from.empty()) return {};
  const Vector3<double> a = mean_of(from, weights), b = mean_of(to, weights);
  Matrix3<double> S{};  // sum of w (from - a) (to - b)^T
  double from_square = 0;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const double w = weight_at(weights, i);
    for (int r = 0; r < 3; ++r) {
      const double x = from[i][r] - a[r];
      from_square += w * x * x;
      for (int c = 0; c < 3; ++c) S[3 * r + c] += w * x * (to[i][c] - b[c]);
    }
  }
  const BestRotation best = best_rotation(S);
  Similarity out;
  out.rotation = best.rotation;
  // At the optimum s = trace(R S) / sum |from - a|^2.
  if (scale == AlignScale::free && from_square > 0) out.scale = best.trace / from_square;
  const Vector3<double> moved = out(a);
  for (int k = 0; k < 3; ++k) out.translation[k] = b[k] - moved[k];
  return {out, best.certainty};
}

std::vector<Vector3<double>> camera_centers(const Problem& problem) {
  std::vector<Vector3<double>> out;
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    const Pose pose = pose_of(problem, j);
    const Quaternion<double>& q = pose.rotation;
    Vector3<double> c =
        multiply(matrix_from_quaternion(Quaternion<double>{q[0], -q[1], -q[2], -q[3]}),
                 Vector3<double>(pose.translation));
    for (double& x : c) x = -x;
    out.push_back(c);
  }
  return out;
}

}  // namespace sheaf
