// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>

#include "lists/block_layout.h"

namespace sheaf {

/// One instruction set's product of a row of blocks, kBlockEntry each, with the vectors of the
/// images they stand for, kBlockVector each. Sums over blocks are double, in their order.
struct BlockRowKernels {
  const char* name;
  /// y <- sum over `count` blocks of block x[image].
  void (*multiply)(const double* blocks, const std::uint32_t* image, std::size_t count,
                   const double* x, double* y);
  void (*multiply_float)(const float* blocks, const std::uint32_t* image, std::size_t count,
                         const float* x, double* y);
};
/// simd_name: as for the other kernels.
const BlockRowKernels& block_row_kernels(const char* simd_name);

}  // namespace sheaf
