// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The coarse space against S formed block by block and Z multiplied out.
#include "reduced/coarse_space.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "eliminate/kernel_table.h"
#include "geometry/rotation.h"
#include "reduced/camera_solver.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

constexpr std::size_t kImages = 30;
using Matrix = std::vector<std::vector<double>>;

/// One linearised scene: S as a matrix, and the coarse space over given clusters.
struct Linearised {
  Problem problem;
  Batches batches;
  Chunks chunks;
  Columns columns;
  Buffer<double> cameras, points, tiles, diagonal;
  std::vector<double> damping;
  mutable Threads threads{1};
  std::unique_ptr<CoarseSpace> coarse;
  bool factored = false;

  Linearised(const Fixed& fixed, std::uint32_t images_per_lens, double lambda, std::size_t each,
             const Kernels& kernels) {
    SceneOptions options;
    options.images = kImages;
    options.points = 900;
    options.mean_track = 5;
    problem = generate(options).value().start;
    for (std::uint32_t i = 0; i < kImages; ++i) problem.image_camera[i] = i / images_per_lens;
    problem.add_observation(problem.observation_image[0], problem.observation_point[0], 3, 4);
    batches = arrange(problem);
    chunks = cut_into_chunks(batches, kImages, ChunkLists::pairs);
    columns = number_columns(problem, fixed);
    fill_state();
    const Covisibility graph(batches, kImages, threads);
    Clusters clusters = cluster_images(graph, columns, each);
    coarse = std::make_unique<CoarseSpace>(batches, columns, nullptr, std::move(clusters),
                                           chunks.slices.size() - 1, kernels, threads);
    linearize(lambda, kernels);
    factored = coarse->factor(diagonal.data(), damping.data(), {});
  }

  void fill_state() {
    cameras.allocate(kCameraRecord * kImages);
    cameras.fill(0);
    for (std::size_t i = 0; i < kImages; ++i) {
      double* c = &cameras[kCameraRecord * i];
      const Matrix3<double> R = matrix_from_quaternion(problem.poses[i].rotation);
      std::copy(R.begin(), R.end(), c);
      std::copy_n(problem.poses[i].translation.begin(), 3, c + camera_record::kTranslation);
      std::copy_n(problem.cameras[problem.image_camera[i]].parameters.begin(), 3,
                  c + camera_record::kFocal);
    }
    points.allocate(kPointGroup * batches.groups.size());
    for (std::size_t g = 0; g < batches.groups.size(); ++g)
      for (int l = 0; l < 8; ++l)
        for (int d = 0; d < 3; ++d)
          points[kPointGroup * g + 8 * d + l] =
              problem.points[3 * std::size_t(batches.lane_point[8 * g + l]) + d];
  }

  void linearize(double lambda, const Kernels& kernels) {
    tiles.allocate(kTileDoubles * chunks.tiles.size());
    diagonal.allocate(kDiagonalDoubles * kImages);
    tiles.fill(0);
    diagonal.fill(0);
    Buffer<double> factors(kFactorGroup * batches.groups.size());
    Buffer<double> scratch(scratch_doubles(batches, chunks));
    const EliminateInput in{&batches, &chunks, cameras.data(), points.data(), lambda, false};
    EliminateOutput out{factors.data(), 0, 0, 0};
    const Records records = records_in(scratch.data(), chunks);
    coarse->begin({cameras.data()}, lambda);
    for (std::size_t s = 0; s + 1 < chunks.slices.size(); ++s) {
      coarse->clear(s);
      for (std::uint32_t c = chunks.slices[s]; c < chunks.slices[s + 1]; ++c) {
        kernels.linearize(in, chunks.chunks[c], records, out);
        kernels.diagonal(batches, chunks, chunks.chunks[c], records, diagonal.data());
        kernels.pairs(chunks, chunks.chunks[c], records, tiles.data());
        coarse->add(s, chunks.chunks[c], records);
      }
    }
    CameraVectors vectors;
    vectors.gather({&chunks, tiles.data(), diagonal.data()}, columns);
    for (std::int32_t c = 0; c < columns.count; ++c)
      damping.push_back(lambda * std::max(vectors.squares[c], 1e-6));
  }

  /// S + D over the columns.
  Matrix system() const {
    Matrix S(columns.count, std::vector<double>(columns.count, 0));
    const auto add = [&](std::size_t i, std::size_t j, int r, int k, double value) {
      const std::int32_t row = columns.image(i)[r], column = columns.image(j)[k];
      if (row >= 0 && column >= 0) S[row][column] += value;
    };
    for (std::size_t i = 0; i < kImages; ++i)
      for (int r = 0; r < 9; ++r)
        for (int k = 0; k < 9; ++k)
          add(i, i, r, k, diagonal_entry(&diagonal[kDiagonalDoubles * i], r, k));
    for (std::size_t t = 0; t < chunks.tiles.size(); ++t)
      for (int r = 0; r < 9; ++r)
        for (int k = 0; k < 9; ++k) {
          const double value = tile_entry(&tiles[kTileDoubles * t], r, k);
          add(chunks.tiles[t].row, chunks.tiles[t].column, r, k, -value);
          add(chunks.tiles[t].column, chunks.tiles[t].row, k, r, -value);
        }
    for (std::int32_t c = 0; c < columns.count; ++c) S[c][c] += damping[c];
    return S;
  }

  /// Z as it acts on columns: [column][mode].
  Matrix basis(const Clusters& clusters) const {
    Matrix Z(columns.count, std::vector<double>(8 * clusters.count, 0));
    for (std::size_t i = 0; i < kImages; ++i)
      for (int r = 0; r < 7; ++r)
        for (int m = 0; m < 8; ++m)
          if (const std::int32_t c = columns.image(i)[r]; c >= 0 && clusters.of_image[i] >= 0)
            Z[c][8 * clusters.of_image[i] + m] += coarse->basis(i)[8 * r + m];
    return Z;
  }
};

