// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/block_rows.h"

#include <string_view>

#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "reduced/block_rows.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "platform/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

HWY_INLINE void finish_row(const V* sums, const V* last, double corner, double* y) {
  alignas(64) double lanes[8];
  for (int p = 0; p < kParts; ++p) {
    store(sums[p], y + p * kLanes);
    store(last[p], lanes + p * kLanes);
  }
  y[8] = sum8(lanes) + corner;
}

void multiply(const double* blocks, const std::uint32_t* image, std::size_t count, const double* x,
              double* y) {
  V sums[kParts], last[kParts];
  for (int p = 0; p < kParts; ++p) sums[p] = last[p] = zero();
  double corner = 0;
  for (std::size_t e = 0; e < count; ++e, blocks += kBlockEntry) {
    const double* v = x + kBlockVector * static_cast<std::size_t>(image[e]);
    for (int p = 0; p < kParts; ++p) {
      const double* from = blocks + p * kLanes;
      // Two chains, so that one block does not wait nine times for its own sum.
      V even = sums[p], odd = hn::Mul(load(from + block_entry::at(0, 1)), set(v[1]));
      for (int k = 0; k < 9; k += 2)
        even = fma(load(from + block_entry::at(0, k)), set(v[k]), even);
      for (int k = 3; k < 9; k += 2) odd = fma(load(from + block_entry::at(0, k)), set(v[k]), odd);
      sums[p] = hn::Add(even, odd);
      last[p] = fma(load(from + block_entry::kRow8), load(v + p * kLanes), last[p]);
    }
    corner += blocks[block_entry::kCorner] * v[8];
  }
  finish_row(sums, last, corner, y);
}

using FloatTag = hn::CappedTag<float, 8>;
constexpr int kFloatLanes = static_cast<int>(hn::MaxLanes(FloatTag()));

/// sums += v, in double: the vectors of sums from the lane of v's first.
template <class W>
HWY_INLINE void add_floats(W v, V* sums) {
  using Tag = hn::DFromV<W>;
  if constexpr (hn::MaxLanes(Tag()) == kLanes) {
    sums[0] = hn::Add(sums[0], hn::PromoteTo(D(), v));
  } else {
#if HWY_TARGET != HWY_SCALAR
    const hn::Half<Tag> half;
    sums[0] = hn::Add(sums[0], hn::PromoteTo(D(), hn::LowerHalf(half, v)));
    sums[1] = hn::Add(sums[1], hn::PromoteTo(D(), hn::UpperHalf(half, v)));
#endif
  }
}

void multiply_float(const float* blocks, const std::uint32_t* image, std::size_t count,
                    const float* x, double* y) {
  const FloatTag d;
  V sums[kParts], last[kParts];
  for (int p = 0; p < kParts; ++p) sums[p] = last[p] = zero();
  double corner = 0;
  for (std::size_t e = 0; e < count; ++e, blocks += kBlockEntry) {
    const float* v = x + kBlockVector * static_cast<std::size_t>(image[e]);
    for (int i = 0; i < 8; i += kFloatLanes) {
      const float* from = blocks + i;
      auto even = hn::Mul(hn::Load(d, from), hn::Set(d, v[0]));
      auto odd = hn::Mul(hn::Load(d, from + block_entry::at(0, 1)), hn::Set(d, v[1]));
      for (int k = 2; k < 9; k += 2)
        even = hn::MulAdd(hn::Load(d, from + block_entry::at(0, k)), hn::Set(d, v[k]), even);
      for (int k = 3; k < 9; k += 2)
        odd = hn::MulAdd(hn::Load(d, from + block_entry::at(0, k)), hn::Set(d, v[k]), odd);
      add_floats(hn::Add(even, odd), sums + i / kLanes);
      add_floats(hn::Mul(hn::Load(d, from + block_entry::kRow8), hn::Load(d, v + i)),
                 last + i / kLanes);
    }
    corner += static_cast<double>(blocks[block_entry::kCorner]) * static_cast<double>(v[8]);
  }
  finish_row(sums, last, corner, y);
}

constexpr BlockRowKernels block_row_table() {
  return {set_name(HWY_TARGET), &multiply, &multiply_float};
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

const BlockRowKernels& block_row_kernels(const char* simd_name) {
  static constexpr BlockRowKernels tables[] = SHEAF_TABLES(block_row_table);
  return table_named(tables, simd_name);
}

}  // namespace sheaf
#endif  // HWY_ONCE
