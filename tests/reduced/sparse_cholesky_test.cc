// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/sparse_cholesky.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "eliminate/kernel_table.h"
#include "reduced/camera_solver.h"

namespace sheaf {
namespace {

/// A camera system with random blocks, its diagonal heavy enough to be positive definite.
struct Scene {
  Columns columns;
  Chunks chunks;
  std::vector<double> tiles, diagonal;
  CameraVectors vectors;
  std::vector<double> damping;

  CameraSystem system() const {
    return {{&chunks, tiles.data(), diagonal.data()}, &vectors, damping.data()};
  }
};

enum class Lenses { own, one_of_three, one };

/// Two streets without a common point, images seeing the next few and now and then one far off;
/// every seventh image's pose and every fifth lens are held, image 4 has no tiles, image 9 sees a
/// point twice.
Scene random_scene(std::uint32_t images, Lenses lenses, std::uint32_t reach) {
  std::mt19937 random(images + reach);
  std::uniform_real_distribution<double> u(-1, 1);
  Scene s;
  Problem problem;
  problem.poses.resize(images);
  for (std::uint32_t i = 0; i < images; ++i)
    problem.image_camera.push_back(lenses == Lenses::own            ? i
                                   : lenses == Lenses::one_of_three ? i % 3
                                                                    : 0);
  problem.cameras.resize(problem.image_camera.empty() ? 0 : images);
  Fixed fixed;
  for (std::uint32_t i = 3; i < images; i += 7) fixed.pose_ids.push_back(i);
  for (std::uint32_t i = 3; i < images; i += 5) fixed.camera_ids.push_back(i);
  s.columns = number_columns(problem, fixed);
  std::set<std::pair<std::uint32_t, std::uint32_t>> pairs;
  const std::uint32_t half = images / 2;
  for (std::uint32_t i = 0; i < images; ++i)
    for (std::uint32_t k = 0; k < images; ++k) {
      if (i == 4 || k == 4 || k > i || (i < half) != (k < half)) continue;
      if (i == k ? i == 9 : i - k <= reach || random() % 97 == 0) pairs.insert({i, k});
    }
  for (const auto& [i, k] : pairs) s.chunks.tiles.push_back({i, k});
  for (std::size_t t = 0; t < kTileDoubles * pairs.size(); ++t) s.tiles.push_back(u(random));
  s.diagonal.assign(kDiagonalDoubles * images, 0);
  for (double& d : s.diagonal) d = 0.1 * u(random);
  for (std::uint32_t i = 0; i < images; ++i)
    for (int r = 0; r < 8; ++r)
      for (int k = 0; k < r; ++k)
        s.diagonal[kDiagonalDoubles * i + 8 * k + r] = s.diagonal[kDiagonalDoubles * i + 8 * r + k];
  s.vectors.gather(s.system().sums, s.columns);
  for (std::int32_t c = 0; c < s.columns.count; ++c)
    s.damping.push_back(40.0 * (1 + reach) + 20.0 * images * (lenses != Lenses::own) +
                        10 * u(random));
  return s;
}

std::vector<double> solution(const Scene& scene, CameraSolver& solver) {
  Buffer<double> x((static_cast<std::size_t>(scene.columns.count) + 7) / 8 * 8);
  EXPECT_TRUE(solver.solve(scene.system(), x).solved);
  return {x.begin(), x.begin() + scene.columns.count};
}

TEST(SparseCholesky, SolvesAsTheDenseSolverOnEveryInstructionSet) {
  Threads threads(2);
  for (const Kernels* kernels : available_kernels())
    for (std::uint32_t images : {1u, 12u, 60u, 150u})
      for (Lenses lenses : {Lenses::own, Lenses::one_of_three, Lenses::one})
        for (std::uint32_t reach : {1u, 6u}) {
          SCOPED_TRACE(std::string(kernels->name) + " images " + std::to_string(images) +
                       " lenses " + std::to_string(int(lenses)) + " reach " +
                       std::to_string(reach));
          const Scene scene = random_scene(images, lenses, reach);
          const auto dense = make_dense_solver(scene.columns, *kernels, threads);
          const auto sparse = make_sparse_solver(scene.columns, scene.chunks, *kernels, threads);
          const std::vector<double> expected = solution(scene, *dense);
          // Twice: the second solve must find nothing of the first.
          for (int turn = 0; turn < 2; ++turn) {
            const std::vector<double> x = solution(scene, *sparse);
            double largest = 0, worst = 0;
            for (std::size_t c = 0; c < x.size(); ++c) {
              largest = std::max(largest, std::abs(expected[c]));
              worst = std::max(worst, std::abs(x[c] - expected[c]));
            }
            EXPECT_GT(largest, 0);
            EXPECT_LE(worst, 1e-12 * largest);
          }
        }
}

TEST(SparseCholesky, SolvesAsTheDenseSolverWherePanelsAreCut) {
  Threads threads(2);
  const Kernels& kernels = *available_kernels().front();
  for (Lenses lenses : {Lenses::own, Lenses::one_of_three}) {
    const Scene scene = random_scene(230, lenses, 70);
    const SymbolicFactor symbolic = analyse(build_column_graph(scene.columns, scene.chunks.tiles));
    for (const Supernode& s : symbolic.supernodes) ASSERT_LE(s.width, SymbolicFactor::kWidest);
    const auto dense = make_dense_solver(scene.columns, kernels, threads);
    const auto sparse = make_sparse_solver(scene.columns, scene.chunks, kernels, threads);
    const std::vector<double> expected = solution(scene, *dense), x = solution(scene, *sparse);
    for (std::size_t c = 0; c < x.size(); ++c) EXPECT_NEAR(x[c], expected[c], 1e-14);
  }
}

TEST(SparseCholesky, SameBitsForAnyThreadCount) {
  const Kernels& kernels = *available_kernels().front();
  for (Lenses lenses : {Lenses::own, Lenses::one_of_three}) {
    const Scene scene = random_scene(400, lenses, 12);
    Threads one(1);
    const std::vector<double> expected =
        solution(scene, *make_sparse_solver(scene.columns, scene.chunks, kernels, one));
    for (int count : {2, 5, 16}) {
      Threads threads(count);
      EXPECT_EQ(expected, solution(scene, *make_sparse_solver(scene.columns, scene.chunks, kernels,
                                                              threads)));
    }
  }
}

TEST(SparseCholesky, SameBitsWhereMultiplyAddIsFused) {
  const Scene scene = random_scene(150, Lenses::own, 6);
  Threads threads(1);
  std::vector<double> expected;
  for (const Kernels* kernels : available_kernels()) {
    if (!kernels->fused) continue;
    const std::vector<double> x =
        solution(scene, *make_sparse_solver(scene.columns, scene.chunks, *kernels, threads));
    if (expected.empty()) expected = x;
    EXPECT_EQ(expected, x) << kernels->name;
  }
}

TEST(SparseCholesky, KeepsTheFactorOfAStreetNarrow) {
  const Scene scene = random_scene(400, Lenses::own, 4);
  const SymbolicFactor symbolic = analyse(build_column_graph(scene.columns, scene.chunks.tiles));
  EXPECT_EQ(symbolic.size(), static_cast<std::size_t>(scene.columns.count));
  const auto n = static_cast<std::uint64_t>(scene.columns.count);
  EXPECT_LT(symbolic.entries, n * n / 6);
  std::vector<std::int32_t> position = symbolic.position;
  std::sort(position.begin(), position.end());
  for (std::size_t c = 0; c < position.size(); ++c)
    ASSERT_EQ(position[c], static_cast<std::int32_t>(c));
  for (std::size_t s = 0; s < symbolic.supernodes.size(); ++s)
    if (const std::int32_t parent = symbolic.supernodes[s].parent; parent >= 0) {
      ASSERT_GT(parent, static_cast<std::int32_t>(s));
    }
}

TEST(SparseCholesky, ALensOfAllImagesIsABorder) {
  const Scene own = random_scene(400, Lenses::own, 4), one = random_scene(400, Lenses::one, 4);
  const SymbolicFactor a = analyse(build_column_graph(own.columns, own.chunks.tiles));
  const SymbolicFactor b = analyse(build_column_graph(one.columns, one.chunks.tiles));
  EXPECT_LT(b.entries, a.entries);
}

TEST(SparseCholesky, RefusesWhatIsNotPositiveDefinite) {
  Threads threads(2);
  for (double bad : {-1e6, std::nan(""), double(INFINITY)})
    for (std::size_t column : {0u, 100u, 500u}) {
      Scene scene = random_scene(60, Lenses::own, 3);
      ASSERT_GT(scene.damping.size(), 400u);
      scene.damping[std::min(column, scene.damping.size() - 1)] = bad;
      const auto solver =
          make_sparse_solver(scene.columns, scene.chunks, *available_kernels().front(), threads);
      Buffer<double> x((scene.damping.size() + 7) / 8 * 8);
      EXPECT_FALSE(solver->solve(scene.system(), x).solved);
    }
}

TEST(SparseCholesky, StopsWhenCancelled) {
  const Scene scene = random_scene(400, Lenses::own, 3);
  for (int count : {1, 3}) {
    Threads threads(count);
    const auto solver =
        make_sparse_solver(scene.columns, scene.chunks, *available_kernels().front(), threads);
    int asked = 0;
    const std::function<bool()> cancelled = [&] { return ++asked > (count == 1 ? 2 : 0); };
    CameraSystem system = scene.system();
    system.cancelled = &cancelled;
    Buffer<double> x((scene.damping.size() + 7) / 8 * 8);
    EXPECT_FALSE(solver->solve(system, x).solved);
    EXPECT_EQ(asked, count == 1 ? 3 : 1);
  }
}

}  // namespace
}  // namespace sheaf
