// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "eliminate/kernel_table.h"
#include "eliminate/weighted.h"
#include "geometry/rotation.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

/// Everything that the kernels produce from one state.
struct Outcome {
  Buffer<double> tiles, diagonal, factors, trial_points, product, float_product, metric, residuals,
      own_damping, point_costs;
  EliminateOutput eliminated{};
  TrialOutput trial{};
  double square_sum = 0;
  std::uint64_t behind = 0;
};

class KernelsTest : public ::testing::Test {
 protected:
  void make(bool points_held, ChunkLists lists) {
    points_held_ = points_held;
    SceneOptions options;
    options.images = 9;
    options.points = 700;
    options.mean_track = 4.3;
    Problem problem = generate(options).value().start;
    // One image sees a point twice; one point is behind its cameras; one is seen once.
    problem.add_observation(problem.observation_image[0], problem.observation_point[0], 3, 4);
    const std::uint32_t lonely = problem.add_point(0.1, 0.2, 0.3);
    problem.add_observation(2, lonely, 10, -20);
    if (weighted_) test::weigh(problem);
    loss_.weighted = weighted_;
    batches_ = arrange(problem);
    chunks_ = cut_into_chunks(batches_, 9, lists);
    fill(problem);
  }

  /// The cameras as the single precision product has them: lengths after (X - origin) scale.
  Buffer<float> float_cameras(const double* origin, double scale) const {
    const std::size_t images = cameras_.size() / kCameraRecord;
    Buffer<float> out(kFloatCameraRecord * images);
    out.fill(0);
    for (std::size_t i = 0; i < images; ++i) {
      const double* c = &cameras_[kCameraRecord * i];
      float* to = &out[kFloatCameraRecord * i];
      for (std::size_t k = 0; k < kCameraRecord; ++k) to[k] = static_cast<float>(c[k]);
      for (int k = 0; k < 3; ++k) {
        const double* R = c + 3 * k;
        const double t = c[camera_record::kTranslation + k] + R[0] * origin[0] + R[1] * origin[1] +
                         R[2] * origin[2];
        to[camera_record::kTranslation + k] = static_cast<float>(scale * t);
        to[camera_record::kRho + k] = static_cast<float>(scale * c[camera_record::kRho + k]);
      }
    }
    return out;
  }

  void fill(const Problem& problem) {
    cameras_.allocate(kCameraRecord * problem.num_images());
    trial_cameras_.allocate(cameras_.size());
    for (std::size_t i = 0; i < problem.num_images(); ++i) {
      double* c = &cameras_[kCameraRecord * i];
      const Matrix3<double> R = matrix_from_quaternion(problem.poses[i].rotation);
      std::copy(R.begin(), R.end(), c);
      for (int k = 0; k < 3; ++k) {
        c[camera_record::kTranslation + k] = problem.poses[i].translation[k];
        c[camera_record::kFocal + k] = problem.cameras[i].parameters[k];
      }
      for (int k = 0; k < 9; ++k) c[camera_record::kStep + k] = 1e-3 * std::sin(double(9 * i + k));
      double* t = &trial_cameras_[kCameraRecord * i];
      std::copy(c, c + kCameraRecord, t);
      t[camera_record::kTranslation] += 0.01;
      t[camera_record::kFocal] *= 1.001;
    }
    points_.allocate(kPointGroup * batches_.groups.size());
    for (std::size_t g = 0; g < batches_.groups.size(); ++g)
      for (int l = 0; l < 8; ++l)
        for (int d = 0; d < 3; ++d)
          points_[kPointGroup * g + 8 * d + l] =
              problem.points[3 * std::size_t(batches_.lane_point[8 * g + l]) + d];
  }

