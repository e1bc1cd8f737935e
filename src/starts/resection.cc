// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "starts/resection.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "geometry/best_rotation.h"
#include "geometry/camera_model.h"
#include "geometry/rigid_motion.h"
#include "starts/bearing.h"
#include "starts/block_descent.h"

namespace sheaf {
namespace {

constexpr int kTrials = 30;
/// So many observations, evenly spread, are enough for a start.
constexpr std::size_t kEnough = 300;
/// A focal length that leaves this many times what it was is no lens of the image's.
constexpr double kFarthestFocal = 30;

struct View {
  Pose pose;
  Camera camera;
};

/// Pose and free lens parameters of one image, its points held.
class ImageBlock {
 public:
  static constexpr std::size_t kMost = 6 + kMaxCameraParameters;
  ImageBlock(const Sights& sights, const std::vector<double>& points,
             const std::vector<std::uint64_t>& seen, const ScaledLoss& loss, bool pose_free,
             ParameterSet lens_held, View start)
      : sights_(sights), points_(points), seen_(seen), loss_(loss), held_(start) {
    const ParameterRoles roles = roles_of(held_.camera.model);
    for (int role : {roles.fx, roles.fy}) {
      if (role < 0) continue;
      const auto k = static_cast<std::size_t>(role);
      focals_.push_back({k, std::fabs(held_.camera.parameters[k])});
    }
    poses_ = pose_free ? 6 : 0;
    for (std::size_t k = 0; k < parameter_count(held_.camera.model); ++k)
      if (!(lens_held >> k & 1)) lens_.push_back(k);
  }

  std::size_t size() const { return poses_ + lens_.size(); }

  Fit linearise(NormalEquations<kMost>& N) const {
    N.size = size();
    N.clear();
    const Matrix3<double> R = matrix_from_quaternion(held_.pose.rotation);
    Fit fit;
    for (std::uint64_t i : seen_) {
      const Vector3<double> P =
          in_camera(R, held_.pose, &points_[3 * std::size_t(sights_.point(i))]);
      const LensJacobian<double> at = project_with_jacobian(held_.camera, P);
      const std::array<double, 2> r = residual(held_.camera, at.pixel, sights_.pixel(i));
      const auto rho = evaluate_loss(loss_, r[0] * r[0] + r[1] * r[1]);
      std::array<std::array<double, kMost>, 2> J;
      for (std::size_t row = 0; row < 2; ++row) {
        const auto& d = at.point[row];
        if (poses_ > 0) {
          const Vector3<double> turned = cross(P, {d[0], d[1], d[2]});
          for (std::size_t k = 0; k < 3; ++k) J[row][k] = d[k], J[row][3 + k] = turned[k];
        }
        for (std::size_t k = 0; k < lens_.size(); ++k)
          J[row][poses_ + k] = at.parameters[row][lens_[k]];
      }
      N.add(J, r, rho.first);
      fit += {0.5 * rho.value, sees(held_.camera, P) ? 0u : 1u};
    }
    return fit;
  }
  Fit attempt(const std::array<double, kMost>& step) {
    tried_ = held_;
    if (poses_ > 0) {
      const RigidMotion<double> moved =
          left_perturbed(RigidMotion<double>{held_.pose.rotation, held_.pose.translation},
                         {step[0], step[1], step[2]}, {step[3], step[4], step[5]});
      tried_.pose = {moved.rotation, moved.translation};
    }
    for (std::size_t k = 0; k < lens_.size(); ++k)
      tried_.camera.parameters[lens_[k]] += step[poses_ + k];
    for (const auto& [k, start] : focals_) {
      const double f = tried_.camera.parameters[k];
      if (!(f * kFarthestFocal > start && f < start * kFarthestFocal))
        return {std::numeric_limits<double>::infinity(), 0};
    }
    return fit(tried_);
  }
  void take() { held_ = tried_; }
  const View& view() const { return held_; }
  Fit fit(const View& view) const {
    const Matrix3<double> R = matrix_from_quaternion(view.pose.rotation);
    Fit all;
    for (std::uint64_t i : seen_)
      all +=
          fit_of(view.camera, in_camera(R, view.pose, &points_[3 * std::size_t(sights_.point(i))]),
                 sights_.pixel(i), loss_);
    return all;
  }

