// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/errors.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "geometry/rotation.h"
#include "report/alignment.h"

namespace sheaf {
namespace {

Quaternion<double> conjugate(const Quaternion<double>& q) { return {q[0], -q[1], -q[2], -q[3]}; }

double distance(const Vector3<double>& a, const Vector3<double>& b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

std::vector<Vector3<double>> centers_of(const Problem& problem) {
  std::vector<Vector3<double>> out;
  for (const Pose& pose : problem.poses) {
    Vector3<double> c = multiply(matrix_from_quaternion(conjugate(pose.rotation)),
                                 Vector3<double>(pose.translation));
    for (double& x : c) x = -x;
    out.push_back(c);
  }
  return out;
}

std::vector<Vector3<double>> points_of(const Problem& problem) {
  std::vector<Vector3<double>> out;
  for (std::size_t i = 0; i < problem.num_points(); ++i)
    out.push_back({problem.points[3 * i], problem.points[3 * i + 1], problem.points[3 * i + 2]});
  return out;
}

// Below this certainty noise in the places turns the whole scene.
constexpr double kCertain = 0.01;

Alignment alignment_between(const Problem& estimate, const Problem& reference) {
  const Alignment by_centers = align(centers_of(estimate), centers_of(reference));
  if (by_centers.certainty > kCertain) return by_centers;
  return align(points_of(estimate), points_of(reference));
}

}  // namespace

ErrorStatistics statistics_of_errors(std::vector<double> values) {
  if (values.empty()) return {};
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  double sum = 0, squares = 0;
  for (const double x : values) sum += x, squares += x * x;
  return {sum / static_cast<double>(n), (values[(n - 1) / 2] + values[n / 2]) / 2,
          std::sqrt(squares / static_cast<double>(n)), values.back()};
}

Result<StateErrors> compare_states(const Problem& estimate, const Problem& reference,
                                   bool aligned) {
  if (estimate.num_images() != reference.num_images() ||
      estimate.num_points() != reference.num_points())
    return Error(ErrorCode::usage, "the estimate has " + std::to_string(estimate.num_images()) +
                                       " images and " + std::to_string(estimate.num_points()) +
                                       " points, the reference " +
                                       std::to_string(reference.num_images()) + " and " +
                                       std::to_string(reference.num_points()));
  Similarity similarity;
  if (aligned) {
    const Alignment found = alignment_between(estimate, reference);
    aligned = found.certainty > 1e-6;
    if (aligned) similarity = found.similarity;
  }
  const auto centers = centers_of(estimate), reference_centers = centers_of(reference);
  std::vector<double> rotation, translation, center, point;
  for (std::size_t j = 0; j < estimate.num_images(); ++j) {
    const Pose& want = reference.poses[j];
    const Quaternion<double> q =
        multiply(Quaternion<double>(estimate.poses[j].rotation), conjugate(similarity.rotation));
    const Vector3<double> phi = angle_axis_from_quaternion(multiply(q, conjugate(want.rotation)));
    rotation.push_back(distance(phi, {}));
    const Vector3<double> c = similarity(centers[j]);
    center.push_back(distance(c, reference_centers[j]));
    Vector3<double> t = multiply(matrix_from_quaternion(q), c);
    for (double& x : t) x = -x;
    translation.push_back(distance(t, want.translation));
  }
  const auto points = points_of(estimate), reference_points = points_of(reference);
  for (std::size_t i = 0; i < points.size(); ++i)
    point.push_back(distance(similarity(points[i]), reference_points[i]));
  return StateErrors{aligned,
                     similarity.scale,
                     statistics_of_errors(std::move(rotation)),
                     statistics_of_errors(std::move(translation)),
                     statistics_of_errors(std::move(center)),
                     statistics_of_errors(std::move(point))};
}

}  // namespace sheaf