  Outcome run(const Kernels& kernels) {
    Outcome out;
    out.tiles.allocate(kTileDoubles * chunks_.tiles.size());
    out.tiles.fill(0);
    out.diagonal.allocate(kDiagonalDoubles * 9);
    out.diagonal.fill(0);
    out.factors.allocate(kFactorGroup * batches_.groups.size());
    out.factors.fill(0);
    out.trial_points.allocate(points_.size());
    // Some points damp themselves.
    out.own_damping.allocate(8 * batches_.groups.size());
    for (std::size_t i = 0; i < out.own_damping.size(); ++i)
      out.own_damping[i] = i % 5 == 0 ? own_damping_ : 0;
    Buffer<double> scratch(scratch_doubles(batches_, chunks_));
    const EliminateInput in{
        &batches_,      &chunks_, cameras_.data(),
        points_.data(), 1e-3,     points_held_,
        loss_,          chart_,   loss_.weighs() ? out.own_damping.data() : nullptr};
    out.eliminated.factors = out.factors.data();
    if (loss_.weighs()) out.metric.allocate(kMetricBatch * batches_.num_batches());
    out.eliminated.metric = out.metric.data();
    out.point_costs.allocate(8 * batches_.groups.size());
    out.eliminated.point_costs = out.point_costs.data();
    const Records records = records_in(scratch.data(), chunks_);
    for (const Chunk& chunk : chunks_.chunks) {
      kernels.linearize(in, chunk, records, out.eliminated);
      kernels.diagonal(batches_, chunks_, chunk, records, out.diagonal.data());
      kernels.pairs(chunks_, chunk, records, out.tiles.data());
    }
    const TrialInput trial{&batches_,
                           cameras_.data(),
                           trial_cameras_.data(),
                           points_.data(),
                           out.factors.data(),
                           true,
                           points_held_ ? 0 : inner_iterations_,
                           mean_square_,
                           loss_,
                           out.metric.data(),
                           chart_,
                           blend_,
                           {out.point_costs.data(), 1e-3, 1e-6}};
    out.trial.points = out.trial_points.data();
    out.trial.own_damping = out.own_damping.data();
    out.product.allocate(kProductRecord * 9);
    out.product.fill(0);
    Buffer<double> saved(product_scratch_doubles(batches_));
    const ProductInput product{&batches_, cameras_.data(), points_.data(), out.factors.data(),
                               out.metric.data()};
    out.residuals.allocate(16 * batches_.num_batches());
    out.float_product.allocate(out.product.size());
    out.float_product.fill(0);
    const double origin[3] = {0.3, -0.2, 5};
    const Buffer<float> rounded = float_cameras(origin, 0.125);
    const FloatProductInput single{&batches_,
                                   rounded.data(),
                                   points_.data(),
                                   out.factors.data(),
                                   {origin[0], origin[1], origin[2]},
                                   0.125,
                                   out.metric.data()};
    for (const Chunk& chunk : chunks_.chunks) {
      kernels.product_float(single, chunk, reinterpret_cast<float*>(saved.data()),
                            out.float_product.data());
      kernels.product(product, chunk, saved.data(), out.product.data());
      kernels.trial(trial, chunk, out.trial);
      kernels.residuals(batches_, cameras_.data(), points_.data(), chunk,
                        &out.residuals[16 * chunk.first_batch]);
      out.square_sum += kernels.square_sum(batches_, cameras_.data(), points_.data(), chunk);
      out.behind += kernels.count_behind(batches_, cameras_.data(), points_.data(), chunk);
    }
    return out;
  }

  /// slack: of trial points and sums; loose: of everything.
  void expect_agreement(double slack = 1, double loose = 1);

  Batches batches_;
  Chunks chunks_;
  Buffer<double> cameras_, trial_cameras_, points_;
  bool points_held_ = false;
  int inner_iterations_ = 3;
  PointBlend blend_;
  bool weighted_ = false;      ///< observations have sigmas, some points rows of their own
  double own_damping_ = 0.05;  ///< of some points under a loss
  double mean_square_ = 1;     ///< px^2: every point has something to gain
  ScaledLoss loss_;
  ChartRules chart_;
};

constexpr LossKind kLosses[] = {LossKind::huber, LossKind::soft_l1, LossKind::cauchy,
                                LossKind::tukey, LossKind::geman_mcclure};

