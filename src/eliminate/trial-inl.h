// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Back-substitution fused with the cost at the stepped state. Jacobians are not stored: what the
// camera step does to a pixel, e = Jc dc, and Jp^T e are recomputed from the state.
#if defined(SHEAF_LINEAR_TRIAL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_TRIAL_INL_H_
#undef SHEAF_LINEAR_TRIAL_INL_H_
#else
#define SHEAF_LINEAR_TRIAL_INL_H_
#endif

#include <hwy/cache_control.h>

#include <algorithm>

#include "eliminate/eliminate-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// e = Jc dc of one observation per lane; c: the fields of its camera record.
template <class C, class W>
HWY_INLINE void camera_motion(const C& c, const SeenAs<W>& seen, W fd, W dd, W& e0, W& e1) {
  // dP = phi x P + rho, d p = iz (dP.xy + p dP.z), and iz P = (x, y, -1).
  using namespace camera_record;
  const W m0 = fnma(c[kPhi + 2], seen.y, fms(seen.iz, c[kRho], c[kPhi + 1]));
  const W m1 = fma(c[kPhi + 2], seen.x, fma(seen.iz, c[kRho + 1], c[kPhi]));
  const W m2 = fnma(c[kPhi + 1], seen.x, fma(c[kPhi], seen.y, hn::Mul(seen.iz, c[kRho + 2])));
  const W dx = fma(seen.x, m2, m0);
  const W dy = fma(seen.y, m2, m1);
  const W intrinsic = fma(seen.n, fma(seen.n, c[kRadial + 2], c[kRadial + 1]), c[kRadial]);
  const W along = fma(dd, fma(seen.x, dx, hn::Mul(seen.y, dy)), intrinsic);
  e0 = fma(fd, dx, hn::Mul(along, seen.x));
  e1 = fma(fd, dy, hn::Mul(along, seen.y));
}

/// s += Jp^T e: A^T e with A = iz (fd I + dd p p^T) [I | p], then R^T.
template <class C, class W>
HWY_INLINE void add_to_point(const C& c, const SeenAs<W>& seen, W fd, W dd, W e0, W e1, W* s) {
  const W t = hn::Mul(dd, fma(seen.x, e0, hn::Mul(seen.y, e1)));
  const W h0 = hn::Mul(seen.iz, fma(fd, e0, hn::Mul(t, seen.x)));
  const W h1 = hn::Mul(seen.iz, fma(fd, e1, hn::Mul(t, seen.y)));
  const W h2 = fma(seen.x, h0, hn::Mul(seen.y, h1));
  for (int i = 0; i < 3; ++i) s[i] = fma(c[i], h0, fma(c[3 + i], h1, fma(c[6 + i], h2, s[i])));
}

/// s += Jp^T w Jc dc of one observation per lane; weights: nullptr for w = 1.
HWY_INLINE void add_coupled(const V* c, const Seen& seen, const double* weights, V* s) {
  const V fd = hn::Mul(c[camera_record::kFocal], distortion(c, seen.n));
  const V dd = distortion_slope(c, seen.n);
  V e0, e1;
  camera_motion(c, seen, fd, dd, e0, e1);
  if (weights != nullptr) {
    const V w = load(weights);
    e0 = hn::Mul(e0, w), e1 = hn::Mul(e1, w);
  }
  add_to_point(c, seen, fd, dd, e0, e1, s);
}

struct TrialSums {
  V square[kParts], loss[kParts], damping[kParts], step2[kParts], behind[kParts];
};

HWY_INLINE V squared_residual(const V* c, const Seen& s, V zx, V zy) {
  const V fd = hn::Mul(c[camera_record::kFocal], distortion(c, s.n));
  const V r0 = fms(fd, s.x, zx), r1 = fms(fd, s.y, zy);
  return fma(r0, r0, hn::Mul(r1, r1));
}

