// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/row_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "eliminate/kernel_table.h"
#include "eliminate/lens_kernels.h"
#include "lists/chunks.h"
#include "platform/buffer.h"
#include "rows/patches.h"

namespace sheaf {
namespace {

using test::Patches;

Buffer<double> aligned(const std::vector<double>& v) {
  Buffer<double> out(v.size());
  std::copy(v.begin(), v.end(), out.begin());
  return out;
}

std::vector<double> listed(const double* from, std::size_t count) { return {from, from + count}; }

/// Patches collapsed by one instruction set, both as rows and as factors.
class Collapsed {
 public:
  Collapsed(const Patches& p, bool brightness, const Kernels& kernels)
      : p_(p),
        kernels_(kernels),
        rows_kernels_(row_kernels(kernels.name)),
        views_(aligned(p.views)),
        points_(aligned(p.points)),
        rays_(aligned(p.rays)),
        steps_(kBlockVector * p.targets.size()),
        chunks_(cut_into_chunks(p.batches, static_cast<std::uint32_t>(p.targets.size()),
                                ChunkLists::pairs, 8)) {
    const std::size_t n = p.batches.num_batches();
    // A camera that has lost its pose: where its patches are is not a number.
    for (std::size_t i = 0; i < 12; ++i) views_[i] = 0;
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const bool held = i % kBlockVector >= (brightness ? 8 : 6);
      steps_[i] = held ? 0 : 1e-3 * std::sin(static_cast<double>(i));
    }
    in_ = {&p.batches,
           p.scene.planes.data(),
           p.targets.data(),
           views_.data(),
           points_.data(),
           p.scene.has_rays() ? rays_.data() : nullptr,
           p.scene.references.data(),
           &p.scene.grid,
           nullptr,
           p.scene.camera,
           p.scene.taps,
           {LossKind::huber, 3},
           true,
           brightness,
           p.scene.warped};
    rows_.allocate(kRowBatch * n);
    factors_.allocate(patch_factors(brightness) * n);
    Buffer<double> sums(kBrightnessBatch * n), seen(16 * n);
    PhotometricOutput out{rows_.data(), factors_.data(), sums.data(), seen.data(), nullptr};
    photometric_kernels(kernels.name)
        .collapse(in_, 0, static_cast<std::uint32_t>(p.batches.groups.size()), out);
    left = out.left;
  }

  KeptRows stored() const { return {rows_.data(), nullptr, nullptr}; }
  KeptRows made_again() const { return {nullptr, &in_, factors_.data()}; }

  struct Outcome {
    std::vector<double> numbers;          ///< records, factors, stepped points, sums of both passes
    std::vector<double> diagonal, tiles;  ///< sums of the records
  };
  Outcome run(const KeptRows& rows, bool poses) const {
    Outcome out;
    const auto note = [&](const std::vector<double>& more) {
      out.numbers.insert(out.numbers.end(), more.begin(), more.end());
    };
    Buffer<double> scratch(scratch_doubles(p_.batches, chunks_));
    Buffer<double> factors(kFactorGroup * p_.batches.groups.size()), stepped(points_.size());
    Buffer<double> diagonal(kDiagonalDoubles * p_.targets.size());
    Buffer<double> tiles(kTileDoubles * chunks_.tiles.size());
    diagonal.fill(0), tiles.fill(0);
    const Records records = records_in(scratch.data(), chunks_);
    EliminateOutput eliminated{factors.data(), 0, 0, 0};
    const StoredRowsInput in{&p_.batches, rows, 1e-3, false, poses};
    for (const Chunk& chunk : chunks_.chunks) {
      rows_kernels_.eliminate(in, chunk, records, eliminated);
      const std::size_t count = 8 * (chunk.end_batch - chunk.first_batch);
      if (!poses) {
        note(listed(records.T, kTRecord * count));
        kernels_.diagonal(p_.batches, chunks_, chunk, records, diagonal.data());
        kernels_.pairs(chunks_, chunk, records, tiles.data());
      } else {
        rows_kernels_.pose_diagonal(chunks_, chunk, records, diagonal.data());
        lens_kernels(kernels_.name).pose_pairs(chunks_, chunk, records, tiles.data());
      }
      note(listed(records.C, kCRecord * count));
    }
    TrialOutput trial{stepped.data(), 0, 0, 0, 0};
    const RowTrialInput back{&p_.batches, rows, steps_.data(), points_.data(), factors.data()};
    for (const Chunk& chunk : chunks_.chunks) rows_kernels_.back_substitute(back, chunk, trial);
    note(listed(factors.data(), factors.size()));
    note(listed(stepped.data(), stepped.size()));
    note(
        {eliminated.point_decrease, eliminated.gradient_max2, trial.damping_term, trial.step2_max});
    out.diagonal = listed(diagonal.data(), diagonal.size());
    out.tiles = listed(tiles.data(), tiles.size());
    return out;
  }

