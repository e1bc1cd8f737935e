// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Back-substitution, the trial cost and the implicit product of lenses once more as plain scalar
// code (reference_lens.cc).
#include <algorithm>
#include <cmath>

#include "eliminate/reference_lens.h"

namespace sheaf {
namespace {

/// What a point costs where it stands, and its normal equations there.
struct PointCost {
  double square = 0, cost = 0;
  PointNormal normal;
};

PointCost cost_at(const LensTrialInput& in, const Batches::Group& group, const Vector3<double>& X,
                  std::uint32_t lane) {
  PointCost out;
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    LensRow row = lens_row({in.batches, in.tracks, in.tried}, X, b, lane);
    const LossValue<double> rho = evaluate_loss(in.loss, row.square());
    out.square += row.square();
    out.cost += rho.value;
    row.scale(std::sqrt(rho.first));
    out.normal.add(row);
  }
  return out;
}

/// Inner iterations (eliminate/kernels.h) of one point from X; returns the cost where it ends.
PointCost refine_point(const LensTrialInput& in, const Batches::Group& group, std::uint32_t lane,
                       const double* factor, Vector3<double>& X) {
  PointCost best = cost_at(in, group, X, lane);
  const double mean = in.mean_square * group.track;
  for (int step = 0; step < in.inner_iterations; ++step) {
    Matrix3<double> A = best.normal.V;
    for (std::size_t i = 0; i < 3; ++i)
      A[4 * i] += inner_iterations::kDamping * factor[factor_group::damping(static_cast<int>(i))];
    const Factor3 f = Factor3::of(A);
    const Vector3<double> w = f.forward(best.normal.g.data());
    const double decrease = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    if (!(decrease > inner_iterations::kWorthOne * mean)) break;
    const Vector3<double> d = f.backward(w), Y{X[0] + d[0], X[1] + d[1], X[2] + d[2]};
    const PointCost there = cost_at(in, group, Y, lane);
    if (!(there.cost < best.cost)) break;
    X = Y, best = there;
    if (!(decrease > inner_iterations::kWorthMore * mean)) break;
  }
  return best;
}

/// Jc dc of the step that the records hold.
std::array<double, 2> step_of_camera(const LensInput& in, const LensRow& row, std::uint64_t batch,
                                     std::uint32_t lane) {
  const double* pose = image_record_of(in, batch, lane) + image_record::kStep;
  const double* dk = lens_record_of(in, batch, lane) + lens_record::kStep;
  const std::size_t parameters = parameter_count(lens_of(in, batch, lane).model);
  std::array<double, 2> e{};
  for (std::size_t r = 0; r < 2; ++r) {
    for (std::size_t i = 0; i < 6; ++i) e[r] += row.camera[r][i] * pose[i];
    for (std::size_t p = 0; p < parameters; ++p) e[r] += row.J.parameters[r][p] * dk[p];
  }
  return e;
}

/// s += Jp^T w e.
void add_to_point(const PointRow& row, double w, const std::array<double, 2>& e,
                  Vector3<double>& s) {
  for (std::size_t i = 0; i < 3; ++i) s[i] += w * (row.point[0][i] * e[0] + row.point[1][i] * e[1]);
}

/// The point's step d as back-substitution has it.
Vector3<double> step_of_point(const LensTrialInput& in, std::size_t g, std::uint32_t lane,
                              const Vector3<double>& X) {
  const Batches::Group& group = in.batches->groups[g];
  const LensInput held{in.batches, in.tracks, in.held};
  const double* weights = in.loss.kind == LossKind::none ? nullptr : in.weights;
  Vector3<double> s{};
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const LensRow row = lens_row(held, X, b, lane);
    add_to_point(row, weight_of(weights, b, lane), step_of_camera(held, row, b, lane), s);
  }
  return back_substitute(in.factors + kFactorGroup * g + lane, s);
}

void try_point(const LensTrialInput& in, std::size_t g, std::uint32_t lane, TrialOutput& out) {
  const Batches::Group& group = in.batches->groups[g];
  const Vector3<double> X = point_of(in.held.points, g, lane);
  Vector3<double> Y = X;
  const bool real = lane < group.lanes;  // others stay where they are
  const double* factor = in.factors + kFactorGroup * g + lane;
  if (real) {
    const Vector3<double> d = step_of_point(in, g, lane, X);
    for (std::size_t i = 0; i < 3; ++i) {
      Y[i] += d[i];
      out.damping_term += d[i] * d[i] * factor[factor_group::damping(static_cast<int>(i))];
    }
    const PointCost cost = refine_point(in, group, lane, factor, Y);
    out.square_sum += cost.square;
    if (in.loss.kind != LossKind::none) out.loss_sum += cost.cost;
  }
  double moved = 0, size = 1e-300;
  for (std::size_t i = 0; i < 3; ++i) {
    out.points[kPointGroup * g + 8 * i + lane] = Y[i];
    moved += (Y[i] - X[i]) * (Y[i] - X[i]), size += X[i] * X[i];
  }
  out.step2_max = std::max(out.step2_max, moved / size);
}

/// Of one point: e = Jc x, u = (V + D)^-1 sum Jp^T w e, y += Jc^T w (e - Jp u).
void multiply_point(const LensProductInput& in, std::size_t g, std::uint32_t lane, double* y) {
  const Batches::Group& group = in.of.batches->groups[g];
  const Vector3<double> X = point_of(in.of.at.points, g, lane);
  const auto along = [&](const LensRow& row, const BlocksOfRow& of) {
    std::array<double, 2> e{};
    for (std::size_t r = 0; r < 2; ++r)
      for (std::size_t k = 0; k < of.count; ++k)
        for (std::size_t i = 0; i < 9; ++i)
          e[r] += BlocksOfRow::row(row, k, r)[i] * in.x[kProductRecord * of.block[k] + i];
    return e;
  };
  Vector3<double> s{};
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const LensRow row = lens_row(in.of, X, b, lane);
    add_to_point(row, weight_of(in.weights, b, lane), along(row, {in.of, b, lane}), s);
  }
  // back_substitute gives L^-T (w - L^-1 s): taken from that of s = 0, (V + D)^-1 s is left.
  const double* factor = in.factors + kFactorGroup * g + lane;
  const Vector3<double> with = back_substitute(factor, s), without = back_substitute(factor, {});
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const LensRow row = lens_row(in.of, X, b, lane);
    const BlocksOfRow of(in.of, b, lane);
    std::array<double, 2> e = along(row, of);
    for (std::size_t r = 0; r < 2; ++r) {
      for (std::size_t i = 0; i < 3; ++i) e[r] -= row.point[r][i] * (without[i] - with[i]);
      for (std::size_t k = 0; k < of.count; ++k)
        for (std::size_t i = 0; i < 9; ++i)
          y[kProductRecord * of.block[k] + i] +=
              weight_of(in.weights, b, lane) * BlocksOfRow::row(row, k, r)[i] * e[r];
    }
  }
}

}  // namespace

void lens_trial_by_reference(const LensTrialInput& in, const Chunk& chunk, TrialOutput& out) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < 8; ++l) try_point(in, g, l, out);
}

void lens_product_by_reference(const LensProductInput& in, const Chunk& chunk, double*, double* y) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < in.of.batches->groups[g].lanes; ++l) multiply_point(in, g, l, y);
}

}  // namespace sheaf