/// The points and the first `rows` rows of the factors of groups [first, end): asked for early,
/// because they come from far away and nothing of a group can begin without them.
HWY_INLINE void prefetch_groups(const double* points, const double* factors, int rows,
                                std::size_t first, std::size_t end) {
  for (std::size_t g = first; g < end; ++g) {
    for (int i = 0; i < 3; ++i) hwy::Prefetch(points + kPointGroup * g + 8 * i);
    for (int i = 0; i < rows; ++i) hwy::Prefetch(factors + kFactorGroup * g + 8 * i);
  }
}

HWY_INLINE Factor load_factor(const double* pd) {
  const auto field = [pd](int i) { return load(pd + factor_group::factor(i)); };
  return {field(0), field(1), field(2), field(3), field(4), field(5)};
}

/// L^-T u.
template <class W>
HWY_INLINE void backward(const FactorAs<W>& f, const W* u, W* d) {
  d[2] = hn::Mul(u[2], f.i22);
  d[1] = hn::Mul(fnma(f.l21, d[2], u[1]), f.i11);
  d[0] = hn::Mul(fnma(f.l20, d[2], fnma(f.l10, d[1], u[0])), f.i00);
}

/// u = (V + D)^-1 s.
HWY_INLINE void solve_point(const double* pd, const V* s, V* u) {
  const Factor f = load_factor(pd);
  V y[3];
  forward(f, s, y);
  backward(f, y, u);
}

/// d = L^-T (w - L^-1 s); returns d^T D d.
HWY_INLINE V back_substitute(const double* pd, const V* s, V* d) {
  const Factor f = load_factor(pd);
  V u[3];
  forward(f, s, u);
  for (int i = 0; i < 3; ++i) u[i] = hn::Sub(load(pd + factor_group::w(i)), u[i]);
  backward(f, u, d);
  V sum = zero();
  for (int i = 0; i < 3; ++i)
    sum = fma(hn::Mul(d[i], d[i]), load(pd + factor_group::damping(i)), sum);
  return sum;
}

/// gradient = L w = -Jp^T r, and lambda D^-1 of it.
HWY_INLINE void descend_point(const double* pd, V lambda, V* gradient, V* step) {
  const Factor f = load_factor(pd);
  const V w0 = load(pd + factor_group::w(0)), w1 = load(pd + factor_group::w(1)),
          w2 = load(pd + factor_group::w(2));
  gradient[0] = hn::Div(w0, f.i00);
  gradient[1] = fma(f.l10, w0, hn::Div(w1, f.i11));
  gradient[2] = fma(f.l20, w0, fma(f.l21, w1, hn::Div(w2, f.i22)));
  for (int i = 0; i < 3; ++i)
    step[i] = hn::Div(hn::Mul(lambda, gradient[i]), load(pd + factor_group::damping(i)));
}

HWY_INLINE void blend_step(const PointBlend& blend, const double* pd, V* d) {
  V gradient[3], descent[3];
  descend_point(pd, set(blend.descent), gradient, descent);
  for (int i = 0; i < 3; ++i) d[i] = fma(set(blend.newton), d[i], descent[i]);
}

/// Sum |r|^2 of a track, and sum rho(|r|^2): the same without a loss.
struct TrackCost {
  V square, cost;
};

/// The points of a part while they are refined: the best place so far and what it costs.
struct Refined {
  V X0, X1, X2;
  TrackCost at;
};

