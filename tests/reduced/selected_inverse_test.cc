// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "eliminate/kernel_table.h"
#include "reduced/sparse_cholesky.h"

namespace sheaf {
namespace {

struct Case {
  Columns columns;
  std::vector<Tile> tiles;
  Eigen::MatrixXd A;
};

/// Blocks of one to nine columns, each coupled to the next few and a few to the first.
Case street(std::uint32_t blocks, std::uint32_t reach, std::uint32_t border) {
  Case out;
  std::mt19937 random(blocks + reach);
  for (std::uint32_t i = 0; i < blocks; ++i)
    for (int k = 0; k < 9; ++k)
      out.columns.of_image.push_back(k < 1 + static_cast<int>(i * 5 % 9) ? out.columns.count++
                                                                         : Columns::kFixed);
  for (std::uint32_t i = 0; i < blocks; ++i)
    for (std::uint32_t k = 0; k < i; ++k)
      if (i - k <= reach || k < border) out.tiles.push_back({i, k});
  std::uniform_real_distribution<double> u(-1, 1);
  const int n = out.columns.count;
  out.A = Eigen::MatrixXd::Zero(n, n);
  const auto couple = [&](std::uint32_t a, std::uint32_t b) {
    for (int r = 0; r < 9; ++r)
      for (int k = 0; k < 9; ++k) {
        const int i = out.columns.image(a)[r], j = out.columns.image(b)[k];
        if (i >= 0 && j >= 0 && i > j) out.A(i, j) = out.A(j, i) = u(random);
      }
  };
  for (std::uint32_t i = 0; i < blocks; ++i) couple(i, i);
  for (const Tile& tile : out.tiles) couple(tile.row, tile.column);
  for (int i = 0; i < n; ++i) out.A(i, i) = 1 + out.A.row(i).cwiseAbs().sum();
  return out;
}

/// The lower triangle of the inverse where the matrix has entries.
std::vector<double> selected(const Case& of, const char* simd, int count) {
  const auto analysis = analyse_columns(of.columns, of.tiles);
  SparseCholesky cholesky({analysis, &analysis->symbolic}, simd);
  const SymbolicFactor& symbolic = cholesky.symbolic();
  std::map<std::size_t, std::vector<std::pair<int, int>>> entries;
  for (int j = 0; j < of.columns.count; ++j)
    for (int i = j; i < of.columns.count; ++i)
      if (of.A(i, j) != 0)
        entries[symbolic.owner[std::min(symbolic.position[i], symbolic.position[j])]].push_back(
            {i, j});
  Threads threads(count);
  const bool done = cholesky.factor(threads, [&](std::size_t s) {
    if (const auto at = entries.find(s); at != entries.end())
      for (const auto& [i, j] : at->second) cholesky.panels()[cholesky.offset(i, j)] = of.A(i, j);
  });
  EXPECT_TRUE(done);
  cholesky.invert(threads);
  std::vector<double> out;
  for (const auto& [s, list] : entries)
    for (const auto& [i, j] : list) out.push_back(cholesky.panels()[cholesky.offset(i, j)]);
  const Eigen::MatrixXd Z = of.A.inverse();
  std::size_t at = 0;
  double off = 0;
  for (const auto& [s, list] : entries)
    for (const auto& [i, j] : list) off = std::max(off, std::abs(out[at++] - Z(i, j)));
  EXPECT_LT(off, 1e-13 * Z.cwiseAbs().maxCoeff()) << simd;
  return out;
}

TEST(SelectedInverse, IsTheInverseOnThePattern) {
  for (const Kernels* kernels : available_kernels()) {
    selected(street(40, 3, 0), kernels->name, 1);
    selected(street(60, 5, 2), kernels->name, 1);
    selected(street(90, 90, 0), kernels->name, 1);
    selected(street(1, 0, 0), kernels->name, 1);
  }
}

TEST(SelectedInverse, SameBitsForAnyThreadCount) {
  const Case of = street(150, 60, 3);
  const char* simd = available_kernels().front()->name;
  const std::vector<double> one = selected(of, simd, 1);
  EXPECT_EQ(one, selected(of, simd, 2));
  EXPECT_EQ(one, selected(of, simd, 5));
}

}  // namespace
}  // namespace sheaf