 private:
  const Sights& sights_;
  const std::vector<double>& points_;
  const std::vector<std::uint64_t>& seen_;
  const ScaledLoss& loss_;
  std::size_t poses_ = 0;
  std::vector<std::size_t> lens_;
  std::vector<std::pair<std::size_t, double>> focals_;  ///< which, and what it was
  View held_, tried_;
};

std::vector<std::uint64_t> some_of(std::span<const std::uint64_t> seen) {
  std::vector<std::uint64_t> some;
  const std::size_t count = std::min(seen.size(), kEnough);
  for (std::size_t k = 0; k < count; ++k) some.push_back(seen[k * seen.size() / count]);
  return some;
}

/// The pose with the same centre whose rotation turns the points' directions into the bearings.
std::optional<Pose> turned(const Sights& sights, const std::vector<double>& points,
                           const std::vector<std::uint64_t>& seen, const View& view) {
  const Vector3<double> centre =
      camera_centre(matrix_from_quaternion(view.pose.rotation), view.pose);
  Matrix3<double> S{};
  for (std::uint64_t i : seen) {
    const auto d = bearing(view.camera, sights.pixel(i));
    if (!d) continue;
    const double* X = &points[3 * std::size_t(sights.point(i))];
    const Vector3<double> from = {X[0] - centre[0], X[1] - centre[1], X[2] - centre[2]};
    const double length = std::sqrt(from[0] * from[0] + from[1] * from[1] + from[2] * from[2]);
    if (!(length > 0)) continue;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) S[3 * r + c] += from[r] / length * (*d)[c];
  }
  const BestRotation best = best_rotation(S);
  if (!(best.certainty > 1e-6)) return std::nullopt;
  Pose pose{best.rotation, {}};
  const Vector3<double> moved = multiply(matrix_from_quaternion(best.rotation), centre);
  for (std::size_t k = 0; k < 3; ++k) pose.translation[k] = -moved[k];
  return pose;
}

bool better(const Fit& a, const Fit& b) {
  return std::isfinite(a.cost) && (a.cost < b.cost || !std::isfinite(b.cost));
}

View resected(const Sights& sights, const std::vector<double>& points, const ScaledLoss& loss,
              std::span<const std::uint64_t> all, bool pose_free, ParameterSet lens_held,
              const View& start) {
  const std::vector<std::uint64_t> seen = some_of(all);
  const bool few = 2 * seen.size() < 6 + 2 * parameter_count(start.camera.model);
  if (few) lens_held = kAllParameters;
  std::vector<View> starts{start};
  const Camera plain = without_distortion(start.camera);
  const bool bends = plain.parameters != start.camera.parameters && lens_held != kAllParameters;
  if (bends) starts.push_back({start.pose, plain});
  if (pose_free && seen.size() >= 3)
    for (std::size_t k = 0, count = starts.size(); k < count; ++k)
      if (const auto pose = turned(sights, points, seen, starts[k]))
        starts.push_back({*pose, starts[k].camera});
  View best = start;
  Fit lowest{std::numeric_limits<double>::infinity(), 0};
  for (const View& from : starts) {
    ImageBlock block(sights, points, seen, loss, pose_free, lens_held, from);
    if (block.size() == 0) return start;
    const Fit fit = descend(block, kTrials);
    if (better(fit, lowest)) lowest = fit, best = block.view();
  }
  // A few observations chose it; all of them say whether it is better.
  const std::vector<std::uint64_t> every(all.begin(), all.end());
  const ImageBlock judge(sights, points, every, loss, pose_free, lens_held, start);
  return better(judge.fit(best), judge.fit(start)) ? best : start;
}

}  // namespace

FreeImages free_images(const Problem& problem, const Fixed& fixed) {
  FreeImages free;
  free.pose.assign(problem.num_images(), fixed.poses ? 0 : 1);
  for (std::uint32_t i : fixed.pose_ids) free.pose[i] = 0;
  free.lens_held = held_parameters(problem, fixed);
  std::vector<std::uint32_t> users(problem.cameras.size(), 0);
  for (std::uint32_t camera : problem.image_camera) ++users[camera];
  for (std::uint32_t count : users) free.lens_own.push_back(count == 1);
  return free;
}

void resect(const Sights& sights, const FreeImages& free, const ScaledLoss& loss,
            const std::function<bool()>& cancelled, Threads& threads, Estimate& state) {
  threads.for_each(sights.num_images(), [&](std::size_t image) {
    if (cancelled()) return;
    const std::uint32_t camera = sights.camera_of(image);
    const bool own = free.lens_own[camera];
    const auto seen = sights.of_image(image);
    if (seen.empty() || (!free.pose[image] && !own)) return;
    const View view = resected(sights, state.points, loss, seen, free.pose[image] != 0,
                               own ? free.lens_held[camera] : kAllParameters,
                               {state.poses[image], state.cameras[camera]});
    state.poses[image] = view.pose;
    if (own) state.cameras[camera] = view.camera;
  });
}

}  // namespace sheaf