/// Z (Z^T S Z)^-1 Z^T r by elimination; modes without an entry are left out.
std::vector<double> corrected(const Matrix& S, const Matrix& Z, const std::vector<double>& r) {
  const std::size_t n = Z.size(), modes = Z[0].size();
  Matrix E(modes, std::vector<double>(modes, 0)), SZ(n, std::vector<double>(modes, 0));
  std::vector<double> b(modes, 0), z(n, 0);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t m = 0; m < modes; ++m) SZ[i][m] += S[i][j] * Z[j][m];
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t a = 0; a < modes; ++a) {
      b[a] += Z[i][a] * r[i];
      for (std::size_t c = 0; c < modes; ++c) E[a][c] += Z[i][a] * SZ[i][c];
    }
  for (std::size_t a = 0; a < modes; ++a)
    if (E[a][a] == 0) E[a][a] = 1;
  for (std::size_t k = 0; k < modes; ++k)
    for (std::size_t i = k + 1; i < modes; ++i) {
      const double f = E[i][k] / E[k][k];
      for (std::size_t c = k; c < modes; ++c) E[i][c] -= f * E[k][c];
      b[i] -= f * b[k];
    }
  for (std::size_t k = modes; k-- > 0;) {
    for (std::size_t c = k + 1; c < modes; ++c) b[k] -= E[k][c] * b[c];
    b[k] /= E[k][k];
  }
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t m = 0; m < modes; ++m) z[i] += Z[i][m] * b[m];
  return z;
}

/// Of a right-hand side, with S + D and Z as they are in `l`.
void expect_same_correction(const Linearised& l, const char* kernels) {
  const Clusters clusters =
      cluster_images(Covisibility(l.batches, kImages, l.threads), l.columns, 6);
  std::vector<double> r(l.columns.count), z(l.columns.count, 0.25);
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = std::sin(1.0 + 3 * double(i));
  const std::vector<double> expected = corrected(l.system(), l.basis(clusters), r);
  l.coarse->add_correction(r.data(), z.data());
  double scale = 0;
  for (double x : expected) scale = std::max(scale, std::abs(x));
  for (std::size_t i = 0; i < r.size(); ++i)
    ASSERT_NEAR(z[i] - 0.25, expected[i], 1e-6 * scale) << kernels << " column " << i;
}

void expect_explicit_correction(const Fixed& fixed, std::uint32_t images_per_lens) {
  for (const Kernels* kernels : available_kernels()) {
    const Linearised l(fixed, images_per_lens, 1e-3, 6, *kernels);
    ASSERT_TRUE(l.factored);
    ASSERT_GE(l.coarse->num_clusters(), 3);
    expect_same_correction(l, kernels->name);
  }
}

TEST(CoarseSpace, CorrectsAsTheMatrixMultipliedOut) { expect_explicit_correction({}, 1); }

TEST(CoarseSpace, CorrectsAsTheMatrixMultipliedOutWithPartsHeld) {
  Fixed fixed;
  fixed.k1 = true;
  fixed.pose_ids = {2, 3, 4, 5, 6, 19};
  fixed.camera_ids = {7, 8};
  expect_explicit_correction(fixed, 1);
}

TEST(CoarseSpace, CorrectsAsTheMatrixMultipliedOutWithSharedLenses) {
  expect_explicit_correction({}, 4);
  expect_explicit_correction({}, kImages);
}

/// S and Z of the state it was summed at, whatever the next state's cameras, and the new damping.
TEST(CoarseSpace, AMatrixThatIsKeptTakesTheNewDamping) {
  const Kernels& kernels = reference_kernels();
  Linearised l({}, 1, 1e-3, 6, kernels);
  ASSERT_TRUE(l.factored);
  for (double& d : l.damping) d *= 0.5;
  Buffer<double> elsewhere(l.cameras.size());
  elsewhere.fill(1);
  l.coarse->begin({elsewhere.data()}, 5e-4);
  l.coarse->clear(0);
  ASSERT_TRUE(l.coarse->factor(nullptr, l.damping.data(), {}));
  expect_same_correction(l, kernels.name);
}

TEST(CoarseSpace, StrongDampingNeedsNone) {
  const Linearised l({}, 1, 1e-2, 6, reference_kernels());
  EXPECT_FALSE(l.factored);
}

/// Moving, turning or growing the whole scene changes no pixel: S knows nothing of it.
TEST(CoarseSpace, SimilaritiesOfTheWholeSceneCostNothing) {
  const Linearised l({}, 1, 1e-9, kImages, reference_kernels());
  ASSERT_EQ(l.coarse->num_clusters(), 1);
  Clusters all;
  all.of_image.assign(kImages, 0);
  all.count = 1;
  const Matrix S = l.system(), Z = l.basis(all);
  for (int m = 0; m < 7; ++m) {
    double energy = 0, apart = 0;  // of all images together, and if each moved alone
    for (std::size_t i = 0; i < S.size(); ++i) {
      apart += S[i][i] * Z[i][m] * Z[i][m];
      for (std::size_t j = 0; j < S.size(); ++j) energy += Z[i][m] * S[i][j] * Z[j][m];
    }
    EXPECT_LT(std::abs(energy), 1e-6 * apart) << "mode " << m;
  }
}

TEST(CoarseSpace, SmallProblemsHaveNone) {
  const Linearised l({}, 1, 1e-3, 6, reference_kernels());
  EXPECT_EQ(coarse_clusters(l.batches, l.columns, nullptr, l.threads).count, 0);
}

}  // namespace
}  // namespace sheaf
