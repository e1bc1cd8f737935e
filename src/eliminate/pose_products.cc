// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/pose_products.h"

#include <string_view>

#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eliminate/pose_products.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "platform/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Lanes [column, column + kLanes) of the rows of sum += A^T B M.
HWY_INLINE void add_columns(const double* A, const double* B, const double* M, int column,
                            double* sum) {
  V rows[6];
  for (int r = 0; r < 6; ++r) {
    if (M == nullptr) {
      rows[r] = load(B + 8 * r + column);
      continue;
    }
    rows[r] = hn::Mul(set(B[8 * r]), load(M + column));
    for (int q = 1; q < 6; ++q) rows[r] = fma(set(B[8 * r + q]), load(M + 8 * q + column), rows[r]);
  }
  for (int r = 0; r < 6; ++r) {
    V to = load(sum + 8 * r + column);
    if (A == nullptr)
      to = hn::Add(to, rows[r]);
    else
      for (int q = 0; q < 6; ++q) to = fma(set(A[8 * q + r]), rows[q], to);
    store(to, sum + 8 * r + column);
  }
}

void add_product(const double* A, const double* B, const double* M, double* sum) {
  for (int column = 0; column < 8; column += kLanes) add_columns(A, B, M, column, sum);
}

constexpr PoseProducts pose_table() { return {set_name(HWY_TARGET), &add_product}; }

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {
namespace {

void add_by_reference(const double* A, const double* B, const double* M, double* sum) {
  double rows[6][6] = {};
  for (int r = 0; r < 6; ++r)
    for (int k = 0; k < 6; ++k) {
      if (M == nullptr) rows[r][k] = B[8 * r + k];
      for (int q = 0; q < 6 && M != nullptr; ++q) rows[r][k] += B[8 * r + q] * M[8 * q + k];
    }
  for (int r = 0; r < 6; ++r)
    for (int k = 0; k < 6; ++k) {
      if (A == nullptr) sum[8 * r + k] += rows[r][k];
      for (int q = 0; q < 6 && A != nullptr; ++q) sum[8 * r + k] += A[8 * q + r] * rows[q][k];
    }
}

}  // namespace

const PoseProducts& reference_pose_products() {
  static constexpr PoseProducts table{"scalar", &add_by_reference};
  return table;
}

const PoseProducts& pose_products(const char* simd_name) {
  if (std::string_view(simd_name) == "scalar") return reference_pose_products();
  static constexpr PoseProducts tables[] = SHEAF_TABLES(pose_table);
  return table_named(tables, simd_name);
}

}  // namespace sheaf
#endif  // HWY_ONCE
