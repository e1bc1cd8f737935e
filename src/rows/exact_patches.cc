// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "rows/exact_patches.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "geometry/row_metric.h"
#include "lists/block_layout.h"
#include "rows/row_layout.h"

namespace sheaf {
namespace {

/// A (3), P x A (3), alpha, beta, r.
constexpr std::size_t kColumns = 9, kResidual = 8;

using PixelRow = std::array<double, kColumns>;

/// Upper triangle in the first rows: reflections of I - 2 v v^T, column by column. A column that is
/// zero from its diagonal down needs none.
void triangularise(std::vector<PixelRow>& m) {
  for (std::size_t c = 0; c < std::min(kColumns, m.size()); ++c) {
    double norm2 = 0;
    for (std::size_t r = c; r < m.size(); ++r) norm2 += m[r][c] * m[r][c];
    const double norm = std::copysign(std::sqrt(norm2), m[c][c]);
    const double v0 = m[c][c] + norm;
    if (!(norm * v0 > 1e-200)) continue;
    // |v|^2 = 2 norm v0, v = column + norm e
    for (std::size_t k = c + 1; k < kColumns; ++k) {
      double along = v0 * m[c][k];
      for (std::size_t r = c + 1; r < m.size(); ++r) along += m[r][c] * m[r][k];
      along /= norm * v0;
      m[c][k] -= along * v0;
      for (std::size_t r = c + 1; r < m.size(); ++r) m[r][k] -= along * m[r][c];
    }
    m[c][c] = -norm;
    for (std::size_t r = c + 1; r < m.size(); ++r) m[r][c] = 0;
  }
}

struct PatchLane {
  const PhotometricInput& in;
  const double* view;
  const GreyPlane& plane;
  double P[3];       ///< of the middle
  double middle[2];  ///< in the image
  const float* reference;

