// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "rows/anchor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/dual.h"
#include "geometry/rigid_motion.h"
#include "rows/photometric.h"

namespace sheaf {
namespace {

constexpr int kPose = 6;
using Dual = test::Dual<double, kPose + 3>;

struct Place {
  RigidMotion<double> pose = left_perturbed<double>({}, {0.3, -0.2, 0.5}, {0.2, -0.1, 0.3});
  Pinhole camera{310, 290, 160, 121};
  Vector3<double> d{0.3, -0.2, 1.6};
  double s = 0.7;
  double measured[2] = {190, 80};

  std::array<double, kViewRecord> view() const {
    std::array<double, kViewRecord> out{};
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    std::copy(R.begin(), R.end(), out.begin());
    std::copy(pose.translation.begin(), pose.translation.end(), out.begin() + 9);
    return out;
  }
};

/// Distances in standard deviations and their derivatives by the pose and the point.
std::array<Dual, 2> distances(const Place& at, const Anchor& anchor, bool on_ray) {
  const auto variable = [](double value, int i) { return Dual::variable(value, i); };
  RigidMotion<Dual> pose;
  for (int i = 0; i < 4; ++i) pose.rotation[i] = at.pose.rotation[i];
  for (int i = 0; i < 3; ++i) pose.translation[i] = at.pose.translation[i];
  pose = left_perturbed<Dual>(pose, {variable(0, 0), variable(0, 1), variable(0, 2)},
                              {variable(0, 3), variable(0, 4), variable(0, 5)});
  Vector3<Dual> d;
  for (int i = 0; i < 3; ++i) d[i] = on_ray ? Dual(at.d[i]) : variable(at.d[i], kPose + i);
  const Dual s = on_ray ? variable(at.s, kPose) : Dual(1);
  Vector3<Dual> P = multiply(matrix_from_quaternion(pose.rotation), d);
  for (int i = 0; i < 3; ++i) P[i] = P[i] + s * pose.translation[i];
  const Pinhole& k = at.camera;
  return {(Dual(k.fx) * P[0] / P[2] + Dual(k.cx - at.measured[0])) / Dual(anchor.sigma_px),
          (Dual(k.fy) * P[1] / P[2] + Dual(k.cy - at.measured[1])) / Dual(anchor.sigma_px)};
}

TEST(AnchorRow, AgreesWithAutomaticDifferentiation) {
  const Place at;
  for (bool on_ray : {false, true}) {
    const Anchor anchor{{}, 0.5, 3, {}};
    const auto e = distances(at, anchor, on_ray);
    const AnchorRow row = anchor_row(anchor, at.camera, at.view().data(), at.d.data(),
                                     on_ray ? at.s : 1, on_ray, at.measured);
    for (int r = 0; r < 2; ++r) {
      EXPECT_NEAR(row.residual[r], 3 * e[r].value, 1e-11);
      for (int i = 0; i < kPose; ++i)
        EXPECT_NEAR(row.camera[r][i], 3 * e[r].d[i], 1e-10 * std::abs(e[r].d[i]) + 1e-9) << i;
      for (int i = 0; i < 3; ++i)
        EXPECT_NEAR(row.point[r][i], 3 * e[r].d[kPose + i],
                    1e-10 * std::abs(e[r].d[kPose + i]) + 1e-9)
            << i;
    }
    const double square = e[0].value * e[0].value + e[1].value * e[1].value;
    EXPECT_NEAR(row.cost, 9 * square, 1e-11 * row.cost);
    EXPECT_EQ(row.cost, row.square);
  }
}

// The rows of a loss have the gradient of the cost: J^T r = d(cost / 2).
TEST(AnchorRow, HasTheGradientOfItsLoss) {
  Place at;
  at.measured[0] -= 3, at.measured[1] += 2;
  for (LossKind kind : {LossKind::huber, LossKind::cauchy, LossKind::tukey}) {
    const Anchor anchor{{}, 0.8, 2, {kind, kind == LossKind::tukey ? 200.0 : 50.0}};
    const auto cost = [&](const Place& place) {
      return anchor_row(anchor, place.camera, place.view().data(), place.d.data(), 1, false,
                        place.measured)
          .cost;
    };
    const AnchorRow row =
        anchor_row(anchor, at.camera, at.view().data(), at.d.data(), 1, false, at.measured);
    EXPECT_LT(row.cost, row.square);
    for (int i = 0; i < kPose + 3; ++i) {
      constexpr double h = 1e-6;
      const auto moved = [&](double by) {
        Place out = at;
        Vector3<double> rho{}, phi{};
        if (i < kPose) (i < 3 ? rho : phi)[i % 3] = by;
        out.pose = left_perturbed(at.pose, rho, phi);
        if (i >= kPose) out.d[i - kPose] += by;
        return out;
      };
      const double slope = (cost(moved(h)) - cost(moved(-h))) / (4 * h);
      double expected = 0;
      for (int r = 0; r < 2; ++r)
        expected += row.residual[r] * (i < kPose ? row.camera[r][i] : row.point[r][i - kPose]);
      EXPECT_NEAR(expected, slope, 1e-6 * std::abs(slope) + 1e-3) << to_string(kind) << " " << i;
    }
  }
}

TEST(AnchorRow, BehindTheCameraIsRefused) {
  Place at;
  at.d = {0.1, 0.2, -5};
  const AnchorRow row =
      anchor_row({}, at.camera, at.view().data(), at.d.data(), 1, false, at.measured);
  EXPECT_TRUE(std::isinf(row.cost));
  for (double x : row.residual) EXPECT_EQ(x, 0);
}

}  // namespace
}  // namespace sheaf
