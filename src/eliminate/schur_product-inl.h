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

#include <algorithm>

#include "eliminate/bal_source-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// e = M Jc x of one observation per lane (also saved), and s += Jp^T e; mask: nullptr for lanes
/// that are all used. metric: read with a loss alone.
template <bool Robust, class C, class W>
HWY_INLINE void first_sweep(const C& c, W X0, W X1, W X2, const W* mask,
                            [[maybe_unused]] const MetricAs<W>& metric, hn::TFromV<W>* saved,
                            W* s) {
  const SeenAs<W> seen = see(c, X0, X1, X2);
  const W fd = hn::Mul(c[camera_record::kFocal], distortion(c, seen.n));
  const W dd = distortion_slope(c, seen.n);
  W e0, e1;
  camera_motion(c, seen, fd, dd, e0, e1);
  if constexpr (Robust) metric.apply(e0, e1);
  if (mask != nullptr) e0 = hn::Mul(e0, *mask), e1 = hn::Mul(e1, *mask);
  const hn::DFromV<W> d;
  const std::size_t lanes = hn::Lanes(d);
  hn::Store(seen.iz, d, saved), hn::Store(seen.x, d, saved + lanes);
  hn::Store(seen.y, d, saved + 2 * lanes), hn::Store(fd, d, saved + 3 * lanes);
  hn::Store(dd, d, saved + 4 * lanes), hn::Store(e0, d, saved + 5 * lanes);
  hn::Store(e1, d, saved + 6 * lanes);
  add_to_point(c, seen, fd, dd, e0, e1, s);
}

/// v = Jc^T (e - M Jp u), in the order of the product's record: rho (3), phi (3), then the sums of
/// s, s n and s n^2 with s = p . e that make up the intrinsics.
template <bool Robust, class W>
HWY_INLINE void second_sweep(const hn::TFromV<W>* rotation, const hn::TFromV<W>* saved,
                             [[maybe_unused]] const MetricAs<W>& metric, const W* u, W* v) {
  const hn::DFromV<W> d;
  const std::size_t lanes = hn::Lanes(d);
  const auto R = [&](int i) { return hn::Load(d, rotation + i * lanes); };
  const auto field = [&](int i) { return hn::Load(d, saved + i * lanes); };
  const W iz = field(0), x = field(1), y = field(2), fd = field(3), dd = field(4);
  const W m0 = fma(R(0), u[0], fma(R(1), u[1], hn::Mul(R(2), u[2])));
  const W m1 = fma(R(3), u[0], fma(R(4), u[1], hn::Mul(R(5), u[2])));
  const W m2 = fma(R(6), u[0], fma(R(7), u[1], hn::Mul(R(8), u[2])));
  const W dx = hn::Mul(iz, fma(x, m2, m0)), dy = hn::Mul(iz, fma(y, m2, m1));
  const W along = hn::Mul(dd, fma(x, dx, hn::Mul(y, dy)));
  W p0 = fma(fd, dx, hn::Mul(along, x)), p1 = fma(fd, dy, hn::Mul(along, y));
  if constexpr (Robust) metric.apply(p0, p1);
  const W e0 = hn::Sub(field(5), p0), e1 = hn::Sub(field(6), p1);
  const W s = fma(x, e0, hn::Mul(y, e1));
  const W t = hn::Mul(dd, s);
  // A^T e = iz (g0, g1, g2), and P x A^T e with iz P = (x, y, -1).
  const W g0 = fma(fd, e0, hn::Mul(t, x)), g1 = fma(fd, e1, hn::Mul(t, y));
  const W g2 = fma(x, g0, hn::Mul(y, g1));
  v[0] = hn::Mul(iz, g0), v[1] = hn::Mul(iz, g1), v[2] = hn::Mul(iz, g2);
  v[3] = fma(y, g2, g1);
  v[4] = hn::Neg(fma(x, g2, g0));
  v[5] = fms(x, g1, hn::Mul(y, g0));
  const W n = fma(x, x, hn::Mul(y, y));
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
  constexpr std::size_t kPart = (9 + kSweepFields) * kLanes;
  V u[kParts][3];
  for (int part = 0; part < kParts; ++part) {
    const int lane = part * kLanes;
    const double* X = in.points + kPointGroup * g + lane;
    const V X0 = load(X), X1 = load(X + 8), X2 = load(X + 16);
    const V mask = lane_mask(group.lanes, lane);
    V s[3] = {zero(), zero(), zero()};
    for (std::uint32_t o = 0; o < group.track; ++o) {
      const std::uint64_t b = group.first_batch + o;
      V c[kCameraRecord];
      load_cameras<camera_record::kOctets>(in.cameras, &batches.image[8 * b + lane],
                                           batches.uniform[b], c);
      double* to = saved + kPart * (kParts * o + part);
      for (int i = 0; i < 9; ++i) store(c[i], to + i * kLanes);
      Metric metric;
      if constexpr (Robust) metric = load_metric(in.metric + kMetricBatch * b + lane);
      first_sweep<Robust>(c, X0, X1, X2, group.lanes < 8 ? &mask : nullptr, metric, to + 9 * kLanes,
                          s);
    }
    solve_point(in.factors + kFactorGroup * g + lane, s, u[part]);
  }
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    alignas(64) double rows[64], ninth[8];
    for (int part = 0; part < kParts; ++part) {
      V v[9];
      const double* from = saved + kPart * (kParts * o + part);
      Metric metric;
      if constexpr (Robust) metric = load_metric(in.metric + kMetricBatch * b + part * kLanes);
      second_sweep<Robust>(from, from + 9 * kLanes, metric, u[part], v);
      store_records(v, rows + 8 * part * kLanes, 8);
      store(v[8], ninth + part * kLanes);
    }
    scatter(rows, ninth, &batches.image[8 * b], batches.uniform[b], sums);
  }
}

template <bool Robust>
inline void product_chunk(const ProductInput& in, const Chunk& chunk, double* saved, double* sums) {
  const std::size_t groups = in.batches->groups.size();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    prefetch_groups(in.points, in.factors, 6, g + 1, std::min<std::size_t>(g + 2, groups));
    product_group<Robust>(in, in.batches->groups[g], g, saved, sums);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