/// One pass over a group's observations at X: their cost and, if asked for, the point's sums.
/// chart: of the points' sums; nullptr: by X, Y, Z.
template <bool Robust, bool kLinearize>
HWY_INLINE TrackCost pass_group(const TrialInput& in, const Batches::Group& group, int lane, V X0,
                                V X1, V X2, [[maybe_unused]] const LaneChart* chart,
                                PointSums& sums) {
  const Batches& batches = *in.batches;
  V square = zero(), cost = zero();
  if (kLinearize) sums.clear();
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    V c[8 * camera_record::kStateOctets];
    load_cameras<camera_record::kStateOctets>(in.trial_cameras, &batches.image[8 * b + lane],
                                              batches.uniform[b], c);
    const double* z = &batches.xy[16 * b + lane];
    if (kLinearize) {
      LaneJacobian j = linearize_lanes(c, X0, X1, X2, load(z), load(z + 8), nullptr);
      // Summed as below: which way a lane goes depends on its neighbours, its bits must not.
      square = hn::Add(square, fma(j.r[0], j.r[0], hn::Mul(j.r[1], j.r[1])));
      if constexpr (Robust) cost = hn::Add(cost, apply_loss(in.loss, j).value);
      if (chart != nullptr)
        for (V* row : {j.point[0], j.point[1]}) chart->transpose(row);
      sums.add(j);
    } else {
      const V r2 = squared_residual(c, see(c, X0, X1, X2), load(z), load(z + 8));
      square = hn::Add(square, r2);
      if constexpr (Robust) cost = hn::Add(cost, rho_lanes(LossLanes(in.loss), r2).value);
    }
  }
  return {square, Robust ? cost : square};
}

/// Points of a chart that their step has lost (kernels.h, kLost) go back to `stay`, where that is
/// better.
template <bool Robust>
HWY_INLINE void recover_points(const TrialInput& in, const Batches::Group& group, int lane, V mask,
                               const V* base, const V* stay, LaneChart& chart, PointSums& p,
                               Refined& best) {
  const V most = set(inner_iterations::kLost * in.mean_square * group.track);
  const auto sound = hn::Or(hn::Eq(mask, zero()), hn::Le(best.at.cost, most));
  if (hn::AllTrue(D(), sound)) return;
  const V Y0 = hn::IfThenElse(sound, best.X0, stay[0]),
          Y1 = hn::IfThenElse(sound, best.X1, stay[1]),
          Y2 = hn::IfThenElse(sound, best.X2, stay[2]);
  const TrackCost there = pass_group<Robust, false>(in, group, lane, Y0, Y1, Y2, nullptr, p);
  // Not finite is not less.
  const auto keep = hn::Or(sound, hn::Le(best.at.cost, there.cost));
  best.X0 = hn::IfThenElse(keep, best.X0, Y0);
  best.X1 = hn::IfThenElse(keep, best.X1, Y1);
  best.X2 = hn::IfThenElse(keep, best.X2, Y2);
  chart.place(in.chart, best.X0, best.X1, best.X2, base);
  best.at = pass_group<Robust, true>(in, group, lane, best.X0, best.X1, best.X2, &chart, p);
}

