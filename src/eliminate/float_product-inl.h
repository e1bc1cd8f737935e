// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The implicit Schur product in single precision: the same two sweeps, sixteen lanes wide (two
// groups of one track length) where the instruction set has them. Sums over images stay double.
#if defined(SHEAF_LINEAR_FLOAT_PRODUCT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_FLOAT_PRODUCT_INL_H_
#undef SHEAF_LINEAR_FLOAT_PRODUCT_INL_H_
#else
#define SHEAF_LINEAR_FLOAT_PRODUCT_INL_H_
#endif

#include <algorithm>

#include "eliminate/schur_product-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Two groups are swept together: their lanes follow each other. A row of fields has room for both.
constexpr int kPairLanes = 16;

/// Eight doubles to floats: (x - origin) scale.
HWY_INLINE void demote8(const double* from, double origin, double scale, float* to) {
  const hn::Rebind<float, D> df;
  for (int i = 0; i < 8; i += kLanes)
    hn::StoreU(hn::DemoteTo(df, hn::Mul(hn::Sub(load(from + i), set(origin)), set(scale))), df,
               to + i);
}

/// Points (3 rows) and factors (6 rows, in the order of FactorAs) of one or two groups.
struct FloatGroups {
  alignas(64) float X[3][kPairLanes];
  alignas(64) float factor[6][kPairLanes];
  alignas(64) float mask[kPairLanes];
  bool full = true;

  HWY_INLINE void take(const FloatProductInput& in, std::size_t g, int place) {
    const double up = in.scale, down = 1 / in.scale;
    for (int k = 0; k < 3; ++k)
      demote8(in.points + kPointGroup * g + 8 * k, in.origin[k], up, X[k] + 8 * place);
    const double scale[6] = {up, down, down, up, down, up};
    for (int k = 0; k < 6; ++k)
      demote8(in.factors + kFactorGroup * g + 8 * k, 0, scale[k], factor[k] + 8 * place);
    const std::uint32_t lanes = in.batches->groups[g].lanes;
    full = full && lanes == 8;
    for (std::uint32_t l = 0; l < 8; ++l) mask[8 * place + l] = l < lanes ? 1.0f : 0.0f;
  }
};

/// The batches that are swept together, one for each group, and their images.
struct FloatBatch {
  const std::uint32_t* image[2];
  std::int32_t uniform[2];
};

#if HWY_TARGET != HWY_SCALAR
/// 4 x 4 transposes within each block of four lanes.
template <class W>
HWY_INLINE void transpose_blocks(const W* in, W* out) {
  const hn::DFromV<W> d;
  const hn::RepartitionToWide<decltype(d)> wide;
  const auto pair = [&](W a, W b, bool upper) {
    return hn::BitCast(wide, upper ? hn::InterleaveUpper(d, a, b) : hn::InterleaveLower(d, a, b));
  };
  const auto a = pair(in[0], in[1], false), b = pair(in[0], in[1], true);
  const auto c = pair(in[2], in[3], false), e = pair(in[2], in[3], true);
  out[0] = hn::BitCast(d, hn::InterleaveLower(wide, a, c));
  out[1] = hn::BitCast(d, hn::InterleaveUpper(wide, a, c));
  out[2] = hn::BitCast(d, hn::InterleaveLower(wide, b, e));
  out[3] = hn::BitCast(d, hn::InterleaveUpper(wide, b, e));
}

/// Four floats from each of the addresses, one for each block of W.
template <class DF>
HWY_INLINE hn::Vec<DF> load_blocks(DF d, const float* const* from) {
  if constexpr (hn::MaxLanes(DF()) == 4) {
    return hn::Load(d, from[0]);
  } else if constexpr (hn::MaxLanes(DF()) == 8) {
    return hn::ConcatUpperLower(d, hn::LoadDup128(d, from[1]), hn::LoadDup128(d, from[0]));
  } else {
    const hn::Half<DF> half;
    const float* const upper[2] = {from[2], from[3]};
    return hn::Combine(d, load_blocks(half, upper), load_blocks(half, from));
  }
}
#endif

#if HWY_TARGET <= HWY_AVX3
using W16 = hn::Vec<hn::CappedTag<float, 16>>;

