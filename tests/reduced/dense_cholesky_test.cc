// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/dense_cholesky.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "eliminate/kernel_table.h"

namespace sheaf {
namespace {

/// A = B B^T + n I, lower triangle row-major.
std::vector<double> positive_definite(std::size_t n) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> u(-1, 1);
  std::vector<double> B(n * n), A(n * n);
  for (double& b : B) b = u(random);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j <= i; ++j) {
      for (std::size_t k = 0; k < n; ++k) A[i * n + j] += B[i * n + k] * B[j * n + k];
      if (i == j) A[i * n + i] += 1;
    }
  return A;
}

std::vector<double> solution(std::size_t n, const char* simd, int threads_count) {
  Threads threads(threads_count);
  const std::vector<double> A = positive_definite(n);
  DenseCholesky cholesky(n, simd);
  cholesky.clear(threads);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j <= i; ++j) cholesky.at(i, j) = A[i * n + j];
  EXPECT_TRUE(cholesky.factor(threads));
  Buffer<double> x((n + 7) / 8 * 8);
  x.fill(0);
  for (std::size_t i = 0; i < n; ++i) x[i] = std::sin(double(i));
  cholesky.solve(x.data());
  return {x.begin(), x.begin() + n};
}

TEST(DenseCholesky, SolvesOnEveryInstructionSetAndSize) {
  for (const Kernels* kernels : available_kernels())
    for (std::size_t n : {1u, 7u, 8u, 9u, 31u, 32u, 33u, 63u, 144u, 189u, 450u}) {
      SCOPED_TRACE(std::string(kernels->name) + " n " + std::to_string(n));
      const std::vector<double> A = positive_definite(n);
      const std::vector<double> x = solution(n, kernels->name, 2);
      double worst = 0;
      for (std::size_t i = 0; i < n; ++i) {
        double r = -std::sin(double(i));
        for (std::size_t j = 0; j < n; ++j) r += (j <= i ? A[i * n + j] : A[j * n + i]) * x[j];
        worst = std::max(worst, std::abs(r));
      }
      EXPECT_LT(worst, 1e-10);
    }
}

TEST(DenseCholesky, SameBitsForAnyThreadCount) {
  const char* simd = available_kernels().front()->name;
  for (std::size_t n : {144u, 777u}) {
    const std::vector<double> one = solution(n, simd, 1);
    for (int threads : {2, 5, 16}) EXPECT_EQ(one, solution(n, simd, threads));
  }
}

// From a thousand columns on the matrix is updated in wider steps.
TEST(DenseCholesky, SolvesLargeMatricesWithTheSameBits) {
  const auto entry = [](std::size_t i, std::size_t j) {
    return i == j ? 2000.0 : std::sin(static_cast<double>(i * 31 + j * 17));
  };
  for (std::size_t n : {1001u, 1507u}) {
    std::vector<std::vector<double>> solutions;
    for (int count : {1, 2, 5}) {
      Threads threads(count);
      DenseCholesky cholesky(n, available_kernels().front()->name);
      cholesky.clear(threads);
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t j = 0; j <= i; ++j) cholesky.at(i, j) = entry(i, j);
      ASSERT_TRUE(cholesky.factor(threads));
      Buffer<double> x((n + 7) / 8 * 8);
      x.fill(1);
      cholesky.solve(x.data());
      solutions.emplace_back(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(n));
    }
    EXPECT_EQ(solutions[1], solutions[0]);
    EXPECT_EQ(solutions[2], solutions[0]);
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0;
      for (std::size_t j = 0; j < n; ++j)
        sum += entry(std::max(i, j), std::min(i, j)) * solutions[0][j];
      ASSERT_NEAR(sum, 1, 1e-12) << i;
    }
  }
}

TEST(DenseCholesky, RefusesWhatIsNotPositiveDefinite) {
  Threads threads(1);
  for (double bad : {0.0, -1.0, std::nan(""), double(INFINITY)}) {
    DenseCholesky cholesky(40, available_kernels().front()->name);
    cholesky.clear(threads);
    for (std::size_t i = 0; i < 40; ++i) cholesky.at(i, i) = i == 37 ? bad : 2;
    EXPECT_FALSE(cholesky.factor(threads));
  }
}

}  // namespace
}  // namespace sheaf