/// Gauss-Newton steps of each point by itself with the stepped cameras held, as long as they are
/// worth a pass and lower that point's own cost (kernels.h, inner_iterations). base: of the charts,
/// where the stepped cameras have it; stay: the points, had they only followed it.
template <bool Robust, bool Charted>
HWY_INLINE void refine_points(const TrialInput& in, const Batches::Group& group, int lane,
                              const double* pd, V mask, [[maybe_unused]] const V* base,
                              [[maybe_unused]] const V* stay, Refined& best) {
  LaneChart chart;
  const LaneChart* const used = Charted ? &chart : nullptr;
  if constexpr (Charted) chart.place(in.chart, best.X0, best.X1, best.X2, base);
  PointSums p;
  best.at = pass_group<Robust, true>(in, group, lane, best.X0, best.X1, best.X2, used, p);
  auto active = hn::Gt(mask, zero());
  if constexpr (Charted) recover_points<Robust>(in, group, lane, mask, base, stay, chart, p, best);
  const double mean = in.mean_square * group.track;
  const V worth_one = set(inner_iterations::kWorthOne * mean);
  const V worth_more = set(inner_iterations::kWorthMore * mean);
  const V weak = set(in.blend.inner_damping);
  for (int steps_left = in.inner_iterations; steps_left > 0;) {
    const Factor f = factor3(fma(weak, load(pd + factor_group::damping(0)), p.v00), p.v01, p.v02,
                             fma(weak, load(pd + factor_group::damping(1)), p.v11), p.v12,
                             fma(weak, load(pd + factor_group::damping(2)), p.v22));
    V w[3], d[3];
    forward(f, p.g, w);
    backward(f, w, d);
    const V decrease = fma(w[0], w[0], fma(w[1], w[1], hn::Mul(w[2], w[2])));
    active = hn::And(active, hn::Gt(decrease, worth_one));
    if (hn::AllFalse(D(), active)) return;
    const auto far = hn::And(active, hn::Gt(decrease, worth_more));
    steps_left = hn::AllFalse(D(), far) ? 0 : steps_left - 1;
    V Y0 = hn::Add(best.X0, d[0]), Y1 = hn::Add(best.X1, d[1]), Y2 = hn::Add(best.X2, d[2]);
    if constexpr (Charted) {
      V step[3], to[3];
      chart.apply(d, step);
      chart.retract(in.chart, step, to);
      Y0 = hn::Add(base[0], to[0]), Y1 = hn::Add(base[1], to[1]), Y2 = hn::Add(base[2], to[2]);
      chart.place(in.chart, Y0, Y1, Y2, base);
    }
    const TrackCost at = steps_left > 0
                             ? pass_group<Robust, true>(in, group, lane, Y0, Y1, Y2, used, p)
                             : pass_group<Robust, false>(in, group, lane, Y0, Y1, Y2, used, p);
    active = hn::And(active, hn::Lt(at.cost, best.at.cost));
    best = {hn::IfThenElse(active, Y0, best.X0),
            hn::IfThenElse(active, Y1, best.X1),
            hn::IfThenElse(active, Y2, best.X2),
            {hn::IfThenElse(active, at.square, best.at.square),
             hn::IfThenElse(active, at.cost, best.at.cost)}};
    active = hn::And(active, far);
  }
}

HWY_INLINE V count_crossed(const TrialInput& in, const Batches::Group& group, int lane,
                           const V* before, const Refined& after) {
  const Batches& batches = *in.batches;
  V behind = zero();
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const std::uint32_t* image = &batches.image[8 * b + lane];
    V c[8 * camera_record::kStateOctets];
    load_cameras<camera_record::kStateOctets>(in.trial_cameras, image, batches.uniform[b], c);
    const V P2 = see(c, after.X0, after.X1, after.X2).P2;
    load_cameras<camera_record::kStateOctets>(in.cameras, image, batches.uniform[b], c);
    const V held = see(c, before[0], before[1], before[2]).P2;
    const auto crossed = hn::And(hn::Gt(P2, zero()), hn::Le(held, zero()));
    behind = hn::Add(behind, hn::IfThenElseZero(crossed, set(1.0)));
  }
  return behind;
}

/// The step of a part's points in their charts.
struct ChartedStep {
  V base[3], moved[3];  ///< of the charts, before and after the cameras stepped
  V stay[3];            ///< the points, had they only followed it
  LaneChart from;

  /// d: by X, Y, Z. Returns q^T D q of its coordinates q.
  HWY_INLINE V take(const TrialInput& in, const Batches::Group& group, int lane, const double* pd,
                    V mask, const V* X, const V* d, Refined& y) {
    load_base(in.chart, *in.batches, group.first_batch, lane, in.cameras, base);
    load_base(in.chart, *in.batches, group.first_batch, lane, in.trial_cameras, moved);
    from.place(in.chart, X[0], X[1], X[2], base);
    V q[3], e[3], to[3], damping = zero();
    from.coordinates(d, q);
    for (int i = 0; i < 3; ++i) {
      damping = fma(hn::Mul(q[i], q[i]), load(pd + factor_group::damping(i)), damping);
      e[i] = hn::Sub(d[i], hn::Sub(moved[i], base[i]));
      stay[i] = hn::Add(moved[i], from.Y[i]);
    }
    from.retract(in.chart, e, to);
    const auto real = hn::Gt(mask, zero());
    y.X0 = hn::IfThenElse(real, hn::Add(moved[0], to[0]), X[0]);
    y.X1 = hn::IfThenElse(real, hn::Add(moved[1], to[1]), X[1]);
    y.X2 = hn::IfThenElse(real, hn::Add(moved[2], to[2]), X[2]);
    return damping;
  }

