// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// y += (U - W (V + D)^-1 W^T) x without forming anything: Jacobians are recomputed from the state,
// which on every machine measured is quicker than reading them back from memory.
#if defined(SHEAF_LINEAR_SCHUR_PRODUCT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_SCHUR_PRODUCT_INL_H_
#undef SHEAF_LINEAR_SCHUR_PRODUCT_INL_H_
#else
#define SHEAF_LINEAR_SCHUR_PRODUCT_INL_H_
#endif

#include "linear/trial-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// What the second sweep over a point's track needs from the first: kSweepFields vectors.
constexpr int kSweepFields = 20;

HWY_INLINE void save_sweep(const V* c, const Seen& s, V fd, V dd, V e0, V e1, double* to) {
  const V all[11] = {s.P0, s.P1, s.P2, s.iz, s.x, s.y, s.n, fd, dd, e0, e1};
  for (int i = 0; i < 11; ++i) store(all[i], to + i * kLanes);
  for (int i = 0; i < 9; ++i) store(c[i], to + (11 + i) * kLanes);
}

/// e = w Jc x of one observation per lane (also saved), and s += Jp^T e; weight: nullptr for w = 1
/// in all lanes.
HWY_INLINE void first_sweep(const V* c, V X0, V X1, V X2, const V* weight, double* saved, V* s) {
  const Seen seen = see(c, X0, X1, X2);
  const V fd = hn::Mul(c[12], distortion(c, seen.n));
  const V dd = distortion_slope(c, seen.n);
  V e0, e1;
  camera_motion(c, seen, fd, dd, e0, e1);
  if (weight != nullptr) e0 = hn::Mul(e0, *weight), e1 = hn::Mul(e1, *weight);
  save_sweep(c, seen, fd, dd, e0, e1, saved);
  add_to_point(c, seen, fd, dd, e0, e1, s);
}

/// v = Jc^T (e - w Jp u), in the order of the product's record: rho (3), phi (3), then the sums of
/// s, s n and s n^2 with s = p . e that make up the intrinsics.
template <bool Robust>
HWY_INLINE void second_sweep(const double* from, const double* weights, const V* u, V* v) {
  V f[kSweepFields];
  for (int i = 0; i < kSweepFields; ++i) f[i] = load(from + i * kLanes);
  const V P0 = f[0], P1 = f[1], P2 = f[2], iz = f[3], x = f[4], y = f[5], n = f[6], fd = f[7],
          dd = f[8];
  const V* R = f + 11;
  const V m0 = fma(R[0], u[0], fma(R[1], u[1], hn::Mul(R[2], u[2])));
  const V m1 = fma(R[3], u[0], fma(R[4], u[1], hn::Mul(R[5], u[2])));
  const V m2 = fma(R[6], u[0], fma(R[7], u[1], hn::Mul(R[8], u[2])));
  const V w = Robust ? hn::Mul(iz, load(weights)) : iz;
  const V dx = hn::Mul(w, fma(x, m2, m0)), dy = hn::Mul(w, fma(y, m2, m1));
  const V along = hn::Mul(dd, fma(x, dx, hn::Mul(y, dy)));
  const V e0 = hn::Sub(f[9], fma(fd, dx, hn::Mul(along, x)));
  const V e1 = hn::Sub(f[10], fma(fd, dy, hn::Mul(along, y)));
  const V s = fma(x, e0, hn::Mul(y, e1));
  const V t = hn::Mul(dd, s);
  const V h0 = hn::Mul(iz, fma(fd, e0, hn::Mul(t, x)));
  const V h1 = hn::Mul(iz, fma(fd, e1, hn::Mul(t, y)));
  const V h2 = fma(x, h0, hn::Mul(y, h1));
  v[0] = h0, v[1] = h1, v[2] = h2;
  v[3] = fms(P1, h2, hn::Mul(P2, h1));
  v[4] = fms(P2, h0, hn::Mul(P0, h2));
  v[5] = fms(P0, h1, hn::Mul(P1, h0));
  v[6] = s;
  v[7] = hn::Mul(s, n);
  v[8] = hn::Mul(v[7], n);
}

/// Adds eight lanes of nine values to the images' records (kProductRecord doubles each), lane by
/// lane in order. `rows` is scratch for the transposed lanes.
HWY_INLINE void scatter(const double* rows, const double* ninth, const std::uint32_t* image,
                        std::int32_t uniform, double* sums) {
  if (uniform >= 0) {
    double* to = sums + kProductRecord * static_cast<std::size_t>(uniform);
    for (int i = 0; i < 8; i += kLanes) {
      V r[8];
      for (int l = 0; l < 8; ++l) r[l] = load(rows + 8 * l + i);
      const V sum = hn::Add(hn::Add(hn::Add(r[0], r[1]), hn::Add(r[2], r[3])),
                            hn::Add(hn::Add(r[4], r[5]), hn::Add(r[6], r[7])));
      add_to(sum, to + i);
    }
    to[8] += sum8(ninth);
    return;
  }
  for (int l = 0; l < 8; ++l) {
    double* to = sums + kProductRecord * static_cast<std::size_t>(image[l]);
    for (int i = 0; i < 8; i += kLanes) add_to(load(rows + 8 * l + i), to + i);
    to[8] += ninth[l];
  }
}

template <bool Robust>
HWY_INLINE void product_group(const ProductInput& in, const Batches::Group& group, std::size_t g,
                              double* saved, double* sums) {
  const Batches& batches = *in.batches;
  constexpr std::size_t kPart = kSweepFields * kLanes;
  V u[kParts][3];
  for (int part = 0; part < kParts; ++part) {
    const int lane = part * kLanes;
    const double* X = in.points + kPointGroup * g + lane;
    const V X0 = load(X), X1 = load(X + 8), X2 = load(X + 16);
    const V mask = lane_mask(group.lanes, lane);
    V s[3] = {zero(), zero(), zero()};
    for (std::uint32_t o = 0; o < group.track; ++o) {
      const std::uint64_t b = group.first_batch + o;
      V c[24];
      load_cameras<3>(in.cameras, &batches.image[8 * b + lane], batches.uniform[b], c);
      V weight = mask;
      if constexpr (Robust) weight = hn::Mul(mask, load(in.weights + 8 * b + lane));
      first_sweep(c, X0, X1, X2, Robust || group.lanes < 8 ? &weight : nullptr,
                  saved + kPart * (kParts * o + part), s);
    }
    solve_point(in.factors + kFactorGroup * g + lane, s, u[part]);
  }
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    alignas(64) double rows[64], ninth[8];
    for (int part = 0; part < kParts; ++part) {
      V v[9];
      const double* weights = Robust ? in.weights + 8 * b + part * kLanes : nullptr;
      second_sweep<Robust>(saved + kPart * (kParts * o + part), weights, u[part], v);
      store_records(v, rows + 8 * part * kLanes, 8);
      store(v[8], ninth + part * kLanes);
    }
    scatter(rows, ninth, &batches.image[8 * b], batches.uniform[b], sums);
  }
}

template <bool Robust>
inline void product_chunk(const ProductInput& in, const Chunk& chunk, double* saved, double* sums) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    product_group<Robust>(in, in.batches->groups[g], g, saved, sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