  /// P of a pixel.
  std::array<double, 3> at(double dx, double dy) const {
    std::array<double, 3> out;
    for (int i = 0; i < 3; ++i)
      out[i] = P[i] + dx * (view[3 * i] / in.camera.fx) + dy * (view[3 * i + 1] / in.camera.fy);
    return out;
  }
  std::array<double, 2> project(const std::array<double, 3>& Q) const {
    return {in.camera.fx * (Q[0] / Q[2]) + in.camera.cx,
            in.camera.fy * (Q[1] / Q[2]) + in.camera.cy};
  }
  bool fits() const {
    if (!(P[2] > 0) || !patch_fits(*in.grid, plane, middle[0], middle[1])) return false;
    for (int dx : {in.grid->left, in.grid->right()})
      for (int dy : {in.grid->top, in.grid->bottom()}) {
        const auto Q = at(dx, dy);
        const auto u = project(Q);
        if (!(Q[2] > 0) || !pixel_fits(plane, u[0], u[1])) return false;
      }
    return true;
  }
};

struct PatchCost {
  double rho = 0, square = 0;
};

/// The rows of a loss on a patch as one vector r, s = |r|^2: N J and its residual
/// (geometry/row_metric.h). Returns rho.
double apply_patch_loss(const ScaledLoss& loss, double s, std::vector<PixelRow>& rows) {
  const LossValue<double> rho = evaluate_loss(loss, s);
  const double phi = curvature_along(loss, rho, s), root = std::sqrt(rho.first);
  PixelRow b{};
  for (const PixelRow& row : rows)
    for (std::size_t k = 0; k < kResidual; ++k) b[k] += row[k] * row[kResidual];
  const double shorter = s > 0 ? (1 - std::sqrt(phi)) / s : 0;
  for (PixelRow& row : rows) {
    for (std::size_t k = 0; k < kResidual; ++k)
      row[k] = root * (row[k] - shorter * row[kResidual] * b[k]);
    row[kResidual] *= root / std::sqrt(phi);
  }
  return rho.value;
}

/// The rows of a patch's pixels, by the loss's metric.
PatchCost list_pixels(const PatchLane& patch, std::vector<PixelRow>& rows) {
  const PhotometricInput& in = patch.in;
  const PatchGrid& grid = *in.grid;
  const double alpha = patch.view[view_record::kAlpha], beta = patch.view[view_record::kBeta];
  PatchCost cost;
  rows.clear();
  for (std::uint32_t cell : grid.place) {
    const auto P = patch.at(grid.dx[cell], grid.dy[cell]);
    const auto u = patch.project(P);
    const GreySample grey = sample(patch.plane, in.taps, u[0], u[1]);
    const double g = patch.reference[cell], r = grey.value - (alpha * g + beta);
    double weight = 1, along = 1;
    cost.square += r * r;
    if (!in.loss_per_patch) {
      const auto rho = evaluate_loss(in.loss, r * r);
      cost.rho += rho.value;
      along = curvature_along(in.loss, rho, r * r);
      weight = std::sqrt(rho.first * along);
    }
    const double a0 = weight * grey.dx * in.camera.fx / P[2];
    const double a1 = weight * grey.dy * in.camera.fy / P[2];
    const double a2 = -(a0 * P[0] + a1 * P[1]) / P[2];
    const double bright = in.brightness ? -weight : 0;
    rows.push_back({a0, a1, a2, P[1] * a2 - P[2] * a1, P[2] * a0 - P[0] * a2, P[0] * a1 - P[1] * a0,
                    bright * g, bright, weight * r / along});
  }
  if (!in.loss_per_patch) return cost;
  cost.rho = apply_patch_loss(in.loss, cost.square, rows);
  return cost;
}

/// `to`: the lane's first field in the batch of the first pair.
void write_rows(const std::vector<PixelRow>& R, const double* view, double s, std::size_t lanes,
                double* to) {
  const double* t = view + pose_record::kTranslation;
  for (std::size_t i = 0; i < std::min<std::size_t>(2 * kExactPairs, R.size()); ++i) {
    double* pair = to + kRowBatch * (i / 2);
    const int row = static_cast<int>(i % 2);
    const auto put = [&](int field, double x) {
      pair[lanes * static_cast<std::size_t>(field)] = x;
    };
    put(row_field::residual(row), R[i][kResidual]);
    for (int k = 0; k < 8; ++k) put(row_field::camera(row, k), (k < 3 ? s : 1.0) * R[i][k]);
    put(row_field::point(row, 0), R[i][0] * t[0] + R[i][1] * t[1] + R[i][2] * t[2]);
  }
}

/// The other rows: products of alpha and beta with each other and with r.
void write_brightness(const std::vector<PixelRow>& R, double* to) {
  double sums[5] = {0, 0, 0, 0, 0};
  for (std::size_t i = 2 * kExactPairs; i < std::min(kColumns, R.size()); ++i) {
    const double a = R[i][6], b = R[i][7], r = R[i][kResidual];
    sums[0] += a * a, sums[1] += a * b, sums[2] += b * b;
    sums[3] += a * r, sums[4] += b * r;
  }
  for (int k = 0; k < 5; ++k) to[8 * k] = sums[k];
}

/// One lane of one batch.
PatchCost collapse_lane(const PhotometricInput& in, std::size_t g, std::uint64_t b, int lane,
                        int lanes, PhotometricOutput& out, std::vector<PixelRow>& rows) {
  const std::uint32_t block = in.batches->image[8 * b + static_cast<std::size_t>(lane)];
  const double* view = in.views + kViewRecord * block;
  const double* d = in.rays + kPointGroup * g + lane;
  const double s = in.points[kPointGroup * g + static_cast<std::size_t>(lane)];
  const std::size_t point = in.batches->lane_point[8 * g + static_cast<std::size_t>(lane)];
  PatchLane patch{in, view, in.planes[in.block_image[block]],
                  {}, {},   in.references + in.grid->cells() * point};
  for (int i = 0; i < 3; ++i)
    patch.P[i] = view[3 * i] * d[0] + view[3 * i + 1] * d[8] + view[3 * i + 2] * d[16] +
                 s * view[pose_record::kTranslation + i];
  const auto u = patch.project({patch.P[0], patch.P[1], patch.P[2]});
  patch.middle[0] = u[0], patch.middle[1] = u[1];
  double* seen = out.seen + 16 * b + lane;
  PatchCost cost;
  if (patch.fits()) {
    cost = list_pixels(patch, rows);
    triangularise(rows);
    write_rows(rows, view, s, static_cast<std::size_t>(lanes),
               out.rows + kRowBatch * kExactPairs * b + first_row_field(lanes, lane));
    if (in.brightness) write_brightness(rows, out.brightness + kBrightnessBatch * b + lane);
    seen[0] = u[0], seen[8] = u[1];
  } else {
    if (in.leaving != nullptr) {
      const double* leaving = in.leaving + 16 * b + lane;
      cost = {leaving[0], leaving[8]};
    }
    seen[0] = seen[8] = std::numeric_limits<double>::quiet_NaN();
    ++out.left;
  }
  if (out.costs != nullptr) {
    double* costs = out.costs + 16 * b + lane;
    costs[0] = cost.rho, costs[8] = cost.square;
  }
  return cost;
}

}  // namespace

void collapse_exactly(const PhotometricInput& in, int lanes, std::uint32_t first, std::uint32_t end,
                      PhotometricOutput& out) {
  std::vector<PixelRow> rows;
  for (std::uint32_t g = first; g < end; ++g) {
    const Batches::Group group = in.batches->groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
      std::fill_n(out.rows + kRowBatch * kExactPairs * b, kRowBatch * kExactPairs, 0.0);
      std::fill_n(out.seen + 16 * b, 16, std::numeric_limits<double>::quiet_NaN());
      if (out.costs != nullptr) std::fill_n(out.costs + 16 * b, 16, 0.0);
      if (in.brightness) std::fill_n(out.brightness + kBrightnessBatch * b, kBrightnessBatch, 0.0);
      for (int lane = 0; lane < static_cast<int>(group.lanes); ++lane) {
        const PatchCost cost = collapse_lane(in, g, b, lane, lanes, out, rows);
        out.cost += cost.rho;
        out.square_sum += cost.square;
      }
    }
  }
}

}  // namespace sheaf
