// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/errors.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry/rotation.h"
#include "report/rig_errors.h"
#include "scene/camera_frame.h"

namespace sheaf {
namespace {

Quaternion<double> conjugate(const Quaternion<double>& q) { return {q[0], -q[1], -q[2], -q[3]}; }

double distance(const Vector3<double>& a, const Vector3<double>& b) {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

std::vector<Vector3<double>> points_of(const Problem& problem) {
  std::vector<Vector3<double>> out;
  for (std::size_t i = 0; i < problem.num_points(); ++i)
    out.push_back({problem.points[3 * i], problem.points[3 * i + 1], problem.points[3 * i + 2]});
  return out;
}

bool looks_along_minus_z(const Problem& problem, std::size_t image) {
  return problem.cameras[problem.image_camera[image]].model == CameraModel::bal;
}

// Below this certainty noise in the places turns the whole scene.
constexpr double kCertain = 0.01;

StateAlignment alignment_of(const std::vector<Vector3<double>>& from,
                            const std::vector<Vector3<double>>& to, AlignBy align_by,
                            double certain) {
  Alignment found;
  StateAlignment out;
  out.places = out.inliers = from.size();
  if (align_by == AlignBy::robust) {
    const RobustAlignment robust = align_robustly(from, to);
    found = robust.alignment;
    out.inliers = robust.inliers;
  } else {
    found = align(from, to);
  }
  out.aligned = found.certainty > certain;
  if (out.aligned) out.similarity = found.similarity;
  return out;
}

StateAlignment alignment_between(const Problem& estimate, const Problem& reference,
                                 AlignBy align_by) {
  if (align_by == AlignBy::nothing) return {};
  const StateAlignment by_centers =
      alignment_of(camera_centers(estimate), camera_centers(reference), align_by, kCertain);
  if (by_centers.aligned) return by_centers;
  StateAlignment by_points =
      alignment_of(points_of(estimate), points_of(reference), align_by, 1e-6);
  by_points.by_points = true;
  return by_points;
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

Result<ErrorLists> list_errors(const Problem& all_of_estimate, const Problem& all_of_reference,
                               AlignBy align_by) {
  Result<Matching> matched = match_models(all_of_estimate, all_of_reference);
  if (!matched.ok()) return matched.error();
  ErrorLists out;
  out.matching = std::move(matched).value();
  Problem parts[2];
  if (!out.matching.in_order) {
    parts[0] = common_of_estimate(all_of_estimate, out.matching);
    parts[1] = common_of_reference(all_of_reference, out.matching);
  }
  const Problem& estimate = out.matching.in_order ? all_of_estimate : parts[0];
  const Problem& reference = out.matching.in_order ? all_of_reference : parts[1];
  out.alignment = alignment_between(estimate, reference, align_by);
  const Similarity& similarity = out.alignment.similarity;
  const auto centers = camera_centers(estimate), reference_centers = camera_centers(reference);
  for (std::size_t j = 0; j < estimate.num_images(); ++j) {
    const Pose want = pose_of(reference, j);
    Pose have = pose_of(estimate, j);
    if (looks_along_minus_z(estimate, j) != looks_along_minus_z(reference, j))
      turn_round(have, false);
    const Quaternion<double> q =
        multiply(Quaternion<double>(have.rotation), conjugate(similarity.rotation));
    const Vector3<double> phi = angle_axis_from_quaternion(multiply(q, conjugate(want.rotation)));
    out.rotation_rad.push_back(distance(phi, {}));
    const Vector3<double> c = similarity(centers[j]);
    out.center.push_back(distance(c, reference_centers[j]));
    Vector3<double> t = multiply(matrix_from_quaternion(q), c);
    for (double& x : t) x = -x;
    // Unaligned, t is as it stands: through the centre it would lose digits.
    if (!out.alignment.aligned) t = have.translation;
    out.translation.push_back(distance(t, want.translation));
  }
  const auto points = points_of(estimate), reference_points = points_of(reference);
  for (std::size_t i = 0; i < points.size(); ++i)
    out.point.push_back(distance(similarity(points[i]), reference_points[i]));
  out.rigs = list_rig_errors(estimate, reference, similarity);
  return out;
}

StateErrors summarise(const ErrorLists& lists) {
  return {lists.alignment.aligned,
          lists.alignment.similarity.scale,
          statistics_of_errors(lists.rotation_rad),
          statistics_of_errors(lists.translation),
          statistics_of_errors(lists.center),
          statistics_of_errors(lists.point),
          lists.matching.has_points,
          !lists.rigs.frame_center.empty(),
          statistics_of_errors(lists.rigs.frame_rotation_rad),
          statistics_of_errors(lists.rigs.frame_center),
          statistics_of_errors(lists.rigs.sensor_rotation_rad),
          statistics_of_errors(lists.rigs.sensor_translation)};
}

Result<StateErrors> compare_states(const Problem& estimate, const Problem& reference,
                                   bool aligned) {
  const Result<ErrorLists> lists =
      list_errors(estimate, reference, aligned ? AlignBy::least_squares : AlignBy::nothing);
  if (!lists.ok()) return lists.error();
  return summarise(lists.value());
}

}  // namespace sheaf