void expect_close(const Buffer<double>& a, const Buffer<double>& b, double tolerance,
                  const std::string& what) {
  ASSERT_EQ(a.size(), b.size());
  double scale = 0;
  for (double x : b) scale = std::max(scale, std::abs(x));
  for (std::size_t i = 0; i < a.size(); ++i)
    ASSERT_NEAR(a[i], b[i], tolerance * (std::abs(b[i]) + 1e-6 * scale)) << what << " " << i;
}

/// Column by column against the largest of any image: rounding to float is relative to the terms of
/// a sum, not to what is left of them.
void expect_close_by_column(const Buffer<double>& a, const Buffer<double>& b, double tolerance) {
  for (std::size_t k = 0; k < 9; ++k) {
    double scale = 0;
    for (std::size_t i = k; i < b.size(); i += kProductRecord)
      scale = std::max(scale, std::abs(b[i]));
    for (std::size_t i = k; i < b.size(); i += kProductRecord)
      ASSERT_NEAR(a[i], b[i], tolerance * scale) << "column " << k << " at " << i;
  }
}

/// The entries that mean something: 83 of a tile's 88 doubles and 91 of a diagonal block's 96 are
/// sums; lanes beyond a group's points are padding.
void clear_padding(const Batches& batches, Outcome& o) {
  for (std::size_t g = 0; g < batches.groups.size(); ++g)
    for (std::uint32_t l = batches.groups[g].lanes; l < 8; ++l) {
      for (std::uint32_t k = 0; k < batches.groups[g].track && o.metric.size() > 0; ++k)
        for (std::size_t i = 0; i < 3; ++i)
          o.metric[kMetricBatch * (batches.groups[g].first_batch + k) + 8 * i + l] = 0;
      o.own_damping[8 * g + l] = 0;
      for (int k = 0; k < 12; ++k) o.factors[kFactorGroup * g + 8 * k + l] = 0;
      for (int k = 0; k < 3; ++k) o.trial_points[kPointGroup * g + 8 * k + l] = 0;
    }
}

void KernelsTest::expect_agreement(double slack, double loose) {
  Outcome expected = run(reference_kernels());
  clear_padding(batches_, expected);
  for (const Kernels* kernels : available_kernels()) {
    SCOPED_TRACE(kernels->name);
    Outcome got = run(*kernels);
    clear_padding(batches_, got);
    expect_close(got.tiles, expected.tiles, loose * 1e-9, "tile");
    expect_close(got.diagonal, expected.diagonal, loose * 1e-8, "diagonal");
    expect_close(got.factors, expected.factors, loose * 1e-9, "factor");
    const auto near = [=](double a, double b) {
      EXPECT_NEAR(a, b, slack * loose * 1e-10 * std::abs(b));
    };
    expect_close(got.metric, expected.metric, 1e-9, "metric");
    expect_close(got.own_damping, expected.own_damping, 1e-12, "own damping");
    near(got.trial.left_decrease, expected.trial.left_decrease);
    expect_close(got.residuals, expected.residuals, 1e-9, "residual");
    near(got.eliminated.loss_sum, expected.eliminated.loss_sum);
    near(got.trial.loss_sum, expected.trial.loss_sum);
    expect_close(got.product, expected.product, loose * 1e-7, "product");
    expect_close_by_column(got.float_product, expected.float_product, 1e-5);
    expect_close(got.trial_points, expected.trial_points, slack * loose * 1e-11, "trial point");
    near(got.eliminated.square_sum, expected.eliminated.square_sum);
    near(got.eliminated.point_decrease, expected.eliminated.point_decrease);
    near(got.eliminated.gradient_max2, expected.eliminated.gradient_max2);
    near(got.trial.square_sum, expected.trial.square_sum);
    near(got.trial.damping_term, expected.trial.damping_term);
    near(got.trial.step2_max, expected.trial.step2_max);
    near(got.square_sum, expected.square_sum);
    EXPECT_EQ(got.trial.newly_behind, expected.trial.newly_behind);
    EXPECT_EQ(got.behind, expected.behind);
    if (!weighted_) {
      EXPECT_NEAR(got.square_sum, got.eliminated.square_sum, 1e-10 * got.square_sum);
    }
  }
}

