// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/block_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "eliminate/kernel_table.h"
#include "platform/buffer.h"

namespace sheaf {
namespace {

/// Entry (r, k) of block e, and of the vectors of the images.
double entry(std::size_t e, std::size_t r, std::size_t k) {
  return std::sin(static_cast<double>(81 * e + 9 * r + k));
}
double value(std::size_t image, std::size_t k) {
  return std::cos(static_cast<double>(9 * image + k));
}

constexpr std::size_t kBlocks = 37, kImages = 11;
std::uint32_t image_of(std::size_t e) { return static_cast<std::uint32_t>(5 * e % kImages); }

template <class T>
struct Row {
  Buffer<T> blocks{kBlockEntry * kBlocks}, x{16 * kImages};
  std::vector<std::uint32_t> image;

  Row() {
    blocks.fill(T(99)), x.fill(T(77));  // what is unused must not matter
    for (std::size_t e = 0; e < kBlocks; ++e) {
      for (std::size_t k = 0; k < 9; ++k) {
        for (std::size_t r = 0; r < 8; ++r)
          blocks[kBlockEntry * e + 8 * k + r] = static_cast<T>(entry(e, r, k));
        blocks[kBlockEntry * e + block_entry::at(8, k)] = static_cast<T>(entry(e, 8, k));
      }
      image.push_back(image_of(e));
    }
    for (std::size_t i = 0; i < kImages; ++i)
      for (std::size_t k = 0; k < 9; ++k) x[16 * i + k] = static_cast<T>(value(i, k));
  }
};

/// The plain sums that the kernels are held against.
std::vector<double> expected() {
  std::vector<double> y(9, 0);
  for (std::size_t e = 0; e < kBlocks; ++e)
    for (std::size_t r = 0; r < 9; ++r)
      for (std::size_t k = 0; k < 9; ++k) y[r] += entry(e, r, k) * value(image_of(e), k);
  return y;
}

template <class T>
std::vector<double> product(const BlockRowKernels& kernels) {
  const Row<T> row;
  Buffer<double> y(16);
  if constexpr (sizeof(T) == sizeof(double))
    kernels.multiply(row.blocks.data(), row.image.data(), kBlocks, row.x.data(), y.data());
  else
    kernels.multiply_float(row.blocks.data(), row.image.data(), kBlocks, row.x.data(), y.data());
  return {y.begin(), y.begin() + 9};
}

TEST(BlockRows, MatchPlainSumsOnEveryInstructionSet) {
  const std::vector<double> y = expected();
  for (const Kernels* kernels : available_kernels()) {
    SCOPED_TRACE(kernels->name);
    const BlockRowKernels& rows = block_row_kernels(kernels->name);
    const std::vector<double> exact = product<double>(rows), rounded = product<float>(rows);
    for (std::size_t r = 0; r < 9; ++r) {
      EXPECT_NEAR(exact[r], y[r], 1e-13);
      EXPECT_NEAR(rounded[r], y[r], 1e-5);
    }
  }
}

TEST(BlockRows, InstructionSetsWithFusedMultiplyAddAgreeBitForBit) {
  std::vector<const Kernels*> fused;
  for (const Kernels* kernels : available_kernels())
    if (kernels->fused) fused.push_back(kernels);
  if (fused.size() < 2) GTEST_SKIP() << "this machine runs fewer than two such sets";
  const BlockRowKernels &a = block_row_kernels(fused[0]->name),
                        &b = block_row_kernels(fused[1]->name);
  EXPECT_EQ(product<double>(a), product<double>(b));
  EXPECT_EQ(product<float>(a), product<float>(b));
}

}  // namespace
}  // namespace sheaf