  std::uint64_t left = 0;

 private:
  const Patches& p_;
  const Kernels& kernels_;
  const RowKernels& rows_kernels_;
  Buffer<double> views_, points_, rays_, steps_, rows_, factors_;
  Chunks chunks_;
  PhotometricInput in_;
};

TEST(RowKernels, PatchesRowsAreMadeAgainAsTheyWouldBeStored) {
  for (bool on_rays : {false, true}) {
    const Patches p(on_rays, Interpolation::bilinear);
    for (bool brightness : {false, true})
      for (const Kernels* kernels : available_kernels()) {
        const Collapsed patches(p, brightness, *kernels);
        EXPECT_GT(patches.left, 0u);
        EXPECT_LT(patches.left, p.sights.size());
        const auto expected = patches.run(patches.stored(), false);
        const auto got = patches.run(patches.made_again(), false);
        for (double x : expected.numbers) ASSERT_TRUE(std::isfinite(x));
        EXPECT_EQ(got.numbers, expected.numbers) << kernels->name << " rays " << on_rays;
        EXPECT_EQ(got.diagonal, expected.diagonal);
        EXPECT_EQ(got.tiles, expected.tiles);
      }
  }
}

/// What pose columns have of a block: C^T C, the right-hand side and the squares.
void expect_same_poses(const double* got, const double* expected, bool square_alone) {
  double most = 0;
  for (int k = 0; k < 48; ++k) most = std::max(most, std::abs(expected[k]));
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c)
      EXPECT_NEAR(got[8 * r + c], expected[8 * r + c], 1e-12 * most) << r << " " << c;
    if (square_alone) continue;
    EXPECT_NEAR(got[diagonal_layout::right_side(r)], expected[diagonal_layout::right_side(r)],
                1e-12 * most);
    EXPECT_NEAR(got[diagonal_layout::squares(r)], expected[diagonal_layout::squares(r)],
                1e-12 * most);
  }
}

TEST(RowKernels, PosesAloneHaveTheSumsOfWholeBlocks) {
  for (bool on_rays : {false, true}) {
    const Patches p(on_rays, Interpolation::bilinear);
    std::vector<std::vector<double>> diagonals;
    for (const Kernels* kernels : available_kernels()) {
      const Collapsed patches(p, false, *kernels);
      const auto expected = patches.run(patches.made_again(), false);
      const auto got = patches.run(patches.made_again(), true);
      double most = 0;
      for (std::size_t b = 0; b < p.targets.size(); ++b) {
        expect_same_poses(&got.diagonal[kDiagonalDoubles * b],
                          &expected.diagonal[kDiagonalDoubles * b], false);
        for (int k = 72; k < 78; ++k)
          most = std::max(most, std::abs(expected.diagonal[kDiagonalDoubles * b + k]));
      }
      EXPECT_GT(most, 0) << "a right-hand side of zeros would prove nothing";
      for (std::size_t t = 0; t < got.tiles.size() / kTileDoubles; ++t)
        expect_same_poses(&got.tiles[kTileDoubles * t], &expected.tiles[kTileDoubles * t], true);
      if (kernels->fused) diagonals.push_back(got.diagonal);
    }
    for (const auto& diagonal : diagonals) EXPECT_EQ(diagonal, diagonals.front());
  }
}

}  // namespace
}  // namespace sheaf
