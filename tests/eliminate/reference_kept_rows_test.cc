// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// The kernels of kept rows against their scalar twin: every instruction set is equivalent to the
// reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "eliminate/close_sums.h"
#include "eliminate/kernel_table.h"
#include "eliminate/lens_kernels.h"
#include "eliminate/row_kernels.h"
#include "rows/patches.h"
#include "rows/reference_patch.h"
#include "rows/row_layout.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

using test::expect_close;
using test::expect_same_diagonal;
using test::expect_same_tiles;
using test::Patches;

Buffer<double> aligned(const std::vector<double>& v) {
  Buffer<double> out(v.size());
  std::copy(v.begin(), v.end(), out.begin());
  return out;
}

std::vector<const RowKernels*> compiled() {
  std::vector<const RowKernels*> out{&row_kernels("baseline")};
  for (const Kernels* kernels : available_kernels())
    if (&row_kernels(kernels->name) != &reference_row_kernels())
      out.push_back(&row_kernels(kernels->name));
  return out;
}

struct Settings {
  bool points_held = false;
  bool poses = false;
};

/// Everything that the kernels produce.
struct Outcome {
  Buffer<double> product, diagonal, tiles, factors, points;
  EliminateOutput eliminated{};
  TrialOutput trial{};
};

/// Kept rows of an arranged problem, in the layout of any instruction set.
class Kept {
 public:
  Kept(const Batches& batches, std::uint32_t blocks)
      : batches_(batches),
        chunks_(cut_into_chunks(batches, blocks, ChunkLists::pairs, 16)),
        blocks_(blocks),
        steps_(kBlockVector * blocks),
        points_(kPointGroup * batches.groups.size()) {
    for (std::size_t i = 0; i < steps_.size(); ++i)
      steps_[i] = i % kBlockVector < 9 ? 1e-3 * std::sin(static_cast<double>(i)) : 0;
    for (std::size_t i = 0; i < points_.size(); ++i)
      points_[i] = 2 + std::cos(static_cast<double>(i));
  }
  virtual ~Kept() = default;

  /// The rows as an instruction set with so many lanes in a part reads them.
  virtual KeptRows rows(int lanes) const = 0;

  void expect_equivalence(const Settings& settings) const {
    const Outcome expected = run(reference_row_kernels(), settings);
    EXPECT_EQ(expected.eliminated.point_decrease > 0, !settings.points_held);
    EXPECT_EQ(expected.trial.step2_max > 0, !settings.points_held);
    for (const RowKernels* kernels : compiled()) {
      SCOPED_TRACE(kernels->name);
      constexpr double kTolerance = 1e-10;
      const Outcome got = run(*kernels, settings);
      expect_same_diagonal(got.diagonal, expected.diagonal, residual_size(), kTolerance);
      expect_same_tiles(got.tiles, expected.tiles, chunks_.tiles, expected.diagonal, kTolerance);
      expect_close(got.factors, expected.factors, kTolerance, "factor");
      expect_close(got.points, expected.points, kTolerance, "point");
      double most = 0;
      for (double y : expected.product) most = std::max(most, std::abs(y));
      for (std::size_t i = 0; i < got.product.size(); ++i)
        ASSERT_NEAR(got.product[i], expected.product[i], kTolerance * most) << "product, " << i;
      const auto near = [](double a, double b) { EXPECT_NEAR(a, b, kTolerance * std::abs(b)); };
      near(got.eliminated.point_decrease, expected.eliminated.point_decrease);
      near(got.eliminated.gradient_max2, expected.eliminated.gradient_max2);
      near(got.trial.damping_term, expected.trial.damping_term);
      near(got.trial.step2_max, expected.trial.step2_max);
    }
  }

 protected:
  /// The root of the sum of squared residuals.
  virtual double residual_size() const = 0;
  const Batches& batches_;

 private:
  Outcome run(const RowKernels& kernels, const Settings& settings) const {
    Outcome out;
    out.diagonal.allocate(kDiagonalDoubles * blocks_);
    out.tiles.allocate(kTileDoubles * chunks_.tiles.size());
    out.factors.allocate(kFactorGroup * batches_.groups.size());
    out.points.allocate(points_.size());
    for (Buffer<double>* of : {&out.diagonal, &out.tiles, &out.factors}) of->fill(0);
    Buffer<double> scratch(scratch_doubles(batches_, chunks_));
    scratch.fill(std::nan(""));  // what was there before must not matter
    const Records records = records_in(scratch.data(), chunks_);
    const KeptRows kept = rows(kernels.lanes);
    out.eliminated.factors = out.factors.data();
    out.trial.points = out.points.data();
    const StoredRowsInput in{&batches_, kept, 1e-3, settings.points_held, settings.poses};
    for (const Chunk& chunk : chunks_.chunks) {
      kernels.eliminate(in, chunk, records, out.eliminated);
      if (settings.poses) {
        kernels.pose_diagonal(chunks_, chunk, records, out.diagonal.data());
        reference_lens_kernels().pose_pairs(chunks_, chunk, records, out.tiles.data());
      } else {
        reference_kernels().diagonal(batches_, chunks_, chunk, records, out.diagonal.data());
        reference_kernels().pairs(chunks_, chunk, records, out.tiles.data());
      }
    }
    const RowTrialInput back{&batches_, kept, steps_.data(), points_.data(), out.factors.data()};
    out.product.allocate(kProductRecord * blocks_);
    out.product.fill(0);
    for (const Chunk& chunk : chunks_.chunks) {
      kernels.back_substitute(back, chunk, out.trial);
      kernels.product(back, chunk, out.product.data());
    }
    for (std::size_t g = 0; g < batches_.groups.size(); ++g)  // beyond a group's points: nothing
      for (std::uint32_t l = batches_.groups[g].lanes; l < 8; ++l)
        for (std::size_t k = 0; k < 12; ++k) out.factors[kFactorGroup * g + 8 * k + l] = 0;
    return out;
  }