  /// Size of the step to y, refined or not.
  HWY_INLINE V size2(const TrialInput& in, V mask, const Refined& y) const {
    const V Y[3] = {hn::Sub(y.X0, moved[0]), hn::Sub(y.X1, moved[1]), hn::Sub(y.X2, moved[2])};
    return hn::IfThenElseZero(hn::Gt(mask, zero()), chart_step2_lanes(in.chart, from, Y));
  }
};

/// |Y - X|^2 / |X|^2.
HWY_INLINE V relative_step2(const V* X, V Y0, V Y1, V Y2) {
  const V d0 = hn::Sub(Y0, X[0]), d1 = hn::Sub(Y1, X[1]), d2 = hn::Sub(Y2, X[2]);
  const V moved = fma(d0, d0, fma(d1, d1, hn::Mul(d2, d2)));
  return hn::Div(moved, fma(X[0], X[0], fma(X[1], X[1], fma(X[2], X[2], set(1e-300)))));
}

template <bool Robust, bool Charted>
HWY_INLINE void trial_part(const TrialInput& in, const Batches::Group& group, std::size_t g,
                           int part, double* stepped, TrialSums& sums) {
  const Batches& batches = *in.batches;
  const int lane = part * kLanes;
  const double* from = in.points + kPointGroup * g + lane;
  const double* pd = in.factors + kFactorGroup * g + lane;
  const V X[3] = {load(from), load(from + 8), load(from + 16)};
  V s[3] = {zero(), zero(), zero()};
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    V c[kCameraRecord];
    load_cameras<camera_record::kOctets>(in.cameras, &batches.image[8 * b + lane],
                                         batches.uniform[b], c);
    add_coupled(c, see(c, X[0], X[1], X[2]), Robust ? in.weights + 8 * b + lane : nullptr, s);
  }
  V d[3];
  const V mask = lane_mask(group.lanes, lane);
  if (group.lanes < 8)  // masked lanes stay where they are
    for (V& x : s) x = hn::Mul(x, mask);
  V damping = back_substitute(pd, s, d);
  if (!in.blend.plain()) blend_step(in.blend, pd, d);
  Refined y{hn::Add(X[0], d[0]), hn::Add(X[1], d[1]), hn::Add(X[2], d[2]), {zero(), zero()}};
  [[maybe_unused]] ChartedStep charted;
  if constexpr (Charted) damping = charted.take(in, group, lane, pd, mask, X, d, y);
  PointSums unused;
  if (in.inner_iterations > 0)
    refine_points<Robust, Charted>(in, group, lane, pd, mask, charted.moved, charted.stay, y);
  else
    y.at = pass_group<Robust, false>(in, group, lane, y.X0, y.X1, y.X2, nullptr, unused);
  double* Y = stepped + kPointGroup * g + lane;
  store(y.X0, Y), store(y.X1, Y + 8), store(y.X2, Y + 16);
  sums.square[part] = fma(y.at.square, mask, sums.square[part]);
  if (Robust) sums.loss[part] = fma(y.at.cost, mask, sums.loss[part]);
  sums.damping[part] = fma(damping, mask, sums.damping[part]);
  V step2 = relative_step2(X, y.X0, y.X1, y.X2);
  if constexpr (Charted) step2 = charted.size2(in, mask, y);
  sums.step2[part] = hn::Max(sums.step2[part], step2);
  if (in.count_newly_behind)
    sums.behind[part] = fma(count_crossed(in, group, lane, X, y), mask, sums.behind[part]);
}

