// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "geometry/rotation.h"
#include "scene/rig_configuration.h"

namespace sheaf {
namespace {

using Vector = Vector3<double>;

double length(const Vector& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

double upper_median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Of offsets, one for each motion: where to go. Weiszfeld's step (each weighs as one over its
/// length) or, with `most`, the mean of those no longer than that.
Vector mean_offset(const std::vector<Vector>& offsets, double most) {
  constexpr double kLeast = 1e-15;
  Vector sum{0, 0, 0};
  double weights = 0;
  for (const Vector& offset : offsets) {
    const double size = length(offset);
    if (most >= 0 && size > most) continue;
    const double weight = most >= 0 ? 1 : 1 / std::max(size, kLeast);
    for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * offset[k];
    weights += weight;
  }
  for (double& x : sum) x /= weights;
  return sum;
}

/// Moves towards the average, by offsets from where it is: `offsets_of(at)` and `move(at, step)`.
template <class State, class OffsetsOf, class Move>
State averaged(State at, const OffsetsOf& offsets_of, const Move& move) {
  constexpr int kSteps = 100;
  for (int i = 0; i < kSteps; ++i) {
    const Vector step = mean_offset(offsets_of(at), -1);
    at = move(at, step);
    if (length(step) < 1e-14) break;
  }
  std::vector<double> sizes;
  for (const Vector& offset : offsets_of(at)) sizes.push_back(length(offset));
  constexpr double kMedians = 3, kRounding = 1e-12;
  const double most = kMedians * upper_median(sizes) + kRounding;
  const State median = at;
  const std::vector<Vector> from_median = offsets_of(median);
  std::vector<bool> counts;
  for (const Vector& offset : from_median) counts.push_back(length(offset) <= most);
  for (int i = 0; i < kSteps; ++i) {
    std::vector<Vector> kept;
    const std::vector<Vector> all = offsets_of(at);
    for (std::size_t k = 0; k < all.size(); ++k)
      if (counts[k]) kept.push_back(all[k]);
    const Vector step = mean_offset(kept, INFINITY);
    at = move(at, step);
    if (length(step) < 1e-15) break;
  }
  return at;
}

/// The rotation vector from one rotation to another, radians.
Vector between(const Quaternion<double>& from, const Quaternion<double>& to) {
  const Quaternion<double> back{from[0], -from[1], -from[2], -from[3]};
  Quaternion<double> turn = multiply(to, back);
  if (turn[0] < 0)
    for (double& q : turn) q = -q;
  return angle_axis_from_quaternion(turn);
}

}  // namespace

Pose robust_mean(const std::vector<Pose>& motions) {
  if (motions.size() == 1) return motions[0];
  Pose out;
  out.rotation = averaged(
      motions[0].rotation,
      [&](const Quaternion<double>& at) {
        std::vector<Vector> offsets;
        for (const Pose& motion : motions) offsets.push_back(between(at, motion.rotation));
        return offsets;
      },
      [](const Quaternion<double>& at, const Vector& step) {
        return normalized(multiply(quaternion_from_angle_axis(step), at));
      });
  out.translation = averaged(
      motions[0].translation,
      [&](const Vector& at) {
        std::vector<Vector> offsets;
        for (const Pose& motion : motions) {
          Vector& offset = offsets.emplace_back();
          for (std::size_t k = 0; k < 3; ++k) offset[k] = motion.translation[k] - at[k];
        }
        return offsets;
      },
      [](Vector at, const Vector& step) {
        for (std::size_t k = 0; k < 3; ++k) at[k] += step[k];
        return at;
      });
  return out;
}

}  // namespace sheaf
