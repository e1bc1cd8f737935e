// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Linearise a chunk, factor its points' 3x3 blocks and write the records that the products need:
//   V + D = L L^T,  B = Jp L^-T,  T = Jc^T B,  M = I - B B^T = Lm Lm^T,  C = Lm^T Jc,
//   w = L^-1 g,  h = Lm^-1 (r + B w),  so that S_ii = sum C^T C and b_i = -sum C^T h.
#if defined(SHEAF_LINEAR_ELIMINATE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_ELIMINATE_INL_H_
#undef SHEAF_LINEAR_ELIMINATE_INL_H_
#else
#define SHEAF_LINEAR_ELIMINATE_INL_H_
#endif

#include "eliminate/kernels.h"
#include "eliminate/point_chart-inl.h"
#include "rows/bal_lanes-inl.h"
#include "rows/loss_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Lower triangle of a 3x3 factor, diagonal inverted; W: lanes of double or of float.
template <class W>
struct FactorAs {
  W i00, l10, l20, i11, l21, i22;
};
using Factor = FactorAs<V>;

HWY_INLINE V inverse_sqrt(V x) { return hn::Div(set(1.0), hn::Sqrt(x)); }

HWY_INLINE Factor factor3(V v00, V v01, V v02, V v11, V v12, V v22) {
  Factor f;
  f.i00 = inverse_sqrt(v00);
  f.l10 = hn::Mul(v01, f.i00);
  f.l20 = hn::Mul(v02, f.i00);
  f.i11 = inverse_sqrt(fnma(f.l10, f.l10, v11));
  f.l21 = hn::Mul(fnma(f.l10, f.l20, v12), f.i11);
  f.i22 = inverse_sqrt(fnma(f.l21, f.l21, fnma(f.l20, f.l20, v22)));
  return f;
}

/// L^-1 s.
template <class W>
HWY_INLINE void forward(const FactorAs<W>& f, const W* s, W* out) {
  out[0] = hn::Mul(s[0], f.i00);
  out[1] = hn::Mul(fnma(f.l10, out[0], s[1]), f.i11);
  out[2] = hn::Mul(fnma(f.l21, out[1], fnma(f.l20, out[0], s[2])), f.i22);
}

/// Normal equations of a point: V (upper triangle) and g = -Jp^T r.
struct PointSums {
  V v00, v01, v02, v11, v12, v22;
  V g[3];

  HWY_INLINE void clear() {
    v00 = v01 = v02 = v11 = v12 = v22 = zero();
    g[0] = g[1] = g[2] = zero();
  }
  HWY_INLINE void add(const LaneJacobian& j) {
    const V *a = j.point[0], *b = j.point[1];
    v00 = fma(a[0], a[0], fma(b[0], b[0], v00));
    v01 = fma(a[0], a[1], fma(b[0], b[1], v01));
    v02 = fma(a[0], a[2], fma(b[0], b[2], v02));
    v11 = fma(a[1], a[1], fma(b[1], b[1], v11));
    v12 = fma(a[1], a[2], fma(b[1], b[2], v12));
    v22 = fma(a[2], a[2], fma(b[2], b[2], v22));
    for (int i = 0; i < 3; ++i) g[i] = fnma(a[i], j.r[0], fnma(b[i], j.r[1], g[i]));
  }
};

/// What the records of one observation per lane are made of.
struct Eliminated {
  V b[2][3], l00, l10, l11, h0, h1;

  HWY_INLINE Eliminated(const LaneJacobian& j, const Factor& f, const V* w) {
    for (int r = 0; r < 2; ++r) forward(f, j.point[r], b[r]);
    const V q0 = fma(b[0][0], w[0], fma(b[0][1], w[1], fma(b[0][2], w[2], j.r[0])));
    const V q1 = fma(b[1][0], w[0], fma(b[1][1], w[1], fma(b[1][2], w[2], j.r[1])));
    const V one = set(1.0), tiny = set(1e-20);
    V m00 = fnma(b[0][0], b[0][0], fnma(b[0][1], b[0][1], fnma(b[0][2], b[0][2], one)));
    V m01 = hn::Neg(fma(b[0][0], b[1][0], fma(b[0][1], b[1][1], hn::Mul(b[0][2], b[1][2]))));
    V m11 = fnma(b[1][0], b[1][0], fnma(b[1][1], b[1][1], fnma(b[1][2], b[1][2], one)));
    m00 = hn::Max(m00, tiny);
    const V i0 = inverse_sqrt(m00);
    l00 = hn::Mul(m00, i0), l10 = hn::Mul(m01, i0);
    m11 = hn::Max(fnma(l10, l10, m11), tiny);
    const V i1 = inverse_sqrt(m11);
    l11 = hn::Mul(m11, i1);
    h0 = hn::Mul(q0, i0);
    h1 = hn::Mul(fnma(l10, h0, q1), i1);
  }
  /// Column i of C and of T.
  HWY_INLINE V c0(const LaneJacobian& j, int i) const {
    return fma(l00, j.camera[0][i], hn::Mul(l10, j.camera[1][i]));
  }
  HWY_INLINE V c1(const LaneJacobian& j, int i) const { return hn::Mul(l11, j.camera[1][i]); }
  HWY_INLINE V t(const LaneJacobian& j, int q, int i) const {
    return fma(j.camera[0][i], b[0][q], hn::Mul(j.camera[1][i], b[1][q]));
  }
};

