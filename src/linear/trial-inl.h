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

#include "linear/eliminate-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// e = Jc dc of one observation per lane; c holds the 24 fields of camera and step.
HWY_INLINE void camera_motion(const V* c, const Seen& seen, V fd, V dd, V& e0, V& e1) {
  // dP = phi x P + rho; d p = iz (dP.xy + p dP.z)
  const V m0 = fma(c[16], seen.P2, fnma(c[17], seen.P1, c[18]));
  const V m1 = fma(c[17], seen.P0, fnma(c[15], seen.P2, c[19]));
  const V m2 = fma(c[15], seen.P1, fnma(c[16], seen.P0, c[20]));
  const V dx = hn::Mul(seen.iz, fma(seen.x, m2, m0));
  const V dy = hn::Mul(seen.iz, fma(seen.y, m2, m1));
  const V intrinsic = fma(seen.n, fma(seen.n, c[23], c[22]), c[21]);
  const V along = fma(dd, fma(seen.x, dx, hn::Mul(seen.y, dy)), intrinsic);
  e0 = fma(fd, dx, hn::Mul(along, seen.x));
  e1 = fma(fd, dy, hn::Mul(along, seen.y));
}

/// s += Jp^T e: A^T e with A = iz (fd I + dd p p^T) [I | p], then R^T.
HWY_INLINE void add_to_point(const V* c, const Seen& seen, V fd, V dd, V e0, V e1, V* s) {
  const V t = hn::Mul(dd, fma(seen.x, e0, hn::Mul(seen.y, e1)));
  const V h0 = hn::Mul(seen.iz, fma(fd, e0, hn::Mul(t, seen.x)));
  const V h1 = hn::Mul(seen.iz, fma(fd, e1, hn::Mul(t, seen.y)));
  const V h2 = fma(seen.x, h0, hn::Mul(seen.y, h1));
  for (int i = 0; i < 3; ++i) s[i] = fma(c[i], h0, fma(c[3 + i], h1, fma(c[6 + i], h2, s[i])));
}

/// s += Jp^T Jc dc of one observation per lane.
HWY_INLINE void add_coupled(const V* c, const Seen& seen, V* s) {
  const V fd = hn::Mul(c[12], distortion(c, seen.n));
  const V dd = distortion_slope(c, seen.n);
  V e0, e1;
  camera_motion(c, seen, fd, dd, e0, e1);
  add_to_point(c, seen, fd, dd, e0, e1, s);
}

struct TrialSums {
  V square[kParts], damping[kParts], step2[kParts], behind[kParts];
};

HWY_INLINE V squared_residual(const V* c, const Seen& s, V zx, V zy) {
  const V fd = hn::Mul(c[12], distortion(c, s.n));
  const V r0 = fms(fd, s.x, zx), r1 = fms(fd, s.y, zy);
  return fma(r0, r0, hn::Mul(r1, r1));
}

HWY_INLINE Factor load_factor(const double* pd) {
  return {load(pd), load(pd + 8), load(pd + 16), load(pd + 24), load(pd + 32), load(pd + 40)};
}

/// L^-T u.
HWY_INLINE void backward(const Factor& f, const V* u, V* d) {
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
  for (int i = 0; i < 3; ++i) u[i] = hn::Sub(load(pd + 8 * (6 + i)), u[i]);
  backward(f, u, d);
  V sum = zero();
  for (int i = 0; i < 3; ++i) sum = fma(hn::Mul(d[i], d[i]), load(pd + 8 * (9 + i)), sum);
  return sum;
}

HWY_INLINE void trial_part(const TrialInput& in, const Batches::Group& group, std::size_t g,
                           int part, double* stepped, TrialSums& sums) {
  const Batches& batches = *in.batches;
  const int lane = part * kLanes;
  const double* X = in.points + kPointGroup * g + lane;
  const V X0 = load(X), X1 = load(X + 8), X2 = load(X + 16);
  V s[3] = {zero(), zero(), zero()};
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    V c[24];
    load_cameras<3>(in.cameras, &batches.image[8 * b + lane], batches.uniform[b], c);
    add_coupled(c, see(c, X0, X1, X2), s);
  }
  V d[3];
  const V mask = lane_mask(group.lanes, lane);
  if (group.lanes < 8)  // masked lanes stay where they are
    for (V& x : s) x = hn::Mul(x, mask);
  const V damping = back_substitute(in.factors + kFactorGroup * g + lane, s, d);
  const V Y0 = hn::Add(X0, d[0]), Y1 = hn::Add(X1, d[1]), Y2 = hn::Add(X2, d[2]);
  double* Y = stepped + kPointGroup * g + lane;
  store(Y0, Y), store(Y1, Y + 8), store(Y2, Y + 16);
  const V d2 = fma(d[0], d[0], fma(d[1], d[1], hn::Mul(d[2], d[2])));
  const V x2 = fma(X0, X0, fma(X1, X1, fma(X2, X2, set(1e-300))));
  V square = zero(), behind = zero();
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    V c[16];
    load_cameras<2>(in.trial_cameras, &batches.image[8 * b + lane], batches.uniform[b], c);
    const double* z = &batches.xy[16 * b + lane];
    const Seen seen = see(c, Y0, Y1, Y2);
    square = hn::Add(square, squared_residual(c, seen, load(z), load(z + 8)));
    if (in.count_newly_behind) {
      load_cameras<2>(in.cameras, &batches.image[8 * b + lane], batches.uniform[b], c);
      const auto crossed = hn::And(hn::Gt(seen.P2, zero()), hn::Le(see(c, X0, X1, X2).P2, zero()));
      behind = hn::Add(behind, hn::IfThenElseZero(crossed, set(1.0)));
    }
  }
  if (group.lanes < 8) {
    square = hn::Mul(square, mask);
    behind = hn::Mul(behind, mask);
  }
  sums.square[part] = hn::Add(sums.square[part], square);
  sums.behind[part] = hn::Add(sums.behind[part], behind);
  sums.damping[part] = fma(damping, mask, sums.damping[part]);
  sums.step2[part] = hn::Max(sums.step2[part], hn::Div(d2, x2));
}

inline void trial_chunk(const TrialInput& in, const Chunk& chunk, TrialOutput& out) {
  TrialSums sums;
  for (int p = 0; p < kParts; ++p)
    sums.square[p] = sums.damping[p] = sums.step2[p] = sums.behind[p] = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (int p = 0; p < kParts; ++p) trial_part(in, in.batches->groups[g], g, p, out.points, sums);
  out.square_sum += sum_parts(sums.square);
  out.damping_term += sum_parts(sums.damping);
  const double step2 = max_parts(sums.step2);
  out.step2_max = step2 > out.step2_max ? step2 : out.step2_max;
  out.newly_behind += static_cast<std::uint64_t>(sum_parts(sums.behind));
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
        V c[16];
        load_cameras<2>(cameras, &batches.image[8 * b + lane], batches.uniform[b], c);
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
        V c[16];
        load_cameras<2>(cameras, &batches.image[8 * b + lane], batches.uniform[b], c);
        const V depth = fma(c[6], X0, fma(c[7], X1, fma(c[8], X2, c[11])));
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
