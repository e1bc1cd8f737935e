// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/pose_products.h"

#include <gtest/gtest.h>

#include <array>

#include "eliminate/kernel_table.h"
#include "platform/random.h"

namespace sheaf {
namespace {

struct alignas(64) Matrix {
  std::array<double, kPoseMatrix> at{};
};

Matrix drawn(Random& random) {
  Matrix m;
  for (double& x : m.at) x = random.normal();
  return m;
}

/// A matrix to the right has zeros in the two columns beyond.
Matrix adjoint(Random& random) {
  Matrix m = drawn(random);
  for (std::size_t r = 0; r < 6; ++r) m.at[8 * r + 6] = m.at[8 * r + 7] = 0;
  return m;
}

TEST(PoseProducts, EveryInstructionSetMatchesTheReference) {
  Random random(3);
  const Matrix A = adjoint(random), B = drawn(random), M = adjoint(random);
  for (const Kernels* kernels : available_kernels())
    for (const double* left : {A.at.data(), static_cast<const double*>(nullptr)})
      for (const double* right : {M.at.data(), static_cast<const double*>(nullptr)}) {
        Matrix got = B, expected = B;
        pose_products(kernels->name).add(left, B.at.data(), right, got.at.data());
        reference_pose_products().add(left, B.at.data(), right, expected.at.data());
        for (std::size_t r = 0; r < 6; ++r)
          for (std::size_t k = 0; k < 6; ++k)
            EXPECT_NEAR(got.at[8 * r + k], expected.at[8 * r + k], 1e-13);
      }
}

}  // namespace
}  // namespace sheaf