TEST_F(KernelsTest, EveryInstructionSetMatchesTheReference) {
  for (ChunkLists lists : {ChunkLists::none, ChunkLists::diagonal, ChunkLists::pairs}) {
    make(lists == ChunkLists::diagonal, lists);
    expect_agreement();
  }
}

TEST_F(KernelsTest, EveryInstructionSetMatchesTheReferenceWithALoss) {
  for (ChunkLists lists : {ChunkLists::diagonal, ChunkLists::pairs})
    for (LossKind kind : kLosses) {
      SCOPED_TRACE(to_string(kind));
      make(lists == ChunkLists::diagonal, lists);
      for (double floor : {1.0, 0.1, 1e-3}) {
        SCOPED_TRACE(floor);
        loss_ = {kind, kind == LossKind::tukey ? 40.0 : 5.0, floor};
        // Points whose weights are small are loose: inner iterations move them by rounding.
        expect_agreement(1000);
      }
    }
}

/// Charts of both kinds, about another place and in another unit than the scene's.
constexpr ChartBase kCharts[] = {ChartBase::origin, ChartBase::host};
ChartRules chart_rules(ChartBase base, bool crosses) {
  return {base, {0.3, -0.2, 0.5}, 0.25, crosses, 1e-2};
}

TEST_F(KernelsTest, EveryInstructionSetMatchesTheReferenceInCharts) {
  for (ChartBase base : kCharts)
    for (const ScaledLoss& loss : {ScaledLoss(), ScaledLoss{LossKind::cauchy, 5}})
      for (bool crosses : {true, false}) {
        SCOPED_TRACE(base == ChartBase::host ? "host" : "origin");
        chart_ = chart_rules(base, crosses);
        loss_ = loss;
        make(false, ChunkLists::pairs);
        // The reference works by X, Y and Z, where the point that one image sees is loose.
        expect_agreement(1000, 1000);
      }
}

TEST_F(KernelsTest, EveryInstructionSetMatchesTheReferenceWithSigmasAndPriors) {
  weighted_ = true;
  for (LossKind kind : {LossKind::none, LossKind::cauchy})
    for (ChartBase base : {ChartBase::none, ChartBase::host}) {
      SCOPED_TRACE(to_string(kind));
      chart_ = base == ChartBase::none ? ChartRules() : chart_rules(base, true);
      make(false, ChunkLists::pairs);
      loss_ = {kind, 5.0, 0.1, true};
      expect_agreement(1000, base == ChartBase::none ? 1 : 1000);
    }
}

/// A third of the points as far away as 2000 times the distance of two cameras. Their factor by X,
/// Y and Z, from which the reference works, holds 7 digits less.
TEST_F(KernelsTest, EveryInstructionSetMatchesTheReferenceInChartsOfFarPoints) {
  for (ChartBase base : kCharts) {
    SCOPED_TRACE(base == ChartBase::host ? "host" : "origin");
    make(false, ChunkLists::pairs);
    chart_ = chart_rules(base, true);
    inner_iterations_ = 0;
    for (std::size_t g = 0; g < batches_.groups.size(); g += 3)
      for (int k = 0; k < 24; ++k) points_[kPointGroup * g + k] *= 2000;
    Outcome expected = run(reference_kernels());
    clear_padding(batches_, expected);
    for (const Kernels* kernels : available_kernels()) {
      SCOPED_TRACE(kernels->name);
      Outcome got = run(*kernels);
      clear_padding(batches_, got);
      expect_close(got.tiles, expected.tiles, 1e-3, "tile");
      expect_close(got.diagonal, expected.diagonal, 1e-3, "diagonal");
      expect_close_by_column(got.product, expected.product, 1e-5);
      EXPECT_NEAR(got.eliminated.point_decrease, expected.eliminated.point_decrease,
                  1e-7 * expected.eliminated.point_decrease);
    }
  }
}