/// Writes the T and C records of one observation per lane.
HWY_INLINE void write_records(const LaneJacobian& j, const Factor& f, const V* w, double* T,
                              double* C) {
  const Eliminated e(j, f, w);
  V fields[8], last[8];
  for (int i = 0; i < 8; ++i) fields[i] = e.c0(j, i);
  store_records(fields, C, kCRecord);
  for (int i = 0; i < 8; ++i) fields[i] = e.c1(j, i);
  store_records(fields, C + c_record::row(1), kCRecord);
  for (int q = 0; q < 3; ++q) {
    for (int i = 0; i < 8; ++i) fields[i] = e.t(j, q, i);
    store_records(fields, T + t_record::column(q), kTRecord);
    last[q] = e.t(j, q, 8);
  }
  last[3] = zero();
  last[4] = e.c0(j, 8);
  last[5] = e.c1(j, 8);
  last[6] = e.h0;
  last[7] = e.h1;
  store_records(last, T + t_record::kRow8, kTRecord);
}

/// As write_records, of blocks that are poses alone: six columns, and h in the seventh of C, so
/// that C^T C has the right-hand side in it. The last eight of T are not written.
HWY_INLINE void write_pose_records(const LaneJacobian& j, const Factor& f, const V* w, double* T,
                                   double* C) {
  const Eliminated e(j, f, w);
  V fields[8];
  fields[7] = zero();
  for (int i = 0; i < 6; ++i) fields[i] = e.c0(j, i);
  fields[6] = e.h0;
  store_records(fields, C, kCRecord);
  for (int i = 0; i < 6; ++i) fields[i] = e.c1(j, i);
  fields[6] = e.h1;
  store_records(fields, C + c_record::row(1), kCRecord);
  fields[6] = zero();
  for (int q = 0; q < 3; ++q) {
    for (int i = 0; i < 6; ++i) fields[i] = e.t(j, q, i);
    store_records(fields, T + t_record::column(q), kTRecord);
  }
}

/// Marquardt's damping of the points: D = lambda diag(V), clamped.
HWY_INLINE V damp(V lambda, V v) {
  return hn::Mul(lambda, hn::Min(hn::Max(v, set(kDiagonalFloor)), set(kDiagonalCeiling)));
}

/// The factor of V + D by X, Y, Z and its w, from those by a chart's coordinates. With E = dX/dq,
///   M = L^-1 E^T = Q N,  N lower triangular:   (V + D)^-1 = E L^-T L^-1 E^T = N^T N,
/// so that N is the inverse factor by X, Y, Z and Q^T w its w. Formed by X, Y, Z themselves V would
/// lose what it knows of a far point's distance, which goes with one over its fourth power.
HWY_INLINE void factor_by_xyz(const LaneChart& chart, const Factor& f, const V* w, Factor& out,
                              V* w_out) {
  V m[3][3], rest[3] = {w[0], w[1], w[2]}, N[3][3];
  for (int k = 0; k < 3; ++k) {
    const V s[3] = {hn::Mul(chart.reach, chart.t1[k]), hn::Mul(chart.reach, chart.t2[k]),
                    hn::Mul(chart.outward, chart.n[k])};
    forward(f, s, m[k]);
  }
  V inverse[3];
  for (int i = 2; i >= 0; --i) {  // Gram and Schmidt, from the last column
    N[i][i] = hn::Sqrt(dot3(m[i], m[i]));
    inverse[i] = hn::Div(set(1.0), N[i][i]);
    for (V& x : m[i]) x = hn::Mul(x, inverse[i]);
    const auto take = [&](V* from) {
      const V along = dot3(m[i], from);
      for (int k = 0; k < 3; ++k) from[k] = fnma(m[i][k], along, from[k]);
      return along;
    };
    w_out[i] = take(rest);
    for (int k = 0; k < i; ++k) N[i][k] = take(m[k]);
  }
  out.i00 = N[0][0], out.i11 = N[1][1], out.i22 = N[2][2];
  out.l10 = hn::Neg(hn::Mul(hn::Mul(N[1][0], inverse[0]), inverse[1]));
  out.l21 = hn::Neg(hn::Mul(hn::Mul(N[2][1], inverse[1]), inverse[2]));
  out.l20 = hn::Neg(hn::Mul(fma(out.l21, N[1][0], hn::Mul(N[2][0], inverse[2])), inverse[0]));
}

