// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Eight logical lanes of double on any instruction set. A target with N < 8 lanes runs its kernels
// in 8 / N parts; every lane then sees the same operations in the same order, so targets with fused
// multiply-add agree bit for bit. Included once per target, through Highway's foreach_target.h.
#if defined(SHEAF_PLATFORM_SIMD_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_PLATFORM_SIMD_INL_H_
#undef SHEAF_PLATFORM_SIMD_INL_H_
#else
#define SHEAF_PLATFORM_SIMD_INL_H_
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(D()));
constexpr int kParts = 8 / kLanes;

HWY_INLINE V load(const double* p) { return hn::Load(D(), p); }
HWY_INLINE void store(V v, double* p) { hn::Store(v, D(), p); }
HWY_INLINE V set(double x) { return hn::Set(D(), x); }
HWY_INLINE V zero() { return hn::Zero(D()); }
/// x in all lanes of a vector like W, of double or float.
template <class W>
HWY_INLINE W fill(double x) {
  return hn::Set(hn::DFromV<W>(), static_cast<hn::TFromV<W>>(x));
}
/// a b + c, a b - c, c - a b
template <class W>
HWY_INLINE W fma(W a, W b, W c) {
  return hn::MulAdd(a, b, c);
}
template <class W>
HWY_INLINE W fms(W a, W b, W c) {
  return hn::MulSub(a, b, c);
}
template <class W>
HWY_INLINE W fnma(W a, W b, W c) {
  return hn::NegMulAdd(a, b, c);
}

/// Lane K of an eight-double record, in all lanes. On AVX-512 the odd ones are permuted out of the
/// register that holds the record, so that loads and shuffles share the work: broadcasts from
/// memory alone saturate the load ports.
template <int K>
HWY_INLINE V broadcast(const double* record, [[maybe_unused]] V loaded) {
#if HWY_TARGET <= HWY_AVX3
  if constexpr (K % 2 == 1) return V{_mm512_permutexvar_pd(_mm512_set1_epi64(K), loaded.raw)};
#endif
  return set(record[K]);
}

#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
template <int Pattern>
HWY_INLINE V pick_blocks(V a, V b) {
  return V{_mm512_shuffle_f64x2(a.raw, b.raw, Pattern)};
}

HWY_INLINE void transpose8(const V* in, V* out) {
  constexpr int even = 0x88, odd = 0xdd;
  const D d;
  V lo[4], hi[4];
  for (int i = 0; i < 4; ++i) {
    lo[i] = hn::InterleaveLower(d, in[2 * i], in[2 * i + 1]);
    hi[i] = hn::InterleaveUpper(d, in[2 * i], in[2 * i + 1]);
  }
  const V u0 = pick_blocks<even>(lo[0], lo[1]), u1 = pick_blocks<odd>(lo[0], lo[1]);
  const V u2 = pick_blocks<even>(hi[0], hi[1]), u3 = pick_blocks<odd>(hi[0], hi[1]);
  const V w0 = pick_blocks<even>(lo[2], lo[3]), w1 = pick_blocks<odd>(lo[2], lo[3]);
  const V w2 = pick_blocks<even>(hi[2], hi[3]), w3 = pick_blocks<odd>(hi[2], hi[3]);
  out[0] = pick_blocks<even>(u0, w0), out[4] = pick_blocks<odd>(u0, w0);
  out[2] = pick_blocks<even>(u1, w1), out[6] = pick_blocks<odd>(u1, w1);
  out[1] = pick_blocks<even>(u2, w2), out[5] = pick_blocks<odd>(u2, w2);
  out[3] = pick_blocks<even>(u3, w3), out[7] = pick_blocks<odd>(u3, w3);
}
#elif !HWY_HAVE_SCALABLE
/// kLanes x kLanes transpose.
HWY_INLINE void transpose_square(const V* in, V* out) {
  [[maybe_unused]] const D d;
  if constexpr (kLanes == 4) {
#if HWY_TARGET == HWY_AVX2
    const V a = hn::InterleaveLower(d, in[0], in[1]), b = hn::InterleaveUpper(d, in[0], in[1]);
    const V c = hn::InterleaveLower(d, in[2], in[3]), e = hn::InterleaveUpper(d, in[2], in[3]);
    out[0] = hn::ConcatLowerLower(d, c, a), out[2] = hn::ConcatUpperUpper(d, c, a);
    out[1] = hn::ConcatLowerLower(d, e, b), out[3] = hn::ConcatUpperUpper(d, e, b);
#endif
  } else if constexpr (kLanes == 2) {
#if HWY_TARGET != HWY_SCALAR
    const V a = in[0], b = in[1];
    out[0] = hn::InterleaveLower(d, a, b), out[1] = hn::InterleaveUpper(d, a, b);
#endif
  } else {
    out[0] = in[0];
  }
}
#endif

/// Stores eight fields of kLanes records: field i of the record of lane l to base[l * stride + i].
HWY_INLINE void store_records(const V* fields, double* base, std::size_t stride) {
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
  V rows[8];
  transpose8(fields, rows);
  for (int l = 0; l < 8; ++l) store(rows[l], base + l * stride);
#else
  for (int i = 0; i < 8; i += kLanes) {
    V rows[kLanes];
    transpose_square(fields + i, rows);
    for (int l = 0; l < kLanes; ++l) store(rows[l], base + l * stride + i);
  }
#endif
}

/// Loads eight fields of kLanes records: lane l from base + stride * index[l].
HWY_INLINE void load_records(const double* base, std::size_t stride, const std::uint32_t* index,
                             V* fields) {
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
  V rows[8];
  for (int l = 0; l < 8; ++l) rows[l] = load(base + stride * index[l]);
  transpose8(rows, fields);
#else
  for (int i = 0; i < 8; i += kLanes) {
    V rows[kLanes];
    for (int l = 0; l < kLanes; ++l) rows[l] = load(base + stride * index[l] + i);
    transpose_square(rows, fields + i);
  }
#endif
}

/// Eight fields of one record, each in all lanes.
HWY_INLINE void broadcast_record(const double* record, V* fields) {
#if HWY_TARGET <= HWY_AVX3 && HWY_ARCH_X86
  const V whole = load(record);
  for (int i = 0; i < 8; ++i) fields[i] = V{_mm512_permutexvar_pd(_mm512_set1_epi64(i), whole.raw)};
#else
  for (int i = 0; i < 8; ++i) fields[i] = set(record[i]);
#endif
}

HWY_INLINE void add_to(V v, double* p) { store(hn::Add(load(p), v), p); }

/// Sum of eight lanes in a fixed tree.
HWY_INLINE double sum8(const double* lanes) {
  return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
         ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
