// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/patch_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "platform/random.h"

namespace sheaf {
namespace {

constexpr std::size_t kImages = 3, kStep = 16;

/// Three images, each the host of a point that the other two see.
struct Pairs {
  PatchScene scene;
  std::vector<Sight> sights;
  std::vector<RigidMotion<double>> poses;
  std::vector<Brightness> brightness{{1.1, 4}, {0.8, -3}, {1.3, 2}};

  Pairs() {
    scene.planes.resize(kImages);
    scene.rays.assign(9, 1);
    scene.host = {0, 1, 2};
    for (std::uint32_t point = 0; point < 3; ++point)
      for (std::uint32_t image = 0; image < kImages; ++image)
        if (image != point) sights.push_back({point, image});
    Random random(3);
    for (std::size_t i = 0; i < kImages; ++i) {
      Vector3<double> rho, phi;
      for (double& x : rho) x = random.normal();
      for (double& x : phi) x = 0.4 * random.normal();
      poses.push_back(left_perturbed<double>({}, rho, phi));
    }
  }
};

// To first order, a pair's step moves its view as the images' steps do.
TEST(PatchBlocks, StepsOfPairsAreThoseOfTheirImages) {
  const Pairs p;
  const PatchBlocks blocks(p.scene, p.sights);
  ASSERT_EQ(blocks.count(), 6u);
  Random random(5);
  std::vector<double> image_steps(kStep * kImages, 0), steps(kStep * 6);
  std::vector<RigidMotion<double>> poses = p.poses;
  std::vector<Brightness> brightness = p.brightness;
  constexpr double kSmall = 1e-6;
  for (std::size_t i = 0; i < kImages; ++i) {
    double* d = &image_steps[kStep * i];
    for (int k = 0; k < 8; ++k) d[k] = kSmall * random.normal();
    poses[i] = left_perturbed<double>(poses[i], {d[0], d[1], d[2]}, {d[3], d[4], d[5]});
    brightness[i].a += d[6], brightness[i].b += d[7];
  }
  blocks.step(p.poses, p.brightness, image_steps.data(), steps.data());
  std::vector<double> before(6 * kViewRecord), after(6 * kViewRecord);
  blocks.write_views(p.poses, p.brightness, before.data());
  blocks.write_views(poses, brightness, after.data());
  for (std::size_t b = 0; b < 6; ++b) {
    const double *v = &before[kViewRecord * b], *w = &after[kViewRecord * b];
    const double* x = &steps[kStep * b];
    // exp(step) of the view: dR = [phi]_x R, dt = [phi]_x t + rho.
    for (int column = 0; column < 4; ++column) {
      const auto at = [&](const double* view, int row) {
        return column < 3 ? view[3 * row + column] : view[pose_record::kTranslation + row];
      };
      const Vector3<double> turned =
          cross(Vector3<double>{x[3], x[4], x[5]}, Vector3<double>{at(v, 0), at(v, 1), at(v, 2)});
      for (int row = 0; row < 3; ++row)
        EXPECT_NEAR(at(w, row) - at(v, row), turned[row] + (column == 3 ? x[row] : 0), 1e-10);
    }
    EXPECT_NEAR(w[view_record::kAlpha] - v[view_record::kAlpha], x[6], 1e-10);
    EXPECT_NEAR(w[view_record::kBeta] - v[view_record::kBeta], x[7], 1e-10);
  }
}

// For any sums and any step of the images: x_images^T S_images x_images = x_pairs^T S_pairs
// x_pairs, and the same for the right-hand side.
TEST(PatchBlocks, FoldingKeepsTheQuadraticForm) {
  const Pairs p;
  const PatchBlocks blocks(p.scene, p.sights);
  // Pairs of one host are coupled: (target, host) in order are 01 02 10 12 20 21.
  const std::vector<Tile> tiles{{4, 2}, {5, 0}, {3, 1}};
  const std::vector<Tile> image_tiles = blocks.image_tiles(tiles);
  ASSERT_EQ(image_tiles.size(), 3u);
  std::vector<std::int64_t> tile_of(kImages * kImages, -1);
  for (std::size_t t = 0; t < image_tiles.size(); ++t)
    tile_of[image_tiles[t].row * kImages + image_tiles[t].column] = static_cast<std::int64_t>(t);
  Random random(7);
  std::vector<double> sums(kTileDoubles * tiles.size(), 0), diagonal(kDiagonalDoubles * 6, 0);
  for (std::size_t t = 0; t < tiles.size(); ++t)
    for (int k = 0; k < 64; ++k) sums[kTileDoubles * t + k] = random.normal();
  for (std::size_t b = 0; b < 6; ++b)
    for (int i = 0; i < 8; ++i) {
      diagonal[kDiagonalDoubles * b + diagonal_layout::right_side(i)] = random.normal();
      for (int j = 0; j <= i; ++j)
        diagonal[kDiagonalDoubles * b + 8 * i + j] = diagonal[kDiagonalDoubles * b + 8 * j + i] =
            random.normal();
    }
  std::vector<double> image_sums(kTileDoubles * 3, 0), image_diagonal(kDiagonalDoubles * 3, 0);
  blocks.fold(
      p.poses, p.brightness, kImages,
      {&tiles, sums.data(), diagonal.data(), &tile_of, image_sums.data(), image_diagonal.data()});

  std::vector<double> x(kStep * kImages, 0), y(kStep * 6);
  for (std::size_t i = 0; i < kImages; ++i)
    for (int k = 0; k < 8; ++k) x[kStep * i + k] = random.normal();
  blocks.step(p.poses, p.brightness, x.data(), y.data());
  const auto form = [](const std::vector<double>& v, const std::vector<Tile>& at,
                       const std::vector<double>& off, const std::vector<double>& on) {
    double square = 0, linear = 0;
    for (std::size_t b = 0; b < v.size() / kStep; ++b)
      for (int i = 0; i < 8; ++i) {
        linear += v[kStep * b + i] * on[kDiagonalDoubles * b + diagonal_layout::right_side(i)];
        for (int j = 0; j < 8; ++j)
          square += v[kStep * b + i] * on[kDiagonalDoubles * b + 8 * i + j] * v[kStep * b + j];
      }
    for (std::size_t t = 0; t < at.size(); ++t)
      for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j)
          square -= 2 * v[kStep * at[t].row + i] * off[kTileDoubles * t + 8 * i + j] *
                    v[kStep * at[t].column + j];
    return std::pair(square, linear);
  };
  const auto [square, linear] = form(y, tiles, sums, diagonal);
  const auto [image_square, image_linear] = form(x, image_tiles, image_sums, image_diagonal);
  EXPECT_NEAR(image_square, square, 1e-9 * std::abs(square) + 1e-9);
  EXPECT_NEAR(image_linear, linear, 1e-9 * std::abs(linear) + 1e-9);
}

}  // namespace
}  // namespace sheaf