/// Damping of the outward coordinate: more where rounding would pass for parallax, and where the
/// point is at its bound (ChartRules).
HWY_INLINE V damp_outward(const ChartRules& rules, const LaneChart& chart, const PointSums& p,
                          V damping) {
  const V least = hn::Mul(set(rules.rounding * rules.unit), chart.reach);
  damping = hn::Max(damping, hn::Mul(hn::Mul(least, least), hn::Add(p.v00, p.v11)));
  if (rules.crosses) return damping;
  const auto bound = hn::And(hn::Gt(chart.reach, set(kBound / rules.unit)), hn::Gt(p.g[2], zero()));
  return hn::Max(damping, hn::IfThenElseZero(bound, damp(set(kAtBound), p.v22)));
}

/// Marquardt's damping of a part's points and the factor of V + D.
struct DampedFactor {
  Factor f;
  V D[3];

  template <bool Charted>
  HWY_INLINE void compute(const EliminateInput& in, const PointSums& p,
                          [[maybe_unused]] const LaneChart& chart) {
    const V lambda = set(in.damping);
    D[0] = damp(lambda, p.v00), D[1] = damp(lambda, p.v11), D[2] = damp(lambda, p.v22);
    if constexpr (Charted) D[2] = damp_outward(in.chart, chart, p, D[2]);
    f = factor3(hn::Add(p.v00, D[0]), p.v01, p.v02, hn::Add(p.v11, D[1]), p.v12,
                hn::Add(p.v22, D[2]));
    if (!in.points_held) return;  // L^-1 = 0: nothing is eliminated, nothing moves
    f.i00 = f.l10 = f.l20 = f.i11 = f.l21 = f.i22 = zero();
    D[0] = D[1] = D[2] = zero();
  }
};

struct EliminateSums {
  V square[kParts], loss[kParts], decrease[kParts], gradient2[kParts];
};

/// One part of one group, whose rows are known.
struct GroupPart {
  std::uint32_t track;
  std::size_t group;
  int part;
};

/// Factors the points of a part and writes their records; the rows of observation o stand at
/// rows + stride o. Poses: write_pose_records.
template <bool Charted, bool Poses = false>
HWY_INLINE void finish_group(const EliminateInput& in, const PointSums& p,
                             [[maybe_unused]] const LaneChart& chart, const GroupPart& of,
                             const double* rows, std::size_t stride, double* T, double* C,
                             const EliminateOutput& to, EliminateSums& sums) {
  const int lane = of.part * kLanes;
  DampedFactor damped;
  damped.compute<Charted>(in, p, chart);
  const Factor& f = damped.f;
  V w[3];
  forward(f, p.g, w);
  const V w2 = fma(w[0], w[0], fma(w[1], w[1], hn::Mul(w[2], w[2])));
  sums.decrease[of.part] = hn::Add(sums.decrease[of.part], w2);
  sums.gradient2[of.part] = hn::Max(sums.gradient2[of.part], w2);
  double* out = to.factors + kFactorGroup * of.group + lane;
  Factor x = f;
  V y[3] = {w[0], w[1], w[2]};
  if constexpr (Charted) factor_by_xyz(chart, f, w, x, y);
  const V all[factor_group::kFields] = {x.i00, x.l10, x.l20, x.i11,       x.l21,       x.i22,
                                        y[0],  y[1],  y[2],  damped.D[0], damped.D[1], damped.D[2]};
  for (int i = 0; i < factor_group::kFields; ++i) store(all[i], out + 8 * i);

  for (std::uint32_t o = 0; o < of.track; ++o) {
    const std::size_t record = 8 * o + static_cast<std::size_t>(lane);
    const LaneJacobian j = restore(rows + stride * o);
    if constexpr (Poses)
      write_pose_records(j, f, w, T + kTRecord * record, C + kCRecord * record);
    else
      write_records(j, f, w, T + kTRecord * record, C + kCRecord * record);
  }
}

