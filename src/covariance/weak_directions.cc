// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/weak_directions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>
#include <utility>

#include "geometry/camera_model.h"
#include "platform/cancel.h"
#include "platform/real_text.h"
#include "starts/bearing.h"
#include "starts/sights.h"

namespace sheaf {
namespace {

/// The farthest that a unit of each parameter moves a pixel: an observed one, or a corner of the
/// image, which lies where the lens without its distortion has it.
using Reach = std::array<double, kMaxCameraParameters>;

void widen(const Camera& camera, const Vector3<double>& P, Reach& reach) {
  const LensJacobian<double> lens = project_with_jacobian(camera, P);
  for (std::size_t p = 0; p < parameter_count(camera.model); ++p)
    if (const double moved = std::hypot(lens.parameters[0][p], lens.parameters[1][p]);
        std::isfinite(moved))
      reach[p] = std::max(reach[p], moved);
}

void widen_to_corners(const Camera& camera, Reach& reach) {
  if (camera.width_px == 0 || camera.height_px == 0) return;
  const Camera plain = without_distortion(camera);
  for (const double x : {0.0, static_cast<double>(camera.width_px)})
    for (const double y : {0.0, static_cast<double>(camera.height_px)}) {
      const double corner[] = {x, y};
      if (const auto ray = bearing(plain, corner)) widen(plain, *ray, reach);
    }
}

std::vector<Reach> reach_of(const Problem& problem) {
  std::vector<Reach> out(problem.cameras.size(), Reach{});
  std::vector<Matrix3<double>> R;
  for (const Pose& pose : problem.poses) R.push_back(matrix_from_quaternion(pose.rotation));
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    if (i % 4096 == 0) poll_cancelled();
    const std::uint32_t image = problem.observation_image[i];
    const std::uint32_t camera = problem.image_camera[image];
    const double* X = &problem.points[3 * std::size_t(problem.observation_point[i])];
    widen(problem.cameras[camera], in_camera(R[image], problem.poses[image], X), out[camera]);
  }
  for (std::size_t c = 0; c < out.size(); ++c) widen_to_corners(problem.cameras[c], out[c]);
  return out;
}

/// What is found of one lens, with how far it is beyond its limit.
class LensWeakness {
 public:
  LensWeakness(const Camera& camera, std::uint32_t index, const std::vector<double>& C,
               const Reach& reach)
      : camera_(camera),
        index_(index),
        C_(C),
        reach_(reach),
        n_(parameter_count(camera.model)),
        names_(parameter_names(camera.model)) {}

  void find(std::vector<std::pair<double, WeakDirection>>& to) const {
    for (std::uint32_t p = 0; p < n_; ++p) find_one(p, to);
    for (std::uint32_t a = 0; a < n_; ++a)
      for (std::uint32_t b = a + 1; b < n_; ++b) find_pair(a, b, to);
  }

 private:
  double sigma(std::size_t p) const { return std::sqrt(C_[(n_ + 1) * p]); }
  std::string of() const { return " of camera " + std::to_string(index_); }

  void find_one(std::uint32_t p, std::vector<std::pair<double, WeakDirection>>& to) const {
    const ParameterRoles roles = roles_of(camera_.model);
    const auto role = static_cast<int>(p);
    const bool focal = role == roles.fx || role == roles.fy;
    const bool centre = role == roles.cx || role == roles.cy;
    const double s = sigma(p), limit = focal    ? kWeakFocal * std::abs(camera_.parameters[p])
                                       : centre ? kWeakCentre_px
                                                : kWeakCorner_px / reach_[p];
    if (!(s > limit)) return;
    std::string words = std::string(names_[p]) + of() + " is not determined";
    if (std::isfinite(s))
      words +=
          ": its sigma " + few_digits(s, 4) +
          (focal || centre ? std::string(" px")
                           : " moves a pixel by up to " + few_digits(s * reach_[p], 4) + " px");
    to.push_back({s / limit, {words, index_, {p}, s, 0}});
  }
  void find_pair(std::uint32_t a, std::uint32_t b,
                 std::vector<std::pair<double, WeakDirection>>& to) const {
    const double both = sigma(a) * sigma(b);
    if (!(both > 0) || std::isinf(both)) return;
    const double correlation = C_[n_ * a + b] / both;
    if (!(std::abs(correlation) > kWeakCorrelation)) return;
    char text[32];
    std::snprintf(text, sizeof text, "%.6f", correlation);
    to.push_back({1,
                  {std::string(names_[a]) + " and " + std::string(names_[b]) + of() +
                       " cannot be told apart: correlation " + text,
                   index_,
                   {a, b},
                   0,
                   correlation}});
  }

  const Camera& camera_;
  const std::uint32_t index_;
  const std::vector<double>& C_;
  const Reach& reach_;
  const std::size_t n_;
  const std::vector<std::string_view> names_;
};

}  // namespace

std::vector<WeakDirection> weak_directions(const Problem& problem,
                                           const std::vector<std::vector<double>>& lenses) {
  const std::vector<Reach> reach = reach_of(problem);
  std::vector<std::pair<double, WeakDirection>> found;
  for (std::uint32_t c = 0; c < lenses.size(); ++c)
    if (!lenses[c].empty()) LensWeakness(problem.cameras[c], c, lenses[c], reach[c]).find(found);
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<WeakDirection> out;
  for (auto& [beyond, weak] : found) out.push_back(std::move(weak));
  return out;
}

}  // namespace sheaf