/// Eight fields of sixteen records, from `k` on: half a vector of each record, so half the loads.
HWY_INLINE void load_eight_fields(const float* const* of, int k, float* to) {
  const hn::CappedTag<float, 16> d;
  const hn::Half<decltype(d)> half;
  W16 fields[2][4];  // blocks: field k of lanes 8 h .. 8 h + 3, k + 4 of these, both of the next
  for (int h = 0; h < 2; ++h) {
    W16 rows[4];
    for (int i = 0; i < 4; ++i)
      rows[i] =
          hn::Combine(d, hn::Load(half, of[8 * h + 4 + i] + k), hn::Load(half, of[8 * h + i] + k));
    transpose_blocks(rows, fields[h]);
  }
  for (int j = 0; j < 4; ++j) {
    const auto low = fields[0][j].raw, high = fields[1][j].raw;
    hn::Store(W16{_mm512_shuffle_f32x4(low, high, 0x88)}, d, to + (k + j) * 16);
    hn::Store(W16{_mm512_shuffle_f32x4(low, high, 0xDD)}, d, to + (k + 4 + j) * 16);
  }
}
#endif

/// A record's fields as they lie in memory, a vector each.
template <class DF>
struct FloatFields {
  const float* from;
  HWY_INLINE hn::Vec<DF> operator[](int i) const {
    return hn::Load(DF(), from + i * static_cast<int>(hn::MaxLanes(DF())));
  }
};

/// Writes the 24 fields of the cameras of one part's lanes.
template <class DF>
HWY_INLINE void load_float_cameras(DF d, const float* cameras, const FloatBatch& batch, int part,
                                   float* to) {
  constexpr int N = static_cast<int>(hn::MaxLanes(DF()));
  const int lane = part * N;
  const auto record = [&](std::uint32_t image) {
    return cameras + kFloatCameraRecord * static_cast<std::size_t>(image);
  };
  const std::int32_t first = batch.uniform[lane / 8], last = batch.uniform[(lane + N - 1) / 8];
  if (first >= 0 && first == last) {
    const float* r = record(static_cast<std::uint32_t>(first));
    for (int k = 0; k < 24; ++k) hn::Store(hn::Set(d, r[k]), d, to + k * N);
    return;
  }
#if HWY_TARGET != HWY_SCALAR
  const float* of[kPairLanes];
  for (int l = 0; l < N; ++l) of[l] = record(batch.image[(lane + l) / 8][(lane + l) % 8]);
#if HWY_TARGET <= HWY_AVX3
  if constexpr (N == 16) {
    for (int k = 0; k < 24; k += 8) load_eight_fields(of, k, to);
    return;
  }
#endif
  for (int k = 0; k < 24; k += 4) {
    hn::Vec<DF> rows[4], fields[4];
    for (int j = 0; j < 4; ++j) {
      const float* from[4] = {of[j] + k, nullptr, nullptr, nullptr};
      for (int q = 1; q < N / 4; ++q) from[q] = of[4 * q + j] + k;
      rows[j] = load_blocks(d, from);
    }
    transpose_blocks(rows, fields);
    for (int j = 0; j < 4; ++j) hn::Store(fields[j], d, to + (k + j) * N);
  }
#else
  const float* r = record(batch.image[lane / 8][lane % 8]);
  for (int k = 0; k < 24; ++k) hn::Store(hn::Set(d, r[k]), d, to + k * N);
#endif
}

/// Nine values of each lane of one or two batches: eight in a row of its own, the ninth apart.
struct FloatRows {
  alignas(64) float eight[kPairLanes][8];
  alignas(64) float ninth[kPairLanes];

  /// Rows of lanes l and l + 4 are neighbours: so they come out of a transpose.
  static HWY_INLINE int place(int lane) { return lane / 8 * 8 + lane % 4 * 2 + lane % 8 / 4; }
  HWY_INLINE const float* row(int lane) const { return eight[place(lane)]; }

