// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/dogleg_kernels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "eliminate/kernel_table.h"
#include "geometry/rotation.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

struct Outcome {
  Buffer<double> gradient;
  CurvatureOutput curvature;
  double point_damping = 0;
};

class DoglegKernelsTest : public testing::Test {
 protected:
  void make(const ScaledLoss& loss, bool points_held) {
    points_held_ = points_held;
    SceneOptions options;
    options.images = 9;
    options.points = 700;
    options.mean_track = 4.3;
    Problem problem = generate(options).value().start;
    problem.add_observation(problem.observation_image[0], problem.observation_point[0], 3, 4);
    batches_ = arrange(problem);
    chunks_ = cut_into_chunks(batches_, 9, ChunkLists::pairs);
    cameras_.allocate(kCameraRecord * 9);
    for (std::size_t i = 0; i < 9; ++i) {
      double* c = &cameras_[kCameraRecord * i];
      const Matrix3<double> R = matrix_from_quaternion(problem.poses[i].rotation);
      std::copy(R.begin(), R.end(), c);
      for (int k = 0; k < 3; ++k) {
        c[camera_record::kTranslation + k] = problem.poses[i].translation[k];
        c[camera_record::kFocal + k] = problem.cameras[i].parameters[k];
      }
      for (int k = 0; k < 9; ++k) c[camera_record::kStep + k] = 1e-3 * std::sin(double(9 * i + k));
    }
    points_.allocate(kPointGroup * batches_.groups.size());
    for (std::size_t g = 0; g < batches_.groups.size(); ++g)
      for (int l = 0; l < 8; ++l)
        for (int d = 0; d < 3; ++d)
          points_[kPointGroup * g + 8 * d + l] =
              problem.points[3 * std::size_t(batches_.lane_point[8 * g + l]) + d];
    eliminate(loss);
  }

  /// The factors and the metric that all of them read.
  void eliminate(const ScaledLoss& loss) {
    factors_.allocate(kFactorGroup * batches_.groups.size());
    metric_ =
        Buffer<double>(loss.kind == LossKind::none ? 0 : kMetricBatch * batches_.num_batches());
    Buffer<double> scratch(scratch_doubles(batches_, chunks_));
    Buffer<double> costs(8 * batches_.groups.size());
    EliminateOutput out{factors_.data(), 0, 0, 0, 0, metric_.data(), costs.data()};
    const EliminateInput in{&batches_,    &chunks_, cameras_.data(), points_.data(), kDamping,
                            points_held_, loss};
    for (const Chunk& chunk : chunks_.chunks)
      available_kernels()[0]->linearize(in, chunk, records_in(scratch.data(), chunks_), out);
  }

  Outcome run(const DoglegKernels& kernels) const {
    Outcome out;
    out.gradient.allocate(kProductRecord * 9);
    out.gradient.fill(0);
    const CurvatureInput in{
        {&batches_, cameras_.data(), points_.data(), factors_.data(), metric_.data()},
        kDamping,
        points_held_};
    for (const Chunk& chunk : chunks_.chunks) {
      kernels.gradient(in.state, chunk, out.gradient.data());
      kernels.curvature(in, chunk, out.curvature);
      out.point_damping += kernels.point_damping(in.state, chunk);
    }
    return out;
  }

  static constexpr double kDamping = 1e-3;
  Batches batches_;
  Chunks chunks_;
  Buffer<double> cameras_, points_, factors_, metric_;
  bool points_held_ = false;
};

TEST_F(DoglegKernelsTest, EveryInstructionSetAgreesWithPlainLoops) {
  for (const ScaledLoss& loss : {ScaledLoss{}, ScaledLoss{LossKind::huber, 0.5, 0.01}})
    for (bool points_held : {false, true}) {
      make(loss, points_held);
      const Outcome expected = run(reference_dogleg_kernels());
      EXPECT_GT(expected.curvature.square_sum, 0);
      EXPECT_EQ(expected.curvature.gradient2 > 0, !points_held);
      EXPECT_EQ(expected.point_damping > 0, !points_held);
      double scale = 0;
      for (double x : expected.gradient) scale = std::max(scale, std::abs(x));
      for (const Kernels* kernels : available_kernels()) {
        SCOPED_TRACE(kernels->name);
        const DoglegKernels& descent = dogleg_kernels(kernels->name);
        EXPECT_EQ(std::string(descent.name), kernels->name);
        const Outcome out = run(descent);
        EXPECT_NEAR(out.curvature.square_sum, expected.curvature.square_sum,
                    1e-9 * expected.curvature.square_sum);
        EXPECT_NEAR(out.curvature.gradient2, expected.curvature.gradient2,
                    1e-9 * expected.curvature.gradient2);
        EXPECT_NEAR(out.point_damping, expected.point_damping, 1e-9 * expected.point_damping);
        for (std::size_t i = 0; i < out.gradient.size(); ++i)
          EXPECT_NEAR(out.gradient[i], expected.gradient[i],
                      1e-9 * (std::abs(expected.gradient[i]) + 1e-6 * scale));
      }
    }
}

}  // namespace
}  // namespace sheaf
