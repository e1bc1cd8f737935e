// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Back-substitution fused with the cost at the stepped state, for lenses of any model: as
// trial-inl.h does it for BAL cameras.
#if defined(SHEAF_LINEAR_LENS_TRIAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_LENS_TRIAL_INL_H_
#undef SHEAF_LINEAR_LENS_TRIAL_INL_H_
#else
#define SHEAF_LINEAR_LENS_TRIAL_INL_H_
#endif

#include "eliminate/eliminate-inl.h"
#include "eliminate/lens_rows-inl.h"
#include "eliminate/trial-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// e = A (rho + phi x P) + (du / dk) dk of one observation per lane.
HWY_INLINE void lens_motion(const LensView& s, int parameters, V* e) {
  const V *rho = s.c + image_record::kStep, *phi = rho + 3;
  const V P0 = s.P[0].v, P1 = s.P[1].v, P2 = s.P[2].v;
  const V d[3] = {hn::Add(rho[0], fms(phi[1], P2, hn::Mul(phi[2], P1))),
                  hn::Add(rho[1], fms(phi[2], P0, hn::Mul(phi[0], P2))),
                  hn::Add(rho[2], fms(phi[0], P1, hn::Mul(phi[1], P0)))};
  const Lane* dk = s.k + lens_record::kStep;
  for (int r = 0; r < 2; ++r) {
    e[r] = fma(s.J.point[r][0].v, d[0],
               fma(s.J.point[r][1].v, d[1], hn::Mul(s.J.point[r][2].v, d[2])));
    for (int i = 0; i < parameters; ++i)
      e[r] = fma(s.J.parameters[r][static_cast<std::size_t>(i)].v, dk[i].v, e[r]);
  }
}

/// s += Jp^T w Jc dc of one observation per lane; weights: nullptr for w = 1.
HWY_INLINE void add_lens_coupling(const LensTrialInput& in, std::uint64_t batch, int lane,
                                  const V* X, const double* weights, V* s) {
  LensView view;
  const LensTracks& tracks = *in.tracks;
  look<Wanted::parameters, true>(*in.batches, tracks, in.held, batch, lane, X, view);
  const std::int32_t kind = tracks.uniform_kind[batch];
  const int count = kind < 0
                        ? tracks.most_parameters
                        : static_cast<int>(parameter_count(tracks.kinds[std::size_t(kind)].model));
  V e[2], point[2][3];
  lens_motion(view, count, e);
  if (weights != nullptr)
    for (V& x : e) x = hn::Mul(x, load(weights));
  point_rows(view, point);
  for (int i = 0; i < 3; ++i) s[i] = fma(point[0][i], e[0], fma(point[1][i], e[1], s[i]));
}

/// One pass over a group's observations at X: their cost and, if asked for, the point's sums.
template <bool Robust, bool kLinearize>
HWY_INLINE TrackCost pass_lens_group(const LensTrialInput& in, const Batches::Group& group,
                                     int lane, const V* X, PointSums& sums) {
  V square = zero(), cost = zero();
  if (kLinearize) sums.clear();
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    LensView s;
    look<kLinearize ? Wanted::point : Wanted::pixel, false>(*in.batches, *in.tracks, in.tried, b,
                                                            lane, X, s);
    const double* z = &in.batches->xy[16 * b + lane];
    LaneJacobian j;
    for (int r = 0; r < 2; ++r) j.r[r] = hn::Sub(s.J.pixel[r].v, load(z + 8 * r));
    const V square_here = fma(j.r[0], j.r[0], hn::Mul(j.r[1], j.r[1]));
    square = hn::Add(square, square_here);
    [[maybe_unused]] Rho rho{};
    if constexpr (Robust) {
      rho = rho_lanes(LossLanes(in.loss), square_here);
      cost = hn::Add(cost, rho.value);
    }
    if constexpr (kLinearize) {
      point_rows(s, j.point);
      if constexpr (Robust) {
        const V root = hn::Sqrt(rho.weight);
        for (int r = 0; r < 2; ++r) {
          j.r[r] = hn::Mul(j.r[r], root);
          for (V& x : j.point[r]) x = hn::Mul(x, root);
        }
      }
      sums.add(j);
    }
  }
  return {square, Robust ? cost : square};
}

struct RefinedLensPoint {
  V X[3];
  TrackCost at;
};