  template <class DF>
  HWY_INLINE void put(DF d, const hn::Vec<DF>* v, int part) {
    constexpr int N = static_cast<int>(hn::MaxLanes(DF()));
    const int lane = part * N;
    hn::Store(v[8], d, ninth + lane);
#if HWY_TARGET == HWY_SCALAR
    for (int k = 0; k < 8; ++k) eight[place(lane)][k] = hn::GetLane(v[k]);
#else
    hn::Vec<DF> rows[2][4];  // of fields 0 to 3 and 4 to 7; lane 4 b + j in block b of the jth
    for (int q = 0; q < 2; ++q) transpose_blocks(v + 4 * q, rows[q]);
    for (int j = 0; j < 4; ++j) put_lanes(d, rows[0][j], rows[1][j], lane + j);
#endif
  }

 private:
#if HWY_TARGET != HWY_SCALAR
  /// Lanes first, first + 4 ...: blocks of a vector.
  template <class DF>
  HWY_INLINE void put_lanes(DF d, hn::Vec<DF> low, hn::Vec<DF> high, int first) {
    if constexpr (hn::MaxLanes(DF()) == 4) {
      hn::Store(low, d, eight[place(first)]);
      hn::Store(high, d, eight[place(first)] + 4);
    } else if constexpr (hn::MaxLanes(DF()) == 8) {
      hn::Store(hn::ConcatLowerLower(d, high, low), d, eight[place(first)]);
      hn::Store(hn::ConcatUpperUpper(d, high, low), d, eight[place(first + 4)]);
    } else {
#if HWY_TARGET <= HWY_AVX3
      const __m512d a = _mm512_castps_pd(low.raw), b = _mm512_castps_pd(high.raw);
      const auto pick = [&](__m512i index, int lane) {
        const __m512d both = _mm512_permutex2var_pd(a, index, b);
        hn::Store(W16{_mm512_castpd_ps(both)}, d, eight[place(lane)]);
      };
      pick(_mm512_setr_epi64(0, 1, 8, 9, 2, 3, 10, 11), first);
      pick(_mm512_setr_epi64(4, 5, 12, 13, 6, 7, 14, 15), first + 8);
#endif
    }
  }
#endif
};

using DQ = hn::CappedTag<double, 8>;

/// Adds one group's eight lanes to the images' records: where one image has them all, their sum in
/// the fixed tree ((0+1)+(2+3)) + ((4+5)+(6+7)), else lane by lane.
HWY_INLINE void scatter_floats(const FloatRows& rows, const FloatBatch& batch, int group,
                               double* sums) {
  const DQ wide;
  const hn::Rebind<float, DQ> d;
  constexpr int N = static_cast<int>(hn::MaxLanes(DQ()));
  const auto add = [&](hn::Vec<decltype(d)> v, double* to) {
    hn::Store(hn::Add(hn::Load(wide, to), hn::PromoteTo(wide, v)), wide, to);
  };
  const int lane = 8 * group;
  const float* n = rows.ninth + lane;
  if (batch.uniform[group] >= 0) {
    double* to = sums + kProductRecord * static_cast<std::size_t>(batch.uniform[group]);
    for (int i = 0; i < 8; i += N) {
      const auto row = [&](int l) { return hn::Load(d, rows.row(lane + l) + i); };
      const auto low = hn::Add(hn::Add(row(0), row(1)), hn::Add(row(2), row(3)));
      const auto high = hn::Add(hn::Add(row(4), row(5)), hn::Add(row(6), row(7)));
      add(hn::Add(low, high), to + i);
    }
    to[8] += static_cast<double>(((n[0] + n[1]) + (n[2] + n[3])) + ((n[4] + n[5]) + (n[6] + n[7])));
    return;
  }
  for (int l = 0; l < 8; ++l) {
    double* to = sums + kProductRecord * static_cast<std::size_t>(batch.image[group][l]);
    for (int i = 0; i < 8; i += N) add(hn::Load(d, rows.row(lane + l) + i), to + i);
    to[8] += static_cast<double>(n[l]);
  }
}

/// The loss's metric of one part's lanes, in two batches that are swept together.
template <class DF>
HWY_INLINE MetricAs<hn::Vec<DF>> load_float_metric(DF d, const double* const* metric, int part) {
  constexpr int N = static_cast<int>(hn::MaxLanes(DF()));
  const hn::Rebind<float, D> df;
  alignas(64) float of[3][kPairLanes];
  for (int i = 0; i < N; i += kLanes) {
    const int lane = part * N + i;
    for (int k = 0; k < 3; ++k)
      hn::Store(hn::DemoteTo(df, load(metric[lane / 8] + 8 * k + lane % 8)), df, of[k] + i);
  }
  return {hn::Load(d, of[0]), hn::Load(d, of[1]), hn::Load(d, of[2])};
}

