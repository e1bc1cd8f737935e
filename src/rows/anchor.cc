// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "rows/anchor.h"

#include <cmath>
#include <limits>

#include "geometry/row_metric.h"

namespace sheaf {

AnchorRow anchor_row(const Anchor& anchor, const Pinhole& camera, const double* view,
                     const double* d, double s, bool on_ray, const double* measured) {
  AnchorRow out{};
  const double *R = view, *t = view + 9;
  double P[3];
  for (int i = 0; i < 3; ++i)
    P[i] = R[3 * i] * d[0] + R[3 * i + 1] * d[1] + R[3 * i + 2] * d[2] + s * t[i];
  if (!(P[2] > 0)) {
    out.cost = out.square = std::numeric_limits<double>::infinity();
    return out;
  }
  const double x = P[0] / P[2], y = P[1] / P[2];
  const double e[2] = {(camera.fx * x + camera.cx - measured[0]) / anchor.sigma_px,
                       (camera.fy * y + camera.cy - measured[1]) / anchor.sigma_px};
  const double weight2 = anchor.sigma_grey * anchor.sigma_grey;
  const auto rho = evaluate_loss(anchor.loss, e[0] * e[0] + e[1] * e[1]);
  out.cost = weight2 * rho.value;
  out.square = weight2 * (e[0] * e[0] + e[1] * e[1]);
  // A = du/dP: by rho s A, by phi P x A, by the world point A R, by the inverse depth A t.
  const double fx = anchor.sigma_grey * camera.fx / (anchor.sigma_px * P[2]);
  const double fy = anchor.sigma_grey * camera.fy / (anchor.sigma_px * P[2]);
  double A[2][3] = {{fx, 0, -fx * x}, {0, fy, -fy * y}};
  const RowMetric metric = metric_of(anchor.loss, rho, {e[0], e[1]});
  for (int i = 0; i < 3; ++i) {
    const auto column = metric.root_times({A[0][i], A[1][i]});
    A[0][i] = column[0], A[1][i] = column[1];
  }
  const double phi = curvature_along(anchor.loss, rho, e[0] * e[0] + e[1] * e[1]);
  for (int r = 0; r < 2; ++r) {
    const double* a = A[r];
    out.residual[r] = anchor.sigma_grey * std::sqrt(rho.first / phi) * e[r];
    for (int i = 0; i < 3; ++i) {
      out.camera[r][i] = s * a[i];
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      out.camera[r][3 + i] = P[j] * a[k] - P[k] * a[j];
      if (!on_ray) out.point[r][i] = a[0] * R[i] + a[1] * R[3 + i] + a[2] * R[6 + i];
    }
    if (on_ray) out.point[r][0] = a[0] * t[0] + a[1] * t[1] + a[2] * t[2];
  }
  return out;
}

}  // namespace sheaf
