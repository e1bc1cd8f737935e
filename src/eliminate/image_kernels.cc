// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Cost and normal equations of images whose points are held, in one pass: the Jacobians of a few
// batches go to the first-level cache and are multiplied from there into sums that stay in
// registers. 18 sums at a time: with their operands they fill the 32 registers of AVX-512.
#include "eliminate/image_kernels.h"

#include <algorithm>
#include <cstring>

#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eliminate/image_kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "eliminate/point_pass-inl.h"
#include "rows/bal_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

constexpr int kRowVectors = 10;                 // r and the nine of J
constexpr int kBatchVectors = 2 * kRowVectors;  // both rows
constexpr std::uint32_t kCachedBatches = 8;     // 10 KB of Jacobians
constexpr std::size_t kBatch = ImageBatches::kBatchDoubles;

/// Jacobians of one part (kLanes lanes) of a batch to `to`; adds to the costs.
template <bool Robust>
HWY_INLINE void linearize_batch(const double* z, const V* c, const V* mask, const ScaledLoss& loss,
                                double* to, V& square, V& cost) {
  LaneJacobian j =
      linearize_lanes(c, load(z), load(z + 8), load(z + 16), load(z + 24), load(z + 32), mask);
  square = fma(j.r[0], j.r[0], fma(j.r[1], j.r[1], square));
  if constexpr (Robust) {
    const LossRows rows(LossLanes(loss), j.r, fma(j.r[0], j.r[0], hn::Mul(j.r[1], j.r[1])));
    apply_loss(rows, j);
    cost = hn::Add(cost, rows.rho.value);
  }
  for (int r = 0; r < 2; ++r) {
    double* row = to + kRowVectors * kLanes * r;
    store(j.r[r], row);
    for (int i = 0; i < 9; ++i) store(j.camera[r][i], row + kLanes * (1 + i));
  }
}

/// Three columns' products with each other and with r, and with three others' if kOther >= 0, added
/// to the sums at `sums` (kLanes each).
template <int kOwn, int kOther>
HWY_INLINE void multiply(const double* jacobians, int rows, double* sums) {
  const auto at = [sums](int which) { return sums + kLanes * which; };
  V own[6], gradient[3], other[9];
  for (int i = 0, n = 0; i < 3; ++i) {
    gradient[i] = load(at(image_sums::kGradient + 3 * kOwn + i));
    for (int k = 0; k <= i; ++k, ++n)
      own[n] = load(at(image_sums::entry(3 * kOwn + i, 3 * kOwn + k)));
  }
  constexpr int kHigh = kOwn > kOther ? kOwn : kOther, kLow = kOwn > kOther ? kOther : kOwn;
  if constexpr (kOther >= 0)
    for (int i = 0; i < 9; ++i)
      other[i] = load(at(image_sums::entry(3 * kHigh + i / 3, 3 * kLow + i % 3)));
  for (int row = 0; row < rows; ++row) {
    const double* from = jacobians + kRowVectors * kLanes * row;
    const V r = load(from);
    V a[3], b[3];
    for (int i = 0; i < 3; ++i) {
      a[i] = load(from + kLanes * (1 + 3 * kOwn + i));
      if constexpr (kOther >= 0) b[i] = load(from + kLanes * (1 + 3 * kOther + i));
    }
    for (int i = 0, n = 0; i < 3; ++i) {
      gradient[i] = fma(a[i], r, gradient[i]);
      for (int k = 0; k <= i; ++k, ++n) own[n] = fma(a[i], a[k], own[n]);
    }
    if constexpr (kOther >= 0)
      for (int i = 0; i < 9; ++i)
        other[i] =
            kOwn > kOther ? fma(a[i / 3], b[i % 3], other[i]) : fma(b[i / 3], a[i % 3], other[i]);
  }
  for (int i = 0, n = 0; i < 3; ++i) {
    store(gradient[i], at(image_sums::kGradient + 3 * kOwn + i));
    for (int k = 0; k <= i; ++k, ++n)
      store(own[n], at(image_sums::entry(3 * kOwn + i, 3 * kOwn + k)));
  }
  if constexpr (kOther >= 0)
    for (int i = 0; i < 9; ++i)
      store(other[i], at(image_sums::entry(3 * kHigh + i / 3, 3 * kLow + i % 3)));
}

