// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace sheaf {

/// The quadratic model m(s) = beta.s - 1/2 |J s|^2 (a decrease of the cost) on the plane of two
/// directions: steepest descent v = C^-1 beta and the Newton point n. Lengths are |s|_C.
/// docs/math.md has the derivations.
struct DoglegPlane {
  double vv = 0;   ///< |v|_C^2 = beta.v
  double vHv = 0;  ///< |J v|^2
  double vn = 0;   ///< v^T C n = beta.n
  double nn = 0;   ///< |n|_C^2
  double vHn = 0, nHn = 0;
  double damping =
      0;  ///< mu: n minimises m(s) - mu/2 |s|_C^2, and so does the Cauchy point along v
};

/// s = newton n + descent v.
struct DoglegStep {
  double newton = 1, descent = 0;
  bool is_newton() const { return newton == 1 && descent == 0; }
};

double length_of(const DoglegPlane& plane, const DoglegStep& step);
/// m(s).
double decrease_of(const DoglegPlane& plane, const DoglegStep& step);
/// The lambda for which s is the damped step, as far as it is one: (beta - J^T J s).s / |s|_C^2.
double damping_of(const DoglegPlane& plane, const DoglegStep& step);

/// Where Powell's dogleg meets the radius: from 0 to the Cauchy point, the minimum along v; from
/// there to n, or to where it leaves the radius.
DoglegStep dogleg(const DoglegPlane& plane, double radius);

/// The step of the largest decrease in the plane within the radius. A Newton point that conjugate
/// gradients did not solve for to the end ends no dogleg: it may promise less than the Cauchy
/// point.
DoglegStep best_in_plane(const DoglegPlane& plane, double radius);

}  // namespace sheaf
