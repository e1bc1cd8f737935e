// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/point_chart.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "geometry/bal_camera.h"
#include "geometry/dual.h"

namespace sheaf {
namespace {

using test::Dual;
using D3 = Dual<double, 3>;
using V3 = Vector3<double>;

ChartRules about_origin(double unit) { return {ChartBase::origin, {}, unit}; }
ChartRules about_host(double unit) { return {ChartBase::host, {}, unit}; }

/// Near, far, beyond 1000 and 1e9 units, on the axes and where the frame changes sign.
const std::vector<V3> kPlaces = {
    {0.3, -0.2, 0.1}, {3, 4, -12}, {-1e3, 2e3, 5e2},  {1e9, 1e8, -3e9}, {0, 0, 2},      {0, 0, -2},
    {5, 0, 0},        {0, -5, 0},  {1e-3, 0, -0.999}, {0, 1e-9, -1},    {-40, 30, 1e-7}};

double distance(const V3& a, const V3& b) {
  return std::sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) +
                   (a[2] - b[2]) * (a[2] - b[2]));
}
double norm(const V3& a) { return distance(a, {}); }

TEST(PointChart, CoordinatesUndoTheirDerivative) {
  for (const ChartRules& rules : {about_origin(0.5), about_host(0.5), about_host(4)})
    for (const V3& Y : kPlaces) {
      const PointChart<double> chart(rules, Y);
      const V3 q{1e-3, -2e-3, 3e-3 / (rules.unit * chart.reach)},
          back = chart.coordinates(chart.apply(q));
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(back[i], q[i], 1e-12);
      const V3 g{0.2, -0.7, 0.4}, a = chart.apply(q), b = chart.transpose(g);
      EXPECT_NEAR(g[0] * a[0] + g[1] * a[1] + g[2] * a[2], q[0] * b[0] + q[1] * b[1] + q[2] * b[2],
                  1e-12 * norm(a));
    }
}

/// X of the chart's coordinates by the definition of the parametrisation, from the base: the unit
/// 4-vector (unit Y, 1) / norm, moved in its tangent space; or bearing and inverse depth.
template <class S>
Vector3<S> by_definition(const ChartRules& rules, const V3& Y, const Vector3<S>& q) {
  const PointChart<double> chart(rules, Y);
  const double unit = rules.unit, N = chart.reach, r = norm(Y);
  Vector3<S> out;
  if (rules.base == ChartBase::origin) {
    const S w = S(1 / (unit * N)) - S(r / N) * q[2];
    for (int i = 0; i < 3; ++i)
      out[i] = (S(Y[i] / N) + S(chart.t1[i]) * q[0] + S(chart.t2[i]) * q[1] +
                S(chart.n[i] / (unit * N)) * q[2]) /
               (w * S(unit));
  } else {
    const S depth = S(1) / (S(1 / (unit * r)) - q[2]);
    for (int i = 0; i < 3; ++i)
      out[i] =
          (S(chart.n[i]) + S(chart.t1[i]) * q[0] + S(chart.t2[i]) * q[1]) * depth * S(1 / unit);
  }
  return out;
}

TEST(PointChart, RetractsAsTheParametrisationsAreDefined) {
  for (const ChartRules& rules : {about_origin(0.5), about_host(0.25)})
    for (const V3& Y : kPlaces)
      for (double size : {1e-6, 0.01, 0.3}) {
        const PointChart<double> chart(rules, Y);
        const double inverse = 1 / (rules.unit * chart.reach);
        const V3 q{size, -size / 2, size * inverse * 0.7};
        const V3 got = chart.retract(rules, chart.apply(q));
        const V3 expected = by_definition<double>(rules, Y, q);
        EXPECT_LT(distance(got, expected), 1e-10 * norm(expected)) << Y[0] << " " << size;
      }
}

TEST(PointChart, ItsDerivativeIsThatOfTheRetraction) {
  for (const ChartRules& rules : {about_origin(0.5), about_host(0.25)})
    for (const V3& Y : kPlaces) {
      const Vector3<D3> q{D3::variable(0, 0), D3::variable(0, 1), D3::variable(0, 2)};
      const PointChart<double> chart(rules, Y);
      const Vector3<D3> defined = by_definition<D3>(rules, Y, q);
      const PointChart<D3> dual(rules, {D3(Y[0]), D3(Y[1]), D3(Y[2])});
      const Vector3<D3> retracted = dual.retract(rules, dual.apply(q));
      for (int k = 0; k < 3; ++k) {
        V3 unit{};
        unit[k] = 1;
        const V3 column = chart.apply(unit);
        for (int i = 0; i < 3; ++i) {
          EXPECT_NEAR(defined[i].d[k], column[i], 1e-9 * norm(column));
          EXPECT_NEAR(retracted[i].d[k], column[i], 1e-9 * norm(column));
        }
      }
    }
}