  Chunks chunks_;
  std::size_t blocks_;
  Buffer<double> steps_, points_;
};

/// Any rows at all.
class StoredRows : public Kept {
 public:
  StoredRows(const Batches& batches, std::uint32_t images) : Kept(batches, images) {
    fields_.assign(kRowBatch * batches.num_batches(), 0);
    for (const Batches::Group& group : batches.groups)
      for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
        for (std::size_t f = 0; f < row_field::kCount; ++f)
          for (std::size_t l = 0; l < group.lanes; ++l) {
            const std::size_t at = kRowBatch * b + 8 * f + l;
            fields_[at] = std::sin(0.7 * static_cast<double>(at % 9973));
          }
  }
  KeptRows rows(int lanes) const override {
    stored_.allocate(fields_.size());
    for (std::size_t at = 0; at < fields_.size(); ++at) {
      const std::size_t b = at / kRowBatch, field = at % kRowBatch / 8;
      stored_[kRowBatch * b + first_row_field(lanes, static_cast<int>(at % 8)) +
              static_cast<std::size_t>(lanes) * field] = fields_[at];
    }
    return {stored_.data(), nullptr, nullptr};
  }

 protected:
  double residual_size() const override {
    double sum = 0;
    for (std::size_t at = 0; at < fields_.size(); ++at)
      if (at % kRowBatch / 8 < 2) sum += fields_[at] * fields_[at];
    return std::sqrt(sum);
  }

 private:
  std::vector<double> fields_;  ///< of each batch in turn: field, lane
  mutable Buffer<double> stored_;
};

/// Those of patches, made again from factors.
class PatchRows : public Kept {
 public:
  PatchRows(const Patches& p, bool brightness)
      : Kept(p.batches, static_cast<std::uint32_t>(p.targets.size())),
        views_(aligned(p.views)),
        points_(aligned(p.points)),
        rays_(aligned(p.rays)),
        factors_(patch_factors(brightness) * p.batches.num_batches()) {
    std::fill_n(views_.begin(), 12, 0.0);  // a camera that has lost its pose
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
    Buffer<double> sums(kBrightnessBatch * p.batches.num_batches()),
        seen(16 * p.batches.num_batches());
    PhotometricOutput out{nullptr, factors_.data(), sums.data(), seen.data(), nullptr};
    reference_photometric_kernels().collapse(
        in_, 0, static_cast<std::uint32_t>(p.batches.groups.size()), out);
    EXPECT_GT(out.left, 0u);
    EXPECT_LT(out.left, p.sights.size());
    residual_ = std::sqrt(out.square_sum);
  }
  KeptRows rows(int) const override { return {nullptr, &in_, factors_.data()}; }

 protected:
  double residual_size() const override { return residual_; }

 private:
  Buffer<double> views_, points_, rays_, factors_;
  PhotometricInput in_{};
  double residual_ = 0;
};

void expect_equivalence(const Kept& rows, bool poses) {
  for (bool points_held : {false, true}) rows.expect_equivalence({points_held, poses});
}

TEST(ReferenceKeptRows, TheScalarTableIsTheReference) {
  EXPECT_EQ(&row_kernels("scalar"), &reference_row_kernels());
  for (const RowKernels* kernels : compiled())
    EXPECT_NE(kernels->eliminate, reference_row_kernels().eliminate);
}

TEST(ReferenceKeptRows, StoredRowsAreEquivalentToReference) {
  SceneOptions options;
  options.images = 9;
  options.points = 300;
  options.mean_track = 4.3;
  const Batches batches = arrange(generate(options).value().start);
  const StoredRows rows(batches, 9);
  expect_equivalence(rows, false);
  expect_equivalence(rows, true);
}

TEST(ReferenceKeptRows, RowsOfPatchesAreEquivalentToReference) {
  for (bool on_rays : {false, true}) {
    const Patches p(on_rays, Interpolation::bilinear);
    for (bool brightness : {false, true}) {
      SCOPED_TRACE(on_rays ? "rays" : "world points");
      const PatchRows rows(p, brightness);
      expect_equivalence(rows, false);
      if (!brightness) expect_equivalence(rows, true);
    }
  }
}

}  // namespace
}  // namespace sheaf
