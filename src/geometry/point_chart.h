// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "geometry/rotation.h"

namespace sheaf {

/// What the local coordinates of a point are about.
enum class ChartBase : std::uint8_t {
  none,    ///< X, Y, Z themselves
  origin,  ///< one place for all points: homogeneous coordinates
  host,    ///< the centre of the first image that sees the point: inverse depth
};

/// How points step. A point is held as X, Y, Z; its step is taken in the coordinates of a chart
/// (docs/math.md, section 6).
struct ChartRules {
  ChartBase base = ChartBase::none;
  Vector3<double> origin{};  ///< of ChartBase::origin, scene units
  double unit = 1;           ///< 1 / length that inverse distances are counted in
  bool crosses = true;       ///< a step may take a point through infinity, to the other side
  /// A distance is damped at least as if a turn by this x distance x unit were seen: rounding, in
  /// which the linear system is solved, must not pass for parallax.
  double rounding = 0;
};

/// A step ends within this distance x 1 / unit: pixels there are those at infinity to 1e-9.
constexpr double kFarthest = 1e12;
/// Where points may not cross, one beyond this x 1 / unit that is pulled outwards is at its bound:
/// its outward coordinate is damped by kAtBound instead of lambda.
constexpr double kBound = 1e9, kAtBound = 1e12;

/// The chart of a point at base + Y. With n = Y / |Y|, t1 and t2 across it, and the reach
///   N = |Y| (host)   or   N = sqrt(|Y|^2 + 1 / unit^2) (origin),
/// it has the coordinates q = (turn, turn, outward) about the point, in which
///   dX/dq = [N t1 | N t2 | unit N^2 n].
/// About a host these are the bearing (radians) and minus the inverse depth (1 / unit per scene
/// unit); about an origin the tangent space of the unit 4-vector (unit Y, 1) / (unit N).
/// Valid where N > 0.
template <class Scalar>
struct PointChart {
  Vector3<Scalar> Y, t1, t2, n;
  Scalar reach2, reach, outward;  ///< N^2, N, unit N^2

  PointChart(const ChartRules& rules, const Vector3<Scalar>& offset) : Y(offset) {
    using std::sqrt;
    const Scalar r2 = dot(Y, Y);
    const Scalar unit = Scalar(rules.unit);
    reach2 = rules.base == ChartBase::origin ? r2 + Scalar(1) / (unit * unit) : r2;
    reach = sqrt(reach2);
    outward = unit * reach2;
    const Scalar r = sqrt(r2);
    n = {Scalar(0), Scalar(0), Scalar(1)};
    if (Scalar(1e-150) < r) n = {Y[0] / r, Y[1] / r, Y[2] / r};
    set_frame();
  }

  /// dX/dq q.
  Vector3<Scalar> apply(const Vector3<Scalar>& q) const {
    Vector3<Scalar> d;
    for (int i = 0; i < 3; ++i)
      d[i] = reach * (t1[i] * q[0] + t2[i] * q[1]) + outward * n[i] * q[2];
    return d;
  }
  /// (dX/dq)^T g: of a gradient, or of a row of a Jacobian by X.
  Vector3<Scalar> transpose(const Vector3<Scalar>& g) const {
    return {reach * dot(t1, g), reach * dot(t2, g), outward * dot(n, g)};
  }
  /// q with dX/dq q = d.
  Vector3<Scalar> coordinates(const Vector3<Scalar>& d) const {
    return {dot(t1, d) / reach, dot(t2, d) / reach, dot(n, d) / outward};
  }

  /// Where the point ends, from the base, after the first-order step d of X - base:
  ///   (Y + d - far Y) / (1 - far),  far = d.Y / N^2,
  /// which is Y + d to first order, straight in direction and inverse distance. 1 - far is kept
  /// away from 0 (kFarthest), and above it where points may not cross.
  Vector3<Scalar> retract(const ChartRules& rules, const Vector3<Scalar>& d) const {
    const Scalar far = dot(d, Y) / reach2;
    const Scalar least = Scalar(rules.unit / kFarthest) * reach;
    Scalar left = Scalar(1) - far;
    if (left < least)
      left = rules.crosses && left < -least      ? left
             : rules.crosses && left < Scalar(0) ? -least
                                                 : least;
    Vector3<Scalar> out;
    for (int i = 0; i < 3; ++i) out[i] = (Y[i] + (d[i] - far * Y[i])) / left;
    return out;
  }

 private:
  static Scalar dot(const Vector3<Scalar>& a, const Vector3<Scalar>& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  }

  /// Two unit vectors across n, continuous but at n = (0, 0, -1): Duff et al., Building an
  /// Orthonormal Basis, Revisited (2017).
  void set_frame() {
    const Scalar one(1), sign = n[2] < Scalar(0) ? Scalar(-1) : one;
    const Scalar a = -one / (sign + n[2]), b = n[0] * n[1] * a;
    t1 = {one + sign * n[0] * n[0] * a, sign * b, -sign * n[0]};
    t2 = {b, sign + n[1] * n[1] * a, -n[1]};
  }
};

/// |u - u'| of a point before and after a step, each from its base, with u = (Y, 1 / unit) / N, the
/// sign of u' chosen next to u: the size of the step in the chart's coordinates, which are finite
/// at infinity.
template <class Scalar>
Scalar chart_step2(const ChartRules& rules, const PointChart<Scalar>& before,
                   const PointChart<Scalar>& after) {
  Scalar u[4], v[4], same{0}, minus{0}, plus{0};
  for (int i = 0; i < 4; ++i) {
    u[i] = (i < 3 ? before.Y[i] : Scalar(1 / rules.unit)) / before.reach;
    v[i] = (i < 3 ? after.Y[i] : Scalar(1 / rules.unit)) / after.reach;
    same = same + u[i] * v[i];
    minus = minus + (u[i] - v[i]) * (u[i] - v[i]);
    plus = plus + (u[i] + v[i]) * (u[i] + v[i]);
  }
  return same < Scalar(0) ? plus : minus;
}

}  // namespace sheaf
