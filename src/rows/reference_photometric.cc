// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The collapse of patches once more as plain scalar code, one pixel at a time: what the fast
// kernels are tested against.
#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/row_metric.h"
#include "lists/block_layout.h"
#include "rows/reference_patch.h"
#include "rows/row_layout.h"

namespace sheaf {

Vector3<double> PatchLane::middle() const {
  const double *V = view(), *d = (in.rays == nullptr ? in.points : in.rays) + 24 * group + lane;
  Vector3<double> P;
  for (std::size_t i = 0; i < 3; ++i)
    P[i] = V[3 * i] * d[0] + V[3 * i + 1] * d[8] + V[3 * i + 2] * d[16] +
           scale() * V[pose_record::kTranslation + i];
  return P;
}

Vector3<double> PatchLane::pixel(double dx, double dy) const {
  const double* R = view();
  Vector3<double> P = middle();
  for (std::size_t i = 0; i < 3; ++i)
    P[i] += R[3 * i] * dx / in.camera.fx + R[3 * i + 1] * dy / in.camera.fy;
  return P;
}

bool PatchLane::fits() const {
  const PatchGrid& grid = *in.grid;
  const Vector3<double> P = middle();
  const auto u = project(P);
  if (!(P[2] > 0) || !patch_fits(grid, plane(), u[0], u[1])) return false;
  if (!in.warped) return true;
  for (int dx : {grid.left, grid.right()})
    for (int dy : {grid.top, grid.bottom()}) {
      const Vector3<double> Q = pixel(dx, dy);
      const auto v = project(Q);
      if (!(Q[2] > 0) || !pixel_fits(plane(), v[0], v[1])) return false;
    }
  return true;
}

void PatchFactor::store(bool brightness, double* to) const {
  to[0] = r11, to[8] = r12, to[16] = r22;
  for (std::size_t r = 0; r < 2; ++r) {
    to[24 + 8 * r] = h[r];
    if (brightness) to[40 + 8 * r] = alpha[r], to[56 + 8 * r] = beta[r];
  }
}

PatchFactor PatchFactor::restore(bool brightness, const double* from) {
  PatchFactor out;
  out.r11 = from[0], out.r12 = from[8], out.r22 = from[16];
  for (std::size_t r = 0; r < 2; ++r) {
    out.h[r] = from[24 + 8 * r];
    if (brightness) out.alpha[r] = from[40 + 8 * r], out.beta[r] = from[56 + 8 * r];
  }
  return out;
}

PointRow patch_rows(const PatchLane& patch, const PatchFactor& factor) {
  PointRow rows;
  if (factor.r11 + factor.r22 == 0) return rows;  // it left, and may be where nothing is finite
  const double* view = patch.view();
  const double s = patch.scale();
  const Vector3<double> P = patch.middle();
  const Pinhole& k = patch.in.camera;
  const std::array<Vector3<double>, 2> du_dP{{{k.fx / P[2], 0, -k.fx * P[0] / (P[2] * P[2])},
                                              {0, k.fy / P[2], -k.fy * P[1] / (P[2] * P[2])}}};
  const double R[2][2] = {{factor.r11, factor.r12}, {0, factor.r22}};
  for (std::size_t e = 0; e < 2; ++e) {
    Vector3<double> A;
    for (std::size_t i = 0; i < 3; ++i) A[i] = R[e][0] * du_dP[0][i] + R[e][1] * du_dP[1][i];
    const Vector3<double> turned = cross(P, A);
    rows.r[e] = factor.h[e];
    for (std::size_t i = 0; i < 3; ++i) {
      rows.camera[e][i] = s * A[i];
      rows.camera[e][3 + i] = turned[i];
      if (patch.in.rays != nullptr)
        rows.point[e][0] += A[i] * view[pose_record::kTranslation + i];
      else
        rows.point[e][i] = A[0] * view[i] + A[1] * view[3 + i] + A[2] * view[6 + i];
    }
    rows.camera[e][6] = factor.alpha[e], rows.camera[e][7] = factor.beta[e];
  }
  return rows;
}

namespace {

/// Of a patch's pixels by the loss's metric: G = J^T M J and b = w J^T r of the columns gx, gy, -g
/// and -1; and not weighted, the sum of r^2.
struct PatchGram {
  std::array<std::array<double, 4>, 4> G{};
  std::array<double, 4> b{};
  double cost = 0, square = 0;