TEST_F(KernelsTest, AWideLossIsNone) {
  own_damping_ = 0;
  make(false, ChunkLists::pairs);
  const Outcome plain = run(*available_kernels().front());
  for (LossKind kind : kLosses) {
    loss_ = {kind, 1e9};
    const Outcome wide = run(*available_kernels().front());
    EXPECT_NEAR(wide.eliminated.loss_sum, plain.eliminated.square_sum,
                1e-9 * plain.eliminated.square_sum);
    EXPECT_EQ(wide.eliminated.square_sum, plain.eliminated.square_sum);
    expect_close(wide.product, plain.product, 1e-6, "product");
    expect_close(wide.tiles, plain.tiles, 1e-6, "tile");
  }
}

TEST_F(KernelsTest, InnerIterationsMatchTheReferenceAndLowerTheCost) {
  make(false, ChunkLists::none);
  double previous = std::numeric_limits<double>::infinity();
  for (int most : {0, 1, 2, 3}) {
    inner_iterations_ = most;
    const Outcome expected = run(reference_kernels());
    if (most < 2)
      EXPECT_LT(expected.trial.square_sum, previous);
    else  // the first step leaves little
      EXPECT_LE(expected.trial.square_sum, previous);
    previous = expected.trial.square_sum;
    for (const Kernels* kernels : available_kernels()) {
      SCOPED_TRACE(std::string(kernels->name) + ", at most " + std::to_string(most));
      const Outcome got = run(*kernels);
      EXPECT_NEAR(got.trial.square_sum, previous, 1e-10 * previous);
      EXPECT_EQ(got.trial.damping_term, run(*kernels).trial.damping_term);
    }
  }
}

TEST_F(KernelsTest, StepsTowardsSteepestDescentMatchTheReference) {
  make(false, ChunkLists::none);
  const Outcome newton = run(reference_kernels());
  for (const PointBlend& blend : {PointBlend{0.3, 2e-4, 1.5}, PointBlend{0, 1e-4}}) {
    blend_ = blend;
    for (int most : {0, 3}) {
      inner_iterations_ = most;
      EXPECT_NE(run(reference_kernels()).trial.square_sum, newton.trial.square_sum);
      expect_agreement();
    }
  }
}

TEST_F(KernelsTest, InnerIterationsEndAtEachPointsOwnMinimum) {
  make(false, ChunkLists::none);
  inner_iterations_ = 50;
  const Outcome there = run(reference_kernels());
  // From there, with the stepped cameras held, nothing is left to gain but by damped steps.
  points_ = Buffer<double>(there.trial_points.size());
  std::copy(there.trial_points.begin(), there.trial_points.end(), points_.begin());
  std::copy(trial_cameras_.begin(), trial_cameras_.end(), cameras_.begin());
  for (std::size_t i = 0; i < 9; ++i)
    std::fill_n(&cameras_[kCameraRecord * i + camera_record::kStep], 9, 0.0);
  const Outcome again = run(reference_kernels());
  EXPECT_NEAR(again.trial.square_sum, there.trial.square_sum, 1e-4 * there.trial.square_sum);
}

// The moved, scaled and rounded scene has the product of the scene: the two are compared after the
// lengths are taken back.
TEST_F(KernelsTest, TheProductInSinglePrecisionIsTheProduct) {
  make(false, ChunkLists::none);
  for (const ScaledLoss& loss : {ScaledLoss(), ScaledLoss{LossKind::cauchy, 5}}) {
    loss_ = loss;
    for (const Kernels* kernels : available_kernels()) {
      SCOPED_TRACE(std::string(kernels->name) + ", loss " + to_string(loss.kind));
      Outcome got = run(*kernels);
      for (std::size_t i = 0; i < got.float_product.size(); ++i)
        if (i % kProductRecord < 3) got.float_product[i] *= 0.125;
      expect_close_by_column(got.float_product, got.product, 1e-5);
    }
  }
}

