// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/bal_camera.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "geometry/dual.h"
#include "geometry/rigid_motion.h"

namespace sheaf {
namespace {

using test::Dual;

template <class Scalar>
struct View {
  RigidMotion<Scalar> pose;
  BalCamera<Scalar> camera;
  Vector3<Scalar> X;
};

/// A view whose rotation has the given angle; the point lies in front of the camera (or behind).
template <class Scalar>
View<Scalar> view_at(double angle, bool behind, std::mt19937& random) {
  std::uniform_real_distribution<double> u(-1, 1);
  Vector3<Scalar> axis{Scalar(u(random)), Scalar(u(random)), Scalar(u(random))};
  const Scalar norm =
      std::sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]) + Scalar(1e-9);
  for (Scalar& a : axis) a *= Scalar(angle) / norm;
  View<Scalar> v;
  v.pose.rotation = quaternion_from_angle_axis(axis);
  for (Scalar& t : v.pose.translation) t = Scalar(u(random));
  v.camera = {Scalar(500 + 300 * u(random)), Scalar(0.1 * u(random)), Scalar(0.05 * u(random))};
  // X = R^T (P - t) for a point P of the camera's frame.
  const Vector3<Scalar> P{Scalar(u(random)), Scalar(u(random)),
                          Scalar((behind ? 1 : -1) * (3 + u(random)))};
  const Matrix3<Scalar> R = matrix_from_quaternion(v.pose.rotation);
  const Vector3<Scalar> d{P[0] - v.pose.translation[0], P[1] - v.pose.translation[1],
                          P[2] - v.pose.translation[2]};
  for (int i = 0; i < 3; ++i) v.X[i] = R[i] * d[0] + R[3 + i] * d[1] + R[6 + i] * d[2];
  return v;
}

/// The pixel as a function of (rho, phi, f, k1, k2, X), differentiated automatically at zero step.
template <class Scalar>
std::array<Dual<Scalar, 12>, 2> differentiate(const View<Scalar>& v) {
  using D = Dual<Scalar, 12>;
  RigidMotion<D> pose;
  for (int i = 0; i < 4; ++i) pose.rotation[i] = D(v.pose.rotation[i]);
  for (int i = 0; i < 3; ++i) pose.translation[i] = D(v.pose.translation[i]);
  Vector3<D> rho, phi, X;
  for (int i = 0; i < 3; ++i) {
    rho[i] = D::variable(0, i);
    phi[i] = D::variable(0, 3 + i);
    X[i] = D::variable(v.X[i], 9 + i);
  }
  const RigidMotion<D> moved = left_perturbed(pose, rho, phi);
  const BalCamera<D> camera{D::variable(v.camera.f, 6), D::variable(v.camera.k1, 7),
                            D::variable(v.camera.k2, 8)};
  Vector3<D> P = multiply(matrix_from_quaternion(moved.rotation), X);
  for (int i = 0; i < 3; ++i) P[i] = P[i] + moved.translation[i];
  return project(camera, P);
}

template <class Scalar>
void expect_exact(double angle, bool behind, double tolerance) {
  std::mt19937 random(7);
  for (int n = 0; n < 50; ++n) {
    const View<Scalar> v = view_at<Scalar>(angle, behind, random);
    const auto J = project_with_jacobian(matrix_from_quaternion(v.pose.rotation),
                                         v.pose.translation, v.camera, v.X);
    const auto expected = differentiate(v);
    for (int r = 0; r < 2; ++r) {
      double scale = 0;
      for (Scalar d : expected[r].d) scale = std::max(scale, std::abs(double(d)));
      EXPECT_NEAR(J.pixel[r], expected[r].value, tolerance * scale);
      for (int k = 0; k < 9; ++k)
        EXPECT_NEAR(J.camera[9 * r + k], expected[r].d[k], tolerance * scale) << "column " << k;
      for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(J.point[3 * r + k], expected[r].d[9 + k], tolerance * scale) << "X " << k;
    }
  }
}

TEST(BalCamera, JacobiansMatchAutomaticDifferentiationInDouble) {
  for (double angle : {0.0, 1e-9, 1e-4, 0.7, 2.0, std::numbers::pi - 1e-7, std::numbers::pi, 3.5})
    for (bool behind : {false, true}) expect_exact<double>(angle, behind, 1e-12);
}

TEST(BalCamera, JacobiansMatchAutomaticDifferentiationInFloat) {
  for (double angle : {0.0, 1e-4, 0.7, 2.0, std::numbers::pi - 1e-3, std::numbers::pi})
    for (bool behind : {false, true}) expect_exact<float>(angle, behind, 2e-5);
}

TEST(BalCamera, JacobiansMatchCentralDifferences) {
  std::mt19937 random(3);
  const View<double> v = view_at<double>(1.3, false, random);
  const auto J = project_with_jacobian(matrix_from_quaternion(v.pose.rotation), v.pose.translation,
                                       v.camera, v.X);
  const auto pixel_at = [&](int k, double h) {
    View<double> w = v;
    Vector3<double> rho{}, phi{};
    if (k < 3) rho[k] = h;
    if (k >= 3 && k < 6) phi[k - 3] = h;
    if (k == 6) w.camera.f += h;
    if (k == 7) w.camera.k1 += h;
    if (k == 8) w.camera.k2 += h;
    if (k >= 9) w.X[k - 9] += h;
    const RigidMotion<double> T = left_perturbed(w.pose, rho, phi);
    Vector3<double> P = multiply(matrix_from_quaternion(T.rotation), w.X);
    for (int i = 0; i < 3; ++i) P[i] += T.translation[i];
    return project(w.camera, P);
  };
  for (int k = 0; k < 12; ++k) {
    const double h = 1e-6;
    const auto plus = pixel_at(k, h), minus = pixel_at(k, -h);
    for (int r = 0; r < 2; ++r) {
      const double analytic = k < 9 ? J.camera[9 * r + k] : J.point[3 * r + k - 9];
      EXPECT_NEAR(analytic, (plus[r] - minus[r]) / (2 * h), 1e-5 * (1 + std::abs(analytic)));
    }
  }
}

TEST(BalCamera, FormulaContinuesBehindTheCamera) {
  const BalCamera<double> camera{100, 0.1, 0.01};
  const auto front = project(camera, Vector3<double>{1, 2, -4});
  const auto back = project(camera, Vector3<double>{-1, -2, 4});
  EXPECT_DOUBLE_EQ(front[0], back[0]);
  EXPECT_DOUBLE_EQ(front[1], back[1]);
}

}  // namespace
}  // namespace sheaf
