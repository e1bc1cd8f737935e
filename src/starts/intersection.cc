// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "starts/intersection.h"

#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "geometry/camera_model.h"
#include "starts/bearing.h"
#include "starts/block_descent.h"

namespace sheaf {
namespace {

constexpr int kTrials = 12;

struct Views {
  const Sights& sights;
  const Estimate& state;
  const ScaledLoss& loss;
  std::vector<Matrix3<double>> rotations;

  const Camera& camera(std::uint32_t image) const { return state.cameras[sights.camera_of(image)]; }
};

/// One point, its cameras held.
class PointBlock {
 public:
  static constexpr std::size_t kMost = 3;
  PointBlock(const Views& views, std::span<const std::uint64_t> seen, Vector3<double> X)
      : views_(views), seen_(seen), X_(X) {}

  Fit linearise(NormalEquations<kMost>& N) const {
    N.clear();
    Fit fit;
    for (std::uint64_t i : seen_) {
      const std::uint32_t image = views_.sights.image(i);
      const Matrix3<double>& R = views_.rotations[image];
      const Vector3<double> P = in_camera(R, views_.state.poses[image], X_.data());
      const LensJacobian<double> at = project_with_jacobian(views_.camera(image), P);
      const std::array<double, 2> r =
          residual(views_.camera(image), at.pixel, views_.sights.pixel(i));
      const auto rho = evaluate_loss(views_.loss, r[0] * r[0] + r[1] * r[1]);
      std::array<std::array<double, kMost>, 2> J;
      for (std::size_t row = 0; row < 2; ++row)
        for (std::size_t k = 0; k < 3; ++k)
          J[row][k] =
              at.point[row][0] * R[k] + at.point[row][1] * R[3 + k] + at.point[row][2] * R[6 + k];
      N.add(J, r, rho.first);
      fit += {0.5 * rho.value, sees(views_.camera(image), P) ? 0u : 1u};
    }
    return fit;
  }
  Fit attempt(const std::array<double, kMost>& step) {
    for (std::size_t k = 0; k < 3; ++k) tried_[k] = X_[k] + step[k];
    return fit(tried_);
  }
  void take() { X_ = tried_; }
  const Vector3<double>& X() const { return X_; }

 private:
  Fit fit(const Vector3<double>& X) const {
    Fit all;
    for (std::uint64_t i : seen_) {
      const std::uint32_t image = views_.sights.image(i);
      all += fit_of(views_.camera(image),
                    in_camera(views_.rotations[image], views_.state.poses[image], X.data()),
                    views_.sights.pixel(i), views_.loss);
    }
    return all;
  }

  const Views& views_;
  std::span<const std::uint64_t> seen_;
  Vector3<double> X_, tried_{};
};

struct Ray {
  Vector3<double> from, along;
};

/// Where rays meet best: twice, the second time weighted by the distances that the first found.
std::optional<Vector3<double>> meeting(const std::vector<Ray>& rays) {
  std::vector<double> weights(rays.size(), 1);
  std::array<double, 3> X{};
  for (int pass = 0; pass < 2; ++pass) {
    NormalEquations<3> N;
    double trace = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const auto& [c, d] = rays[i];
      for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t k = 0; k < 3; ++k) {
          const double a = weights[i] * ((row == k ? 1 : 0) - d[row] * d[k]);
          N.A[row][k] += a;
          N.g[row] -= a * c[k];
          if (row == k) trace += a;
        }
    }
    // Rays that are all but parallel meet nowhere that is known.
    for (std::size_t k = 0; k < 3; ++k) N.A[k][k] += 1e-12 * trace;
    if (!solve_damped(N, 0, X)) return std::nullopt;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      double square = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const double d = X[k] - rays[i].from[k];
        square += d * d;
      }
      weights[i] = 1 / std::max(square, 1e-12 * (1 + square));
    }
  }
  if (!std::isfinite(X[0] + X[1] + X[2])) return std::nullopt;
  return X;
}

std::vector<Ray> rays_of(const Views& views, std::span<const std::uint64_t> seen) {
  std::vector<Ray> rays;
  for (std::uint64_t i : seen) {
    const std::uint32_t image = views.sights.image(i);
    const auto direction = bearing(views.camera(image), views.sights.pixel(i));
    if (!direction) continue;
    const Matrix3<double>& R = views.rotations[image];
    rays.push_back({camera_centre(R, views.state.poses[image]), turned_back(R, *direction)});
  }
  return rays;
}

bool better(const Fit& a, const Fit& b) {
  return a.behind < b.behind || (a.behind == b.behind && a.cost < b.cost);
}

Vector3<double> intersected(const Views& views, std::size_t point) {
  const std::span<const std::uint64_t> seen = views.sights.of_point(point);
  const double* X = &views.state.points[3 * point];
  PointBlock own(views, seen, {X[0], X[1], X[2]});
  const Fit stays = descend(own, kTrials);
  const std::vector<Ray> rays = rays_of(views, seen);
  if (rays.size() < 2) return own.X();
  const auto meets = meeting(rays);
  if (!meets) return own.X();
  PointBlock met(views, seen, *meets);
  const Fit moves = descend(met, kTrials);
  return std::isfinite(moves.cost) && (better(moves, stays) || !std::isfinite(stays.cost))
             ? met.X()
             : own.X();
}

}  // namespace

void intersect(const Sights& sights, const ScaledLoss& loss, const std::function<bool()>& cancelled,
               Threads& threads, Estimate& state) {
  constexpr std::size_t kPoints = 256;
  Views views{sights, state, loss, {}};
  for (const Pose& pose : state.poses)
    views.rotations.push_back(matrix_from_quaternion(pose.rotation));
  threads.for_ranges(sights.num_points(), kPoints, [&](std::size_t j, std::size_t end) {
    if (cancelled()) return;
    for (; j < end; ++j) {
      if (sights.of_point(j).empty()) continue;
      const Vector3<double> X = intersected(views, j);
      for (std::size_t k = 0; k < 3; ++k) state.points[3 * j + k] = X[k];
    }
  });
}

}  // namespace sheaf