/// The rows of a loss: sqrt(rho') times those of the residual.
HWY_INLINE Rho apply_loss(const ScaledLoss& loss, LaneJacobian& j) {
  const Rho rho = rho_lanes(LossLanes(loss), fma(j.r[0], j.r[0], hn::Mul(j.r[1], j.r[1])));
  const V root = hn::Sqrt(rho.weight);
  for (int r = 0; r < 2; ++r) {
    j.r[r] = hn::Mul(j.r[r], root);
    for (V& x : j.camera[r]) x = hn::Mul(x, root);
    for (V& x : j.point[r]) x = hn::Mul(x, root);
  }
  return rho;
}

template <bool Robust, bool Charted>
HWY_INLINE void eliminate_part(const EliminateInput& in, const Batches::Group& group, std::size_t g,
                               int part, double* jacobians, double* T, double* C,
                               const EliminateOutput& to, EliminateSums& sums) {
  const Batches& batches = *in.batches;
  const int lane = part * kLanes;
  const double* X = in.points + kPointGroup * g + lane;
  const V X0 = load(X), X1 = load(X + 8), X2 = load(X + 16);
  const V mask = lane_mask(group.lanes, lane);
  const V* scale = group.lanes < 8 ? &mask : nullptr;
  [[maybe_unused]] LaneChart chart;
  if constexpr (Charted) {
    V base[3];
    load_base(in.chart, batches, group.first_batch, lane, in.cameras, base);
    chart.place(in.chart, X0, X1, X2, base);
  }
  PointSums p;
  p.clear();
  V square = sums.square[part], robust = sums.loss[part];
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    V c[8 * camera_record::kStateOctets];
    load_cameras<camera_record::kStateOctets>(in.cameras, &batches.image[8 * b + lane],
                                              batches.uniform[b], c);
    const double* z = &batches.xy[16 * b + lane];
    LaneJacobian j = linearize_lanes(c, X0, X1, X2, load(z), load(z + 8), scale);
    square = fma(j.r[0], j.r[0], fma(j.r[1], j.r[1], square));
    if constexpr (Robust) {
      const Rho rho = apply_loss(in.loss, j);
      robust = hn::Add(robust, rho.value);
      store(rho.weight, to.weights + 8 * b + lane);
    }
    if constexpr (Charted)
      for (V* row : {j.point[0], j.point[1]}) chart.transpose(row);
    p.add(j);
    save(j, jacobians + row_field::kCount * kLanes * o);
  }
  sums.square[part] = square;
  sums.loss[part] = robust;

  finish_group<Charted>(in, p, chart, {group.track, g, part}, jacobians, row_field::kCount * kLanes,
                        T, C, to, sums);
}

HWY_INLINE double sum_parts(const V* parts) {
  alignas(64) double lanes[8];
  for (int p = 0; p < kParts; ++p) store(parts[p], lanes + p * kLanes);
  return sum8(lanes);
}

HWY_INLINE double max_parts(const V* parts) {
  alignas(64) double lanes[8];
  for (int p = 0; p < kParts; ++p) store(parts[p], lanes + p * kLanes);
  double most = 0;
  for (double x : lanes) most = x > most ? x : most;
  return most;
}

template <bool Robust, bool Charted>
inline void linearize_chunk(const EliminateInput& in, const Chunk& chunk, const Records& records,
                            EliminateOutput& out) {
  EliminateSums sums;
  for (int p = 0; p < kParts; ++p)
    sums.square[p] = sums.loss[p] = sums.decrease[p] = sums.gradient2[p] = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group group = in.batches->groups[g];
    const std::size_t record = 8 * (group.first_batch - chunk.first_batch);
    for (int p = 0; p < kParts; ++p)
      eliminate_part<Robust, Charted>(in, group, g, p, records.jacobians,
                                      records.T + kTRecord * record, records.C + kCRecord * record,
                                      out, sums);
  }
  out.square_sum += sum_parts(sums.square);
  if (Robust) out.loss_sum += sum_parts(sums.loss);
  out.point_decrease += sum_parts(sums.decrease);
  const double gradient2 = max_parts(sums.gradient2);
  out.gradient_max2 = gradient2 > out.gradient_max2 ? gradient2 : out.gradient_max2;
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