template <bool Robust, bool Charted>
inline void trial_chunk(const TrialInput& in, const Chunk& chunk, TrialOutput& out) {
  TrialSums sums;
  for (int p = 0; p < kParts; ++p)
    sums.square[p] = sums.loss[p] = sums.damping[p] = sums.step2[p] = sums.behind[p] = zero();
  const std::size_t groups = in.batches->groups.size();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    prefetch_groups(in.points, in.factors, 12, g + 1, std::min<std::size_t>(g + 2, groups));
    for (int p = 0; p < kParts; ++p)
      trial_part<Robust, Charted>(in, in.batches->groups[g], g, p, out.points, sums);
  }
  out.square_sum += sum_parts(sums.square);
  if (Robust) out.loss_sum += sum_parts(sums.loss);
  out.damping_term += sum_parts(sums.damping);
  const double step2 = max_parts(sums.step2);
  out.step2_max = step2 > out.step2_max ? step2 : out.step2_max;
  out.newly_behind += static_cast<std::uint64_t>(sum_parts(sums.behind));
}

/// |r_x| and |r_y| of every lane, masked ones included.
inline void residuals_chunk(const Batches& batches, const double* cameras, const double* points,
                            const Chunk& chunk, double* out) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group group = batches.groups[g];
    for (int lane = 0; lane < 8; lane += kLanes) {
      const double* X = points + kPointGroup * g + lane;
      for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
        V c[8 * camera_record::kStateOctets];
        load_cameras<camera_record::kStateOctets>(cameras, &batches.image[8 * b + lane],
                                                  batches.uniform[b], c);
        const double* z = &batches.xy[16 * b + lane];
        const Seen seen = see(c, load(X), load(X + 8), load(X + 16));
        const V fd = hn::Mul(c[camera_record::kFocal], distortion(c, seen.n));
        double* to = out + 16 * (b - chunk.first_batch) + lane;
        store(hn::Abs(fms(fd, seen.x, load(z))), to);
        store(hn::Abs(fms(fd, seen.y, load(z + 8))), to + 8);
      }
    }
  }
}

inline double square_sum_chunk(const Batches& batches, const double* cameras, const double* points,
                               const Chunk& chunk) {
  V sums[kParts];
  for (V& s : sums) s = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group group = batches.groups[g];
    for (int p = 0; p < kParts; ++p) {
      const int lane = p * kLanes;
      const double* X = points + kPointGroup * g + lane;
      V square = zero();
      for (std::uint32_t o = 0; o < group.track; ++o) {
        const std::uint64_t b = group.first_batch + o;
        V c[8 * camera_record::kStateOctets];
        load_cameras<camera_record::kStateOctets>(cameras, &batches.image[8 * b + lane],
                                                  batches.uniform[b], c);
        const double* z = &batches.xy[16 * b + lane];
        const Seen seen = see(c, load(X), load(X + 8), load(X + 16));
        square = hn::Add(square, squared_residual(c, seen, load(z), load(z + 8)));
      }
      if (group.lanes < 8) square = hn::Mul(square, lane_mask(group.lanes, lane));
      sums[p] = hn::Add(sums[p], square);
    }
  }
  return sum_parts(sums);
}

inline std::uint64_t count_behind_chunk(const Batches& batches, const double* cameras,
                                        const double* points, const Chunk& chunk) {
  V sums[kParts];
  for (V& s : sums) s = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group group = batches.groups[g];
    for (int p = 0; p < kParts; ++p) {
      const int lane = p * kLanes;
      const double* X = points + kPointGroup * g + lane;
      const V X0 = load(X), X1 = load(X + 8), X2 = load(X + 16);
      const V one = group.lanes < 8 ? lane_mask(group.lanes, lane) : set(1.0);
      for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
        V c[8 * camera_record::kStateOctets];
        load_cameras<camera_record::kStateOctets>(cameras, &batches.image[8 * b + lane],
                                                  batches.uniform[b], c);
        const V depth =
            fma(c[6], X0, fma(c[7], X1, fma(c[8], X2, c[camera_record::kTranslation + 2])));
        sums[p] = hn::Add(sums[p], hn::IfThenElseZero(hn::Gt(depth, zero()), one));
      }
    }
  }
  return static_cast<std::uint64_t>(sum_parts(sums));
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