/// Gauss-Newton steps of each point by itself, as refine_points in trial-inl.h.
template <bool Robust>
HWY_INLINE void refine_lens_points(const LensTrialInput& in, const Batches::Group& group, int lane,
                                   const double* pd, V mask, RefinedLensPoint& best) {
  PointSums p;
  best.at = pass_lens_group<Robust, true>(in, group, lane, best.X, p);
  auto active = hn::Gt(mask, zero());
  const double mean = in.mean_square * group.track;
  const V worth_one = set(inner_iterations::kWorthOne * mean);
  const V worth_more = set(inner_iterations::kWorthMore * mean);
  const V weak = set(inner_iterations::kDamping);
  for (int steps_left = in.inner_iterations; steps_left > 0;) {
    const Factor f = factor3(fma(weak, load(pd + factor_group::damping(0)), p.v00), p.v01, p.v02,
                             fma(weak, load(pd + factor_group::damping(1)), p.v11), p.v12,
                             fma(weak, load(pd + factor_group::damping(2)), p.v22));
    V w[3], d[3], Y[3];
    forward(f, p.g, w);
    backward(f, w, d);
    const V decrease = fma(w[0], w[0], fma(w[1], w[1], hn::Mul(w[2], w[2])));
    active = hn::And(active, hn::Gt(decrease, worth_one));
    if (hn::AllFalse(D(), active)) return;
    const auto far = hn::And(active, hn::Gt(decrease, worth_more));
    steps_left = hn::AllFalse(D(), far) ? 0 : steps_left - 1;
    for (int i = 0; i < 3; ++i) Y[i] = hn::Add(best.X[i], d[i]);
    const TrackCost at = steps_left > 0 ? pass_lens_group<Robust, true>(in, group, lane, Y, p)
                                        : pass_lens_group<Robust, false>(in, group, lane, Y, p);
    active = hn::And(active, hn::Lt(at.cost, best.at.cost));
    for (int i = 0; i < 3; ++i) best.X[i] = hn::IfThenElse(active, Y[i], best.X[i]);
    best.at = {hn::IfThenElse(active, at.square, best.at.square),
               hn::IfThenElse(active, at.cost, best.at.cost)};
    active = hn::And(active, far);
  }
}

template <bool Robust>
HWY_INLINE void lens_trial_part(const LensTrialInput& in, std::size_t g, int part, double* stepped,
                                TrialSums& sums) {
  const Batches::Group& group = in.batches->groups[g];
  const int lane = part * kLanes;
  const double* from = in.held.points + kPointGroup * g + lane;
  const double* pd = in.factors + kFactorGroup * g + lane;
  const V X[3] = {load(from), load(from + 8), load(from + 16)};
  const V mask = lane_mask(group.lanes, lane);
  V s[3] = {zero(), zero(), zero()}, d[3];
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
    add_lens_coupling(in, b, lane, X, Robust ? in.weights + 8 * b + lane : nullptr, s);
  if (group.lanes < 8)  // masked lanes stay where they are
    for (V& x : s) x = hn::Mul(x, mask);
  const V damping = back_substitute(pd, s, d);
  RefinedLensPoint y{{hn::Add(X[0], d[0]), hn::Add(X[1], d[1]), hn::Add(X[2], d[2])}, {}};
  PointSums unused;
  if (in.inner_iterations > 0)
    refine_lens_points<Robust>(in, group, lane, pd, mask, y);
  else
    y.at = pass_lens_group<Robust, false>(in, group, lane, y.X, unused);
  for (int i = 0; i < 3; ++i) store(y.X[i], stepped + kPointGroup * g + 8 * i + lane);
  sums.square[part] = fma(y.at.square, mask, sums.square[part]);
  if (Robust) sums.loss[part] = fma(y.at.cost, mask, sums.loss[part]);
  sums.damping[part] = fma(damping, mask, sums.damping[part]);
  sums.step2[part] = hn::Max(sums.step2[part], relative_step2(X, y.X[0], y.X[1], y.X[2]));
}

template <bool Robust>
inline void lens_trial_chunk(const LensTrialInput& in, const Chunk& chunk, TrialOutput& out) {
  TrialSums sums;
  for (int p = 0; p < kParts; ++p)
    sums.square[p] = sums.loss[p] = sums.damping[p] = sums.step2[p] = zero();
  const std::size_t groups = in.batches->groups.size();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    prefetch_groups(in.held.points, in.factors, 12, g + 1, std::min<std::size_t>(g + 2, groups));
    for (int p = 0; p < kParts; ++p) lens_trial_part<Robust>(in, g, p, out.points, sums);
  }
  out.square_sum += sum_parts(sums.square);
  if (Robust) out.loss_sum += sum_parts(sums.loss);
  out.damping_term += sum_parts(sums.damping);
  const double step2 = max_parts(sums.step2);
  out.step2_max = step2 > out.step2_max ? step2 : out.step2_max;
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
