// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// The blocks of a few lenses, summed as points are eliminated, against those made of records.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "eliminate/kernel_table.h"
#include "eliminate/lens_kernels.h"
#include "geometry/lenses.h"
#include "geometry/rotation.h"
#include "io/models.h"
#include "lists/lens_chunks.h"
#include "platform/parallel.h"
#include "systems/arrangement.h"

namespace sheaf {
namespace {

using test::ordinary;
using test::seen_by;

/// One linearization of a problem by one instruction set.
class Linearized {
 public:
  Linearized(const Problem& problem, const Kernels& kernels, LensLists lists,
             const ScaledLoss& loss) {
    Threads alone(1);
    const Result<Arrangement> made = arrange_with_lenses(
        problem, {}, std::vector<std::uint8_t>(problem.num_observations(), 0), alone);
    const Arrangement& arranged = made.value();
    const Batches& batches = arranged.batches;
    const LensTracks& tracks = arranged.tracks;
    const LensChunks chunks = cut_lens_chunks(batches, tracks, lists, alone);
    const LensScratch layout(batches, tracks, chunks.chunks, chunks.tiles);
    Buffer<double> scratch(layout.doubles), factors(kFactorGroup * batches.groups.size());
    Buffer<double> metric(kMetricBatch * batches.num_batches()),
        diagonal(kDiagonalDoubles * tracks.num_blocks);
    Buffer<double> tiles(kTileDoubles * std::max<std::size_t>(1, chunks.chunks.tiles.size()));
    Buffer<double> costs(8 * batches.groups.size());
    // What was in the scratch before must not matter.
    scratch.fill(std::nan("")), diagonal.fill(0), tiles.fill(0);
    const LensRecords records = layout.in(scratch.data());
    summed_at_once = records.blocks != nullptr;
    read_state(problem, batches);
    const LensEliminateInput in{
        {&batches, &tracks, {images_.data(), lenses_.data(), points_.data()}}, 1e-3, false, loss};
    EliminateOutput out{factors.data(), 0, 0, 0, 0, metric.data(), costs.data()};
    for (const Chunk& chunk : chunks.chunks.chunks) {
      lens_kernels(kernels.name).linearize(in, chunk, records, out);
      lens_kernels(kernels.name)
          .products(tracks, chunks.tiles, chunks.chunks, chunk, records, diagonal.data(),
                    tiles.data());
    }
    blocks.assign(
        diagonal.begin() + static_cast<std::ptrdiff_t>(kDiagonalDoubles * problem.num_images()),
        diagonal.end());
  }

  bool summed_at_once = false;
  std::vector<double> blocks;  ///< kDiagonalDoubles per block of a lens

 private:
  void read_state(const Problem& problem, const Batches& batches) {
    images_.allocate(kImageRecord * problem.num_images());
    lenses_.allocate(kLensRecord * problem.cameras.size());
    points_.allocate(kPointGroup * batches.groups.size());
    images_.fill(0), lenses_.fill(0), points_.fill(0);
    for (std::size_t i = 0; i < problem.num_images(); ++i) {
      const Matrix3<double> R = matrix_from_quaternion(problem.poses[i].rotation);
      double* to = &images_[kImageRecord * i];
      std::copy(R.begin(), R.end(), to);
      std::copy(problem.poses[i].translation.begin(), problem.poses[i].translation.end(),
                to + pose_record::kTranslation);
    }
    for (std::size_t c = 0; c < problem.cameras.size(); ++c)
      std::copy(problem.cameras[c].parameters.begin(), problem.cameras[c].parameters.end(),
                &lenses_[kLensRecord * c]);
    for (std::size_t g = 0; g < batches.groups.size(); ++g)
      for (std::size_t l = 0; l < 8; ++l)
        for (std::size_t d = 0; d < 3; ++d)
          points_[kPointGroup * g + 8 * d + l] =
              problem.points[3 * std::size_t(batches.lane_point[8 * g + l]) + d];
  }

  Buffer<double> images_, lenses_, points_;
};

/// Lenses of one and of two blocks, shared and of one image alone, in lanes side by side.
Problem few_lenses(std::size_t lenses) {
  const std::vector<CameraModel> models{CameraModel::opencv, CameraModel::full_opencv,
                                        CameraModel::opencv, CameraModel::thin_prism_fisheye};
  std::vector<Camera> cameras;
  for (std::size_t i = 0; i < lenses; ++i) cameras.push_back(ordinary(models[i % models.size()]));
  Problem all = seen_by(cameras, lenses + 2, 45, 9);
  for (std::size_t i = 0; i < all.observation_xy.size(); ++i)
    all.observation_xy[i] += std::sin(static_cast<double>(i));
  Problem out = all;
  out.observation_image.clear(), out.observation_point.clear(), out.observation_xy.clear();
  for (std::size_t i = 0; i < all.num_observations(); ++i)
    if (i % 5 != 0)
      out.add_observation(all.observation_image[i], all.observation_point[i],
                          all.observation_xy[2 * i], all.observation_xy[2 * i + 1]);
  return out;
}

TEST(LensBlocks, AreTheSameSummedAtOnceAndFromRecords) {
  for (std::size_t lenses : {1, 4})
    for (const ScaledLoss& loss : {ScaledLoss{}, ScaledLoss{LossKind::cauchy, 0.5, 0.01}})
      for (const Kernels* kernels : available_kernels()) {
        SCOPED_TRACE(std::string(kernels->name) + ", lenses: " + std::to_string(lenses));
        const Problem problem = few_lenses(lenses);
        const Linearized records(problem, *kernels, LensLists::own_lens, loss);
        const Linearized sums(problem, *kernels, LensLists::diagonal, loss);
        ASSERT_FALSE(records.summed_at_once);
        ASSERT_TRUE(sums.summed_at_once);
        ASSERT_EQ(sums.blocks.size(), records.blocks.size());
        double largest = 0;
        for (std::size_t b = 0; b < sums.blocks.size(); b += kDiagonalDoubles)
          for (std::size_t i = 0; i < 91; ++i) {
            // Of a column: its own unit, by the squares of its entries with and without points.
            const auto size = [&](std::size_t k) {
              const double* of = &records.blocks[b];
              return diagonal_entry(of, k, k) + of[diagonal_layout::squares(k)];
            };
            const std::size_t row = i < 64 ? i / 8 : i < 72 ? 8 : i < 88 ? i % 8 : 8;
            const std::size_t column = i < 72 ? i % 8 : row;
            const double unit = std::sqrt(size(row) * size(column));
            const bool right_side = (i >= 72 && i < 80) || i == 89;
            EXPECT_NEAR(sums.blocks[b + i], records.blocks[b + i],
                        1e-11 * (right_side ? 1e3 * std::sqrt(size(row)) : unit))
                << b << ", " << i;
            largest = std::max(largest, std::abs(sums.blocks[b + i]));
          }
        EXPECT_GT(largest, 1.0);
      }
}

TEST(LensBlocks, ManyLensesHaveRecords) {
  const Problem problem = few_lenses(9);
  EXPECT_FALSE(
      Linearized(problem, *available_kernels()[0], LensLists::diagonal, {}).summed_at_once);
}

}  // namespace
}  // namespace sheaf