  /// along: phi, a part of the weight.
  void add(const std::array<double, 4>& J, double r, double weight, double along) {
    for (std::size_t i = 0; i < 4; ++i) {
      b[i] += weight * J[i] * r;
      for (std::size_t k = 0; k < 4; ++k) G[i][k] += weight * along * J[i] * J[k];
    }
  }
  /// A loss on all of them as one vector.
  void apply(const ScaledLoss& loss) {
    const LossValue<double> rho = evaluate_loss(loss, square);
    const double less = square > 0 ? (1 - curvature_along(loss, rho, square)) / square : 0;
    cost = rho.value;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 4; ++k) G[i][k] = rho.first * (G[i][k] - less * b[i] * b[k]);
    for (double& x : b) x *= rho.first;
  }
};

PatchGram sum_pixels(const PatchLane& patch) {
  const PhotometricInput& in = patch.in;
  const PatchGrid& grid = *in.grid;
  const auto middle = patch.project(patch.middle());
  const float* reference = in.references + grid.cells() * patch.point();
  PatchGram out;
  for (std::uint32_t cell : grid.place) {
    const double dx = grid.dx[cell], dy = grid.dy[cell], g = reference[cell];
    const std::array<double, 2> u = in.warped
                                        ? patch.project(patch.pixel(dx, dy))
                                        : std::array<double, 2>{middle[0] + dx, middle[1] + dy};
    const GreySample grey = sample(patch.plane(), in.taps, u[0], u[1]);
    const double r = grey.value - (patch.alpha() * g + patch.beta());
    const LossValue<double> rho =
        in.loss_per_patch ? LossValue<double>{r * r, 1, 0} : evaluate_loss(in.loss, r * r);
    out.square += r * r;
    out.cost += rho.value;
    const double along = in.loss_per_patch ? 1 : curvature_along(in.loss, rho, r * r);
    out.add({grey.dx, grey.dy, -g, -1}, r, rho.first, along);
  }
  if (in.loss_per_patch) out.apply(in.loss);
  return out;
}

/// Two steps of a Cholesky factorisation, of G and of b beside it: what they leave is the
/// brightness's own. A pivot that is rounding leaves a row of zeros.
PatchFactor factor_slopes(PatchGram& of) {
  double R[2][4] = {}, h[2] = {};
  const double least[2] = {kNoTexture, kNoTexture + kRoundedPivot * of.G[1][1]};
  for (std::size_t p = 0; p < 2; ++p) {
    if (!(of.G[p][p] > least[p])) continue;
    const double pivot = std::sqrt(of.G[p][p]);
    for (std::size_t k = p; k < 4; ++k) R[p][k] = of.G[p][k] / pivot;
    h[p] = of.b[p] / pivot;
    for (std::size_t i = p; i < 4; ++i) {
      for (std::size_t k = p; k < 4; ++k) of.G[i][k] -= R[p][i] * R[p][k];
      of.b[i] -= R[p][i] * h[p];
    }
  }
  return {R[0][0], R[0][1], R[1][1], {h[0], h[1]}, {R[0][2], R[1][2]}, {R[0][3], R[1][3]}};
}

void write_rows(const PointRow& rows, std::uint32_t lane, double* batch) {
  double* to = batch + first_row_field(kReferenceLanes, static_cast<int>(lane));
  for (int e = 0; e < 2; ++e) {
    const auto row = static_cast<std::size_t>(e);
    to[row_field::residual(e)] = rows.r[row];
    for (int k = 0; k < 9; ++k) to[row_field::camera(e, k)] = rows.camera[row][std::size_t(k)];
    for (int k = 0; k < 3; ++k) to[row_field::point(e, k)] = rows.point[row][std::size_t(k)];
  }
}

/// A lane beyond the group's points is as a patch that left for nothing.
void collapse_patch(const PatchLane& patch, bool used, PhotometricOutput& out) {
  const PhotometricInput& in = patch.in;
  const std::uint64_t b = patch.batch;
  const std::uint32_t lane = patch.lane;
  std::array<double, 2> seen{std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::quiet_NaN()};
  PatchGram gram;
  if (used && patch.fits()) {
    gram = sum_pixels(patch);
    seen = patch.project(patch.middle());
  } else if (used) {
    ++out.left;
    if (in.leaving != nullptr)
      gram.cost = in.leaving[16 * b + lane], gram.square = in.leaving[16 * b + 8 + lane];
  }
  out.cost += gram.cost, out.square_sum += gram.square;
  for (std::size_t d = 0; d < 2; ++d) out.seen[16 * b + 8 * d + lane] = seen[d];
  if (out.costs != nullptr) {
    out.costs[16 * b + lane] = gram.cost;
    out.costs[16 * b + 8 + lane] = gram.square;
  }
  PatchFactor factor = factor_slopes(gram);
  if (in.brightness) {
    const double rest[5] = {gram.G[2][2], gram.G[2][3], gram.G[3][3], gram.b[2], gram.b[3]};
    for (std::size_t i = 0; i < 5; ++i)
      out.brightness[kBrightnessBatch * b + 8 * i + lane] = rest[i];
  } else {
    factor.alpha = factor.beta = {};
  }
  if (out.factors != nullptr)
    factor.store(in.brightness, out.factors + patch_factors(in.brightness) * b + lane);
  if (out.rows != nullptr) write_rows(patch_rows(patch, factor), lane, out.rows + kRowBatch * b);
}

void collapse(const PhotometricInput& in, std::uint32_t first, std::uint32_t end,
              PhotometricOutput& out) {
  for (std::uint32_t g = first; g < end; ++g) {
    const Batches::Group& group = in.batches->groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      for (std::uint32_t l = 0; l < 8; ++l) collapse_patch({in, g, b, l}, l < group.lanes, out);
  }
}

}  // namespace

const PhotometricKernels& reference_photometric_kernels() {
  static const PhotometricKernels kernels{"scalar", &collapse};
  return kernels;
}

}  // namespace sheaf