template <bool Robust>
HWY_INLINE void sum_part(const double* batches, const ImageBatches::Piece& piece, const V* c,
                         const ScaledLoss& loss, bool lens, int lane, double* sums) {
  alignas(64) double jacobians[kCachedBatches * kBatchVectors * kLanes];
  V square = zero(), cost = zero();
  const V mask = lane_mask(piece.last_lanes, lane);
  for (std::uint32_t first = 0; first < piece.batches; first += kCachedBatches) {
    const std::uint32_t end = std::min(first + kCachedBatches, piece.batches);
    for (std::uint32_t b = first; b < end; ++b)
      linearize_batch<Robust>(batches + kBatch * b + lane, c,
                              b + 1 == piece.batches && piece.last_lanes < 8 ? &mask : nullptr,
                              loss, jacobians + kBatchVectors * kLanes * (b - first), square, cost);
    const int rows = 2 * static_cast<int>(end - first);
    multiply<0, 1>(jacobians, rows, sums);
    if (lens) {
      multiply<1, 2>(jacobians, rows, sums);
      multiply<2, 0>(jacobians, rows, sums);
    } else {
      multiply<1, -1>(jacobians, rows, sums);
    }
  }
  store(square, sums + kLanes * image_sums::kSquare);
  store(cost, sums + kLanes * image_sums::kLoss);
}

inline void sum(const double* batches, const ImageBatches::Piece& piece, const double* camera,
                const ScaledLoss& loss, bool lens, double* sums) {
  V c[8 * camera_record::kStateOctets];
  load_cameras<camera_record::kStateOctets>(camera, nullptr, 0, c);
  alignas(64) double lanes[image_sums::kCount * 8];
  std::memset(lanes, 0, sizeof lanes);
  for (int p = 0; p < kParts; ++p) {
    double* part = lanes + image_sums::kCount * kLanes * p;
    if (loss.kind == LossKind::none)
      sum_part<false>(batches, piece, c, loss, lens, p * kLanes, part);
    else
      sum_part<true>(batches, piece, c, loss, lens, p * kLanes, part);
  }
  for (std::size_t i = 0; i < image_sums::kCount; ++i) {
    double all[8];
    for (int l = 0; l < 8; ++l)
      all[l] = lanes[image_sums::kCount * kLanes * (l / kLanes) + kLanes * i + l % kLanes];
    sums[i] = sum8(all);
  }
}

inline void residuals(const double* batches, const ImageBatches::Piece& piece, const double* camera,
                      double* out) {
  V c[8 * camera_record::kStateOctets];
  load_cameras<camera_record::kStateOctets>(camera, nullptr, 0, c);
  for (std::uint32_t b = 0; b < piece.batches; ++b)
    for (int lane = 0; lane < 8; lane += kLanes) {
      const double* z = batches + kBatch * b + lane;
      const Seen seen = see(c, load(z), load(z + 8), load(z + 16));
      const V fd = hn::Mul(c[camera_record::kFocal], distortion(c, seen.n));
      store(hn::Abs(fms(fd, seen.x, load(z + 24))), out + 16 * b + lane);
      store(hn::Abs(fms(fd, seen.y, load(z + 32))), out + 16 * b + 8 + lane);
    }
}

constexpr ImageKernels image_table() { return {set_name(HWY_TARGET), &sum, &residuals}; }

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

const ImageKernels& image_kernels(const char* name) {
  static constexpr ImageKernels tables[] = SHEAF_TABLES(image_table);
  return table_named(tables, name);
}

}  // namespace sheaf
#endif  // HWY_ONCE