/// One group, or two of one track length.
template <class DF, bool Robust>
HWY_INLINE void product_float_groups(const FloatProductInput& in, std::size_t g, int count,
                                     float* saved, double* sums) {
  using W = hn::Vec<DF>;
  const DF d;
  constexpr int N = static_cast<int>(hn::MaxLanes(DF()));
  constexpr std::size_t kPart = std::size_t(24 + kSweepFields) * N;
  const int parts = 8 * count / N;
  const Batches& batches = *in.batches;
  const std::uint32_t track = batches.groups[g].track;
  const auto batch_at = [&](std::uint32_t o) {
    const std::uint64_t b = batches.groups[g].first_batch + o, other = b + (count - 1) * track;
    return FloatBatch{{&batches.image[8 * b], &batches.image[8 * other]},
                      {batches.uniform[b], batches.uniform[other]}};
  };
  const auto metric_at = [&](std::uint32_t o, int part) {
    const std::uint64_t b = batches.groups[g].first_batch + o, other = b + (count - 1) * track;
    const double* both[2] = {in.metric + kMetricBatch * b, in.metric + kMetricBatch * other};
    return load_float_metric(d, both, part);
  };
  FloatGroups groups;
  for (int i = 0; i < count; ++i) groups.take(in, g + i, i);
  W u[kPairLanes / N][3];
  for (int part = 0; part < parts; ++part) {
    const int lane = part * N;
    const W X0 = hn::Load(d, groups.X[0] + lane), X1 = hn::Load(d, groups.X[1] + lane),
            X2 = hn::Load(d, groups.X[2] + lane);
    const W mask = hn::Load(d, groups.mask + lane);
    W s[3] = {hn::Zero(d), hn::Zero(d), hn::Zero(d)};
    for (std::uint32_t o = 0; o < track; ++o) {
      float* to = saved + kPart * (parts * o + part);
      load_float_cameras(d, in.cameras, batch_at(o), part, to);
      const FloatFields<DF> c{to};
      MetricAs<W> metric;
      if constexpr (Robust) metric = metric_at(o, part);
      first_sweep<Robust>(c, X0, X1, X2, groups.full ? nullptr : &mask, metric, to + 24 * N, s);
    }
    const auto factor = [&](int k) { return hn::Load(d, groups.factor[k] + lane); };
    const FactorAs<W> f{factor(0), factor(1), factor(2), factor(3), factor(4), factor(5)};
    W y[3];
    forward(f, s, y);
    backward(f, y, u[part]);
  }
  for (std::uint32_t o = 0; o < track; ++o) {
    FloatRows rows;
    for (int part = 0; part < parts; ++part) {
      W v[9];
      const float* from = saved + kPart * (parts * o + part);
      MetricAs<W> metric;
      if constexpr (Robust) metric = metric_at(o, part);
      second_sweep<Robust>(from, from + 24 * N, metric, u[part], v);
      rows.put(d, v, part);
    }
    for (int i = 0; i < count; ++i) scatter_floats(rows, batch_at(o), i, sums);
  }
}

/// Groups of one track length go in pairs: sixteen lanes, or twice what the machine has.
template <bool Robust>
inline void product_float_chunk(const FloatProductInput& in, const Chunk& chunk, float* saved,
                                double* sums) {
  const auto& groups = in.batches->groups;
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group;) {
    const bool pair = g + 1 < chunk.end_group && groups[g].track == groups[g + 1].track;
    prefetch_groups(in.points, in.factors, 6, g + 2, std::min<std::size_t>(g + 4, groups.size()));
    if (pair)
      product_float_groups<hn::CappedTag<float, 16>, Robust>(in, g, 2, saved, sums);
    else
      product_float_groups<hn::CappedTag<float, 8>, Robust>(in, g, 1, saved, sums);
    g += pair ? 2 : 1;
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