/// The pixel's derivative in the chart is (dX/dq)^T by row, at any distance.
TEST(PointChart, PixelJacobiansAreThoseOfDualNumbers) {
  const Matrix3<double> R = {0.36, 0.48, -0.8, -0.8, 0.6, 0, 0.48, 0.64, 0.6};
  const V3 t{0.2, -0.1, 0.4};
  const BalCamera<double> camera{800, -0.1, 0.02};
  BalCamera<D3> dual_camera;
  dual_camera.f = D3(camera.f), dual_camera.k1 = D3(camera.k1), dual_camera.k2 = D3(camera.k2);
  for (const ChartRules& rules : {about_origin(0.5), about_host(0.25)})
    for (double far : {1.0, 30.0, 1e3, 1e6}) {
      const V3 Y{-0.5 * far, -0.55 * far, -0.6 * far}, base{0.1, 0.2, 0.3};
      const PointChart<double> chart(rules, Y);
      const auto j =
          project_with_jacobian(R, t, camera, {base[0] + Y[0], base[1] + Y[1], base[2] + Y[2]});
      const Vector3<D3> q{D3::variable(0, 0), D3::variable(0, 1), D3::variable(0, 2)};
      const Vector3<D3> at = by_definition<D3>(rules, Y, q);
      Vector3<D3> P;
      for (int i = 0; i < 3; ++i) {
        P[i] = D3(t[i]);
        for (int k = 0; k < 3; ++k) P[i] = P[i] + D3(R[3 * i + k]) * (D3(base[k]) + at[k]);
      }
      const auto pixel = project(dual_camera, P);
      for (int r = 0; r < 2; ++r) {
        const V3 row = chart.transpose({j.point[3 * r], j.point[3 * r + 1], j.point[3 * r + 2]});
        for (int k = 0; k < 3; ++k)
          EXPECT_NEAR(row[k], pixel[r].d[k], 1e-13 * far * std::abs(row[k]) + 1e-9 * camera.f);
      }
    }
}

TEST(PointChart, PassesThroughInfinityOrStopsBeforeIt) {
  for (ChartRules rules : {about_origin(1), about_host(1)}) {
    const V3 Y{0, 3, 4e3};
    const PointChart<double> chart(rules, Y);
    const double inverse = 1 / chart.reach;
    const V3 beyond = chart.retract(rules, chart.apply({0, 0, 1.5 * inverse}));
    EXPECT_LT(beyond[2], -1e3);  // from the other side, along the same line of sight
    EXPECT_NEAR(beyond[1] / beyond[2], Y[1] / Y[2], 1e-12);
    const V3 at = chart.retract(rules, chart.apply({0, 0, inverse}));
    EXPECT_GT(norm(at), 1e10);
    EXPECT_LT(norm(at), 1.001 * kFarthest);
    rules.crosses = false;
    const V3 stopped = chart.retract(rules, chart.apply({0, 0, 1.5 * inverse}));
    EXPECT_NEAR(stopped[2] / kFarthest, 1, 1e-3);
    const V3 nearer = chart.retract(rules, chart.apply({0, 0, -0.5 * inverse}));
    EXPECT_GT(nearer[2], 2e3);
    EXPECT_LT(nearer[2], 3e3);
  }
}

/// Steps are measured where infinity is an ordinary place.
TEST(PointChart, AStepThroughInfinityIsAsSmallAsItLooks) {
  const ChartRules rules = about_host(1);
  const PointChart<double> before(rules, {0, 0, 1e8}), after(rules, {0, 1, -1e8});
  EXPECT_LT(chart_step2(rules, before, after), 1e-14);
  const PointChart<double> turned(rules, {0, 1e6, 1e8});
  EXPECT_NEAR(std::sqrt(chart_step2(rules, before, turned)), 0.01, 1e-4);
}

}  // namespace
}  // namespace sheaf
