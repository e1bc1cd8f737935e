// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/rotation.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "geometry/rigid_motion.h"

namespace sheaf {
namespace {

Vector3<double> random_vector(double length, std::mt19937& random) {
  std::normal_distribution<double> n;
  Vector3<double> v{n(random), n(random), n(random)};
  const double norm = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  for (double& x : v) x *= length / norm;
  return v;
}

TEST(Rotation, LogOfExpIsTheIdentityUpToPi) {
  std::mt19937 random(1);
  for (double angle : {1e-300, 1e-12, 1e-8, 1e-6, 1e-4, 1e-3, 0.1, 1.0, 3.0, 3.14159})
    for (int n = 0; n < 20; ++n) {
      const Vector3<double> phi = random_vector(angle, random);
      const Vector3<double> back = angle_axis_from_quaternion(quaternion_from_angle_axis(phi));
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(back[i], phi[i], 4e-15 * angle) << angle;
    }
}

TEST(Rotation, BeyondPiTheShorterWayIsTaken) {
  const Vector3<double> phi{0, 0, 4};
  const Vector3<double> back = angle_axis_from_quaternion(quaternion_from_angle_axis(phi));
  EXPECT_NEAR(back[2], 4 - 2 * std::numbers::pi, 1e-14);
}

TEST(Rotation, MatrixMatchesRodrigues) {
  std::mt19937 random(2);
  for (double angle : {1e-5, 0.3, 2.0, 3.1}) {
    const Vector3<double> phi = random_vector(angle, random);
    const Matrix3<double> R = matrix_from_quaternion(quaternion_from_angle_axis(phi));
    const Vector3<double> v = random_vector(1, random);
    const Vector3<double> k{phi[0] / angle, phi[1] / angle, phi[2] / angle};
    const Vector3<double> kv = cross(k, v), kkv = cross(k, kv), got = multiply(R, v);
    for (int i = 0; i < 3; ++i)
      EXPECT_NEAR(got[i], v[i] + std::sin(angle) * kv[i] + (1 - std::cos(angle)) * kkv[i], 1e-15);
  }
}

TEST(RigidMotion, PerturbationIsTheMatrixExponential) {
  std::mt19937 random(4);
  for (double angle : {1e-9, 1e-3, 0.009, 0.011, 0.5, 3.0}) {
    const Vector3<double> rho = random_vector(2, random), phi = random_vector(angle, random);
    // exp of the 4x4 generator by its Taylor series.
    const double G[4][4] = {{0, -phi[2], phi[1], rho[0]},
                            {phi[2], 0, -phi[0], rho[1]},
                            {-phi[1], phi[0], 0, rho[2]},
                            {0, 0, 0, 0}};
    double term[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}, sum[4][4];
    std::copy(&term[0][0], &term[0][0] + 16, &sum[0][0]);
    for (int n = 1; n < 60; ++n) {
      double next[4][4] = {};
      for (int i = 0; i < 4; ++i)
        for (int j = 0; j < 4; ++j)
          for (int k = 0; k < 4; ++k) next[i][j] += term[i][k] * G[k][j] / n;
      std::copy(&next[0][0], &next[0][0] + 16, &term[0][0]);
      for (int i = 0; i < 16; ++i) (&sum[0][0])[i] += (&next[0][0])[i];
    }
    const RigidMotion<double> T = left_perturbed(RigidMotion<double>{}, rho, phi);
    const Matrix3<double> R = matrix_from_quaternion(T.rotation);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(T.translation[i], sum[i][3], 2e-14);
      for (int j = 0; j < 3; ++j) EXPECT_NEAR(R[3 * i + j], sum[i][j], 2e-14);
    }
  }
}

TEST(RigidMotion, NormNeverDrifts) {
  std::mt19937 random(5);
  RigidMotion<double> T;
  for (int n = 0; n < 20000; ++n)
    T = left_perturbed(T, random_vector(0.1, random), random_vector(0.3, random));
  double norm2 = 0;
  for (double q : T.rotation) norm2 += q * q;
  EXPECT_NEAR(norm2, 1, 1e-15);
}

}  // namespace
}  // namespace sheaf
