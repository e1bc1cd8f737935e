// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/clean.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "geometry/rotation.h"
#include "inspect/covisibility.h"
#include "platform/parallel.h"
#include "scene/camera_plane.h"
#include "scene/point_errors.h"
#include "scene/rigs.h"
#include "scene/subset.h"

namespace sheaf {
namespace {

constexpr std::size_t kMostRays = 64;

std::vector<Vector3<double>> centres_of(const Problem& problem) {
  std::vector<Vector3<double>> centres;
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    const Pose pose = pose_of(problem, j);
    const auto& [w, x, y, z] = pose.rotation;
    const auto& t = pose.translation;
    centres.push_back(multiply(matrix_from_quaternion<double>({w, -x, -y, -z}),
                               Vector3<double>{-t[0], -t[1], -t[2]}));
  }
  return centres;
}

/// Images that see each point, those of point i from begin[i] to begin[i + 1].
struct Viewers {
  std::vector<std::uint64_t> begin;
  std::vector<std::uint32_t> images;
};

Viewers viewers_of(const Problem& problem, const std::vector<bool>& kept) {
  Viewers viewers;
  viewers.begin.assign(problem.num_points() + 1, 0);
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (kept[i]) ++viewers.begin[problem.observation_point[i] + 1];
  for (std::size_t p = 0; p < problem.num_points(); ++p) viewers.begin[p + 1] += viewers.begin[p];
  viewers.images.resize(viewers.begin.back());
  std::vector<std::uint64_t> next(viewers.begin.begin(), viewers.begin.end() - 1);
  for (std::size_t i = 0; i < kept.size(); ++i)
    if (kept[i])
      viewers.images[next[problem.observation_point[i]]++] = problem.observation_image[i];
  return viewers;
}

/// The angle between two rays by numbers that are in proportion to its sine and cosine.
struct RayAngle {
  double sine = 0, cosine = 0;

  double radians() const { return std::atan2(sine, cosine); }
  /// Smaller, and not by rounding.
  bool clearly_below(const RayAngle& other) const {
    const double a = sine * other.cosine, b = cosine * other.sine;
    return a - b < -1e-12 * (std::abs(a) + std::abs(b));
  }
};

RayAngle angle_between(const Vector3<double>& a, const Vector3<double>& b) {
  const Vector3<double> c = cross(a, b);
  return {std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]),
          a[0] * b[0] + a[1] * b[1] + a[2] * b[2]};
}

/// Between any two, rad; 0 of fewer than two. Arc tangents, which take most of the time, are for
/// those alone that may be the widest.
double widest_angle(const std::vector<Vector3<double>>& rays, std::vector<RayAngle>& angles) {
  angles.clear();
  RayAngle wide{0, 1};
  for (std::size_t a = 0; a < rays.size(); ++a)
    for (std::size_t b = 0; b < a; ++b) {
      angles.push_back(angle_between(rays[a], rays[b]));
      if (wide.clearly_below(angles.back())) wide = angles.back();
    }
  double widest = 0;
  for (const RayAngle& angle : angles)
    if (!angle.clearly_below(wide)) widest = std::max(widest, angle.radians());
  return widest;
}

/// An observation is in one list: at the centre, in the plane, or else behind.
void find_behind(const Problem& problem, CleanRecord& record) {
  PlaneSights sights = plane_sights(problem);
  record.in_plane = std::move(sights.in_plane);
  record.at_centre = std::move(sights.at_centre);
  std::vector<bool> named(problem.num_observations(), false);
  for (const auto* list : {&record.in_plane, &record.at_centre})
    for (const std::uint64_t i : *list) named[i] = true;
  record.behind = evaluate(problem).behind;
  std::erase_if(record.behind, [&](std::uint64_t i) { return named[i]; });
}

}  // namespace

std::vector<double> ray_angles_deg(const Problem& problem, const std::vector<bool>& kept,
                                   int threads) {
  const std::vector<Vector3<double>> centres = centres_of(problem);
  const Viewers viewers = viewers_of(problem, kept);
  std::vector<double> angles(problem.num_points(), 0);
  constexpr std::size_t kEach = 1 << 14;
  Threads(threads).for_ranges(angles.size(), kEach, [&](std::size_t first, std::size_t end) {
    std::vector<Vector3<double>> rays;
    std::vector<RayAngle> pairs;
    for (std::size_t p = first; p < end; ++p) {
      const std::uint64_t begin = viewers.begin[p], length = viewers.begin[p + 1] - begin;
      const std::uint64_t step = (length + kMostRays - 1) / kMostRays;
      rays.clear();
      for (std::uint64_t k = 0; k < length; k += step) {
        const Vector3<double>& c = centres[viewers.images[begin + k]];
        rays.push_back({problem.points[3 * p] - c[0], problem.points[3 * p + 1] - c[1],
                        problem.points[3 * p + 2] - c[2]});
      }
      angles[p] = widest_angle(rays, pairs) * (180 / std::numbers::pi);
    }
  });
  return angles;
}

Repetitions repetitions_in(const Problem& problem) {
  // A point's observations by image, those of one image in their own order: repetitions are
  // neighbours.
  const Tracks tracks = tracks_of(problem);
  Repetitions out;
  for (std::size_t p = 0; p < problem.num_points(); ++p)
    for (std::uint64_t k = tracks.begin[p] + 1; k < tracks.begin[p + 1]; ++k) {
      const std::uint64_t before = tracks.order[k - 1], at = tracks.order[k];
      if (problem.observation_image[before] != problem.observation_image[at]) continue;
      const double* a = &problem.observation_xy[2 * before];
      const double* b = &problem.observation_xy[2 * at];
      (a[0] == b[0] && a[1] == b[1] ? out.same_pixel : out.other_pixel).push_back(at);
    }
  std::sort(out.same_pixel.begin(), out.same_pixel.end());
  std::sort(out.other_pixel.begin(), out.other_pixel.end());
  return out;
}

CleanRecord clean(Problem& problem, const CleanOptions& options) {
  CleanRecord record;
  const std::size_t observations = problem.num_observations();
  std::vector<bool> kept(observations, true);
  if (options.max_error_px > 0) {
    const std::vector<double> lengths = residual_lengths(problem);
    for (std::size_t i = 0; i < observations; ++i)
      if (!(lengths[i] <= options.max_error_px)) record.far_off.push_back(i);
  }
  if (options.behind) find_behind(problem, record);
  if (options.repeated) record.repeated = repetitions_in(problem).same_pixel;
  for (const auto* list :
       {&record.far_off, &record.behind, &record.in_plane, &record.at_centre, &record.repeated})
    for (const std::uint64_t i : *list) kept[i] = false;
  std::vector<bool> narrow(problem.num_points(), false);
  if (options.min_angle_deg > 0) {
    const std::vector<double> angles = ray_angles_deg(problem, kept);
    for (std::size_t p = 0; p < angles.size(); ++p)
      if (angles[p] < options.min_angle_deg) narrow[p] = true, record.narrow.push_back(p);
  }
  for (std::size_t i = 0; i < observations; ++i)
    if (narrow[problem.observation_point[i]]) kept[i] = false;
  const std::uint32_t least = std::max<std::uint32_t>(options.min_track, options.any() ? 1 : 0);
  const std::vector<std::uint32_t> numbers = keep_observations(problem, kept, least);
  for (std::size_t p = 0; p < numbers.size(); ++p)
    if (numbers[p] == kGonePoint && !narrow[p]) record.short_tracks.push_back(p);
  record.observations = observations - problem.num_observations();
  return record;
}

}  // namespace sheaf