TEST_F(KernelsTest, InstructionSetsWithFusedMultiplyAddAgreeBitForBit) {
  make(false, ChunkLists::pairs);
  std::vector<const Kernels*> fused;
  for (const Kernels* kernels : available_kernels())
    if (kernels->fused) fused.push_back(kernels);
  if (fused.size() < 2) GTEST_SKIP() << "this machine runs fewer than two such sets";
  for (LossKind kind : {LossKind::none, LossKind::huber, LossKind::soft_l1, LossKind::cauchy,
                        LossKind::tukey, LossKind::geman_mcclure}) {
    SCOPED_TRACE(to_string(kind));
    loss_ = {kind, 5};
    const Outcome first = run(*fused[0]);
    for (std::size_t k = 1; k < fused.size(); ++k) {
      SCOPED_TRACE(fused[k]->name);
      const Outcome other = run(*fused[k]);
      const auto same = [](const Buffer<double>& a, const Buffer<double>& b) {
        return std::equal(a.begin(), a.end(), b.begin(), b.end());
      };
      EXPECT_TRUE(same(first.tiles, other.tiles));
      EXPECT_TRUE(same(first.diagonal, other.diagonal));
      EXPECT_TRUE(same(first.factors, other.factors));
      EXPECT_TRUE(same(first.trial_points, other.trial_points));
      EXPECT_TRUE(same(first.product, other.product));
      EXPECT_TRUE(same(first.float_product, other.float_product));
      EXPECT_EQ(first.trial.square_sum, other.trial.square_sum);
      EXPECT_EQ(first.eliminated.square_sum, other.eliminated.square_sum);
      EXPECT_EQ(first.eliminated.loss_sum, other.eliminated.loss_sum);
      EXPECT_EQ(first.trial.loss_sum, other.trial.loss_sum);
    }
  }
}

TEST_F(KernelsTest, ChartsAgreeBitForBitWithFusedMultiplyAdd) {
  for (ChartBase base : kCharts)
    for (LossKind kind : {LossKind::none, LossKind::huber}) {
      make(false, ChunkLists::pairs);
      chart_ = chart_rules(base, true);
      loss_ = {kind, 5};
      std::vector<Outcome> outcomes;
      for (const Kernels* kernels : available_kernels())
        if (kernels->fused) outcomes.push_back(run(*kernels));
      for (const Outcome& other : outcomes) {
        const Outcome& first = outcomes[0];
        EXPECT_TRUE(std::equal(other.factors.begin(), other.factors.end(), first.factors.begin()));
        EXPECT_TRUE(std::equal(other.tiles.begin(), other.tiles.end(), first.tiles.begin()));
        EXPECT_TRUE(std::equal(other.trial_points.begin(), other.trial_points.end(),
                               first.trial_points.begin()));
        EXPECT_EQ(other.trial.damping_term, first.trial.damping_term);
        EXPECT_EQ(other.trial.step2_max, first.trial.step2_max);
        EXPECT_EQ(other.trial.square_sum, first.trial.square_sum);
      }
    }
}

/// Which lanes go on depends on the point alone, not on who shares its register.
TEST_F(KernelsTest, InnerIterationsAgreeBitForBitWhereverLanesStop) {
  make(false, ChunkLists::none);
  for (double mean : {1e-2, 1.0, 1e2, 1e3, 1e4, 1e5}) {
    mean_square_ = mean;
    std::vector<Outcome> outcomes;
    for (const Kernels* kernels : available_kernels())
      if (kernels->fused) outcomes.push_back(run(*kernels));
    for (const Outcome& other : outcomes) {
      EXPECT_TRUE(std::equal(other.trial_points.begin(), other.trial_points.end(),
                             outcomes[0].trial_points.begin()));
      EXPECT_EQ(other.trial.square_sum, outcomes[0].trial.square_sum) << mean;
    }
  }
}

}  // namespace
}  // namespace sheaf
