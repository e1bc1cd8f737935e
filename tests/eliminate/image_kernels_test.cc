// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/image_kernels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include "eliminate/kernel_table.h"
#include "geometry/rotation.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

constexpr std::size_t kRecord = 16;

/// Images of 517, 8, 1 and 0 observations: full pieces, a full batch, a lone lane, nothing.
Problem uneven_problem() {
  SceneOptions options;
  options.images = 4;
  options.points = 900;
  options.mean_track = 3;
  const Problem full = generate(options).value().start;
  Problem out = full;
  out.observation_image.clear();
  out.observation_point.clear();
  out.observation_xy.clear();
  const std::size_t most[4] = {517, 8, 1, 0};
  std::size_t taken[4] = {0, 0, 0, 0};
  for (std::size_t i = 0; i < full.num_observations(); ++i) {
    const std::uint32_t image = full.observation_image[i];
    if (taken[image]++ < most[image])
      out.add_observation(image, full.observation_point[i], full.observation_xy[2 * i],
                          full.observation_xy[2 * i + 1]);
  }
  return out;
}

std::vector<double> camera_records(const Problem& problem) {
  std::vector<double> out;
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    const Matrix3<double> R = matrix_from_quaternion(problem.poses[i].rotation);
    out.insert(out.end(), R.begin(), R.end());
    for (double x : problem.poses[i].translation) out.push_back(x);
    const auto& lens = problem.cameras[problem.image_camera[i]].parameters;
    out.insert(out.end(), lens.begin(), lens.begin() + 3);
    out.push_back(0);
  }
  return out;
}

struct Outcome {
  std::vector<double> sums, residuals;
};

Outcome run(const ImageKernels& kernels, const ImageBatches& batches, const Buffer<double>& cameras,
            const ScaledLoss& loss, bool lens) {
  Outcome out;
  for (const auto& piece : batches.pieces) {
    double sums[image_sums::kCount];
    const double* camera = cameras.data() + kRecord * piece.image;
    kernels.sum(batches.batches(piece), piece, camera, loss, lens, sums);
    out.sums.insert(out.sums.end(), sums, sums + image_sums::kCount);
    Buffer<double> residuals(16 * piece.batches);
    kernels.residuals(batches.batches(piece), piece, camera, residuals.data());
    out.residuals.insert(out.residuals.end(), residuals.begin(), residuals.end());
  }
  return out;
}

TEST(ImageKernels, AgreeWithTheirScalarTwin) {
  const Problem problem = uneven_problem();
  const ImageBatches batches = arrange_by_image(problem);
  ASSERT_EQ(batches.observations, 526u);
  ASSERT_EQ(batches.pieces.size(), 4u);
  EXPECT_EQ(batches.pieces[1].batches, 1u);
  EXPECT_EQ(batches.pieces[1].last_lanes, 5u);
  EXPECT_EQ(batches.pieces[3].last_lanes, 1u);
  const std::vector<double> records = camera_records(problem);
  Buffer<double> cameras(records.size());
  std::copy(records.begin(), records.end(), cameras.begin());
  for (const ScaledLoss& loss :
       {ScaledLoss{}, ScaledLoss{LossKind::huber, 2.0, 0.01}, ScaledLoss{LossKind::cauchy, 1.5},
        ScaledLoss{LossKind::tukey, 8.0}})
    for (bool lens : {true, false}) {
      const Outcome expected = run(reference_image_kernels(), batches, cameras, loss, lens);
      std::map<std::string, Outcome> fused;
      for (const Kernels* target : available_kernels()) {
        SCOPED_TRACE(std::string(target->name) + " " + to_string(loss.kind));
        const Outcome actual = run(image_kernels(target->name), batches, cameras, loss, lens);
        ASSERT_EQ(actual.sums.size(), expected.sums.size());
        for (std::size_t at = 0; at < expected.sums.size(); at += image_sums::kCount)
          for (int i = 0; i < 9; ++i)
            for (int k = 0; k <= i; ++k) {
              const std::size_t ik = at + image_sums::entry(i, k);
              // Against the entries' own size: mixed ones may cancel.
              const double size = std::sqrt(expected.sums[at + image_sums::entry(i, i)] *
                                            expected.sums[at + image_sums::entry(k, k)]);
              EXPECT_NEAR(actual.sums[ik], expected.sums[ik], 1e-12 * size) << i << " " << k;
            }
        for (std::size_t at = 0; at < expected.sums.size(); at += image_sums::kCount) {
          for (int i = 0; i < 9; ++i) {
            const std::size_t g = at + image_sums::kGradient + i;
            const double size = std::sqrt(expected.sums[at + image_sums::entry(i, i)] *
                                          expected.sums[at + image_sums::kSquare]);
            EXPECT_NEAR(actual.sums[g], expected.sums[g], 1e-12 * size) << i;
          }
          for (int i : {image_sums::kSquare, image_sums::kLoss})
            EXPECT_NEAR(actual.sums[at + i], expected.sums[at + i], 1e-12 * expected.sums[at + i]);
        }
        for (std::size_t i = 0; i < expected.residuals.size(); ++i)
          EXPECT_NEAR(actual.residuals[i], expected.residuals[i], 1e-9);
        if (target->fused) fused[target->name] = actual;
      }
      for (const auto& [name, outcome] : fused) {
        EXPECT_EQ(outcome.sums, fused.begin()->second.sums) << name;
        EXPECT_EQ(outcome.residuals, fused.begin()->second.residuals) << name;
      }
    }
}

TEST(ImageKernels, ArrangementKeepsEveryObservation) {
  const Problem problem = uneven_problem();
  std::vector<std::uint8_t> skip(problem.num_observations(), 0);
  skip[3] = skip[100] = 1;
  const ImageBatches batches = arrange_by_image(problem, skip);
  EXPECT_EQ(batches.observations, 524u);
  double expected = 0, actual = 0;
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    if (skip[i] == 0)
      expected += problem.observation_xy[2 * i] * (1 + problem.observation_image[i]) +
                  problem.points[3 * problem.observation_point[i] + 2];
  for (const auto& piece : batches.pieces)
    for (std::uint32_t b = 0; b < piece.batches; ++b)
      for (std::uint32_t l = 0; l < (b + 1 == piece.batches ? piece.last_lanes : 8); ++l) {
        const double* z = batches.batches(piece) + ImageBatches::kBatchDoubles * b + l;
        actual += z[24] * (1 + piece.image) + z[16];
      }
  EXPECT_NEAR(actual, expected, 1e-9 * std::abs(expected));
  EXPECT_EQ(8 * ImageBatches::kBatchDoubles / 8 * count_image_batches(problem),
            arrange_by_image(problem).rows.size());
}

}  // namespace
}  // namespace sheaf
