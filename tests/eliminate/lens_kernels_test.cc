// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// The kernels of lenses of any model against their scalar twin: every instruction set is equivalent
// to the reference.
#include "eliminate/lens_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "eliminate/close_sums.h"
#include "eliminate/kernel_table.h"
#include "eliminate/weighted.h"
#include "geometry/rotation.h"
#include "lists/lens_chunks.h"
#include "platform/parallel.h"
#include "solve/lens_problems.h"
#include "systems/arrangement.h"

namespace sheaf {
namespace {

using test::all_models;
using test::column_size;
using test::disturbed;
using test::expect_close;
using test::expect_same_diagonal;
using test::expect_same_tiles;
using test::mixtures;
using test::nothing_held;
using test::ordinary;
using test::thinned;
using test::unshared;

/// What a run of the kernels is asked for beyond problem and state.
struct Settings {
  LensLists lists = LensLists::pairs;
  ScaledLoss loss{};
  double damping = 1e-3;
  bool points_held = false;
  int inner_iterations = 3;
  double mean_square = 1e-2;  ///< px^2: every point has something to gain
  ChartRules chart{};
  PointBlend blend{};
};

/// Everything that the kernels produce from one state.
struct Outcome {
  Buffer<double> tiles, diagonal, factors, metric, product, gradient, trial_points, residuals,
      own_damping, point_costs;
  Buffer<float> kept;
  CurvatureOutput curvature{};
  double point_damping = 0;
  EliminateOutput eliminated{};
  TrialOutput trial{};
};

/// A problem arranged for the kernels, at a held and a tried state.
class LensProblem {
 public:
  LensProblem(const Problem& problem, const Fixed& fixed, const Settings& settings)
      : settings_(settings),
        arranged_(arrange_with_lenses(problem, fixed,
                                      std::vector<std::uint8_t>(problem.num_observations(), 0),
                                      alone_)
                      .value()),
        chunks_(cut_lens_chunks(arranged_.batches, arranged_.tracks, settings.lists, alone_)),
        layout_(arranged_.batches, arranged_.tracks, chunks_.chunks, chunks_.tiles) {
    write_states(problem);
  }

  /// Blocks of lenses, without records.
  bool sums_at_once() const { return layout_.jacobians > layout_.blocks; }
  Outcome run(const LensKernels& kernels) const;
  void expect_agreement(const LensKernels& kernels, const Outcome& expected, double slack) const;

 private:
  void write_states(const Problem& problem);
  void eliminate(const LensKernels& kernels, Outcome& out) const;
  void multiply(const LensKernels& kernels, Outcome& out) const;
  LensState held() const { return {images_.data(), lenses_.data(), points_.data()}; }
  LensState tried() const { return {tried_images_.data(), tried_lenses_.data(), nullptr}; }
  LensInput input() const { return {&arranged_.batches, &arranged_.tracks, held()}; }

  Settings settings_;
  mutable Threads alone_{1};
  Arrangement arranged_;
  LensChunks chunks_;
  LensScratch layout_;
  Buffer<double> images_, lenses_, points_, tried_images_, tried_lenses_;
};

void LensProblem::write_states(const Problem& problem) {
  const Batches& batches = arranged_.batches;
  for (Buffer<double>* images : {&images_, &tried_images_})
    images->allocate(kImageRecord * problem.num_images());
  for (Buffer<double>* lenses : {&lenses_, &tried_lenses_})
    lenses->allocate(kLensRecord * problem.cameras.size());
  images_.fill(0), lenses_.fill(0);
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    const Matrix3<double> R = matrix_from_quaternion(problem.poses[i].rotation);
    double* to = &images_[kImageRecord * i];
    std::copy(R.begin(), R.end(), to);
    std::copy(problem.poses[i].translation.begin(), problem.poses[i].translation.end(), to + 9);
    for (int k = 0; k < 6; ++k)
      to[image_record::kStep + k] = 1e-3 * std::sin(static_cast<double>(6 * i) + k);
  }
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) {
    const std::array<double, kMaxCameraParameters>& k = problem.cameras[c].parameters;
    double* to = &lenses_[kLensRecord * c];
    std::copy(k.begin(), k.end(), to);
    for (std::size_t p = 0; p < k.size(); ++p)
      if (arranged_.tracks.lenses[c].place[p] >= 0)
        to[lens_record::kStep + p] = 1e-4 * k[p] * std::cos(static_cast<double>(c + p));
  }
  std::copy(images_.begin(), images_.end(), tried_images_.begin());
  std::copy(lenses_.begin(), lenses_.end(), tried_lenses_.begin());
  for (std::size_t i = 0; i < problem.num_images(); ++i)
    tried_images_[kImageRecord * i + pose_record::kTranslation] += 1e-3;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) tried_lenses_[kLensRecord * c] *= 1.0001;
  points_.allocate(kPointGroup * batches.groups.size());
  for (std::size_t g = 0; g < batches.groups.size(); ++g)
    for (std::size_t l = 0; l < 8; ++l)
      for (std::size_t d = 0; d < 3; ++d)
        points_[kPointGroup * g + 8 * d + l] =
            problem.points[3 * std::size_t(batches.lane_point[8 * g + l]) + d];
}

/// Sums over records that are no lenses' own are those of the reference, whoever wrote the records.
void LensProblem::eliminate(const LensKernels& kernels, Outcome& out) const {
  const LensTracks& tracks = arranged_.tracks;
  Buffer<double> scratch(layout_.doubles);
  scratch.fill(std::nan(""));  // what was there before must not matter
  const LensRecords records = layout_.in(scratch.data());
  const LensEliminateInput in{input(),
                              settings_.damping,
                              settings_.points_held,
                              settings_.loss,
                              settings_.chart,
                              settings_.loss.weighs() ? out.own_damping.data() : nullptr};
  const bool poses_alone = std::all_of(tracks.lenses.begin(), tracks.lenses.end(),
                                       [](const LensPlaces& lens) { return lens.riders == 0; });
  for (std::size_t c = 0; c < chunks_.chunks.chunks.size(); ++c) {
    const Chunk& chunk = chunks_.chunks.chunks[c];
    kernels.linearize(in, chunk, records, out.eliminated);
    reference_kernels().diagonal(arranged_.batches, chunks_.chunks, chunk, records.image,
                                 out.diagonal.data());
    (poses_alone ? kernels.pose_pairs : reference_kernels().pairs)(chunks_.chunks, chunk,
                                                                   records.image, out.tiles.data());
    reference_kernels().pairs(chunks_.slots, chunks_.slots.chunks[c], records.image,
                              out.tiles.data());
    kernels.products(tracks, chunks_.tiles, chunks_.chunks, chunk, records, out.diagonal.data(),
                     out.tiles.data());
  }
}

/// Of an x that moves all columns alike.
void LensProblem::multiply(const LensKernels& kernels, Outcome& out) const {
  const LensTracks& tracks = arranged_.tracks;
  Buffer<double> x(kProductRecord * tracks.num_blocks);
  Buffer<double> saved(product_scratch_doubles(arranged_.batches, tracks));
  x.fill(0), saved.fill(std::nan(""));
  for (std::size_t b = 0; b < tracks.num_blocks; ++b)
    for (int k = 0; k < 9; ++k)
      if (const double size = column_size(out.diagonal, b, k); size > 0)
        x[kProductRecord * b + std::size_t(k)] = std::sin(double(9 * b) + k) / size;
  const LensProductInput in{input(), out.factors.data(), out.metric.data(), x.data()};
  for (const Chunk& chunk : chunks_.chunks.chunks) {
    kernels.product(in, chunk, saved.data(), out.product.data());
    kernels.gradient(in, chunk, out.gradient.data());
    kernels.curvature(in, settings_.damping, settings_.points_held, chunk, out.curvature);
    out.point_damping += kernels.point_damping(in, chunk);
    kernels.keep(in, 0.5, chunk, out.kept.data());
  }
}

Outcome LensProblem::run(const LensKernels& kernels) const {
  const Batches& batches = arranged_.batches;
  Outcome out;
  out.tiles.allocate(kTileDoubles * std::max<std::size_t>(1, chunks_.chunks.tiles.size()));
  out.diagonal.allocate(kDiagonalDoubles * arranged_.tracks.num_blocks);
  out.product.allocate(kProductRecord * arranged_.tracks.num_blocks);
  out.kept.allocate(8 * kept_row::fields(arranged_.tracks.most_blocks) * batches.num_batches());
  out.gradient.allocate(kProductRecord * arranged_.tracks.num_blocks);
  out.factors.allocate(kFactorGroup * batches.groups.size());
  if (settings_.loss.weighs()) out.metric.allocate(kMetricBatch * batches.num_batches());
  out.trial_points.allocate(points_.size());
  out.residuals.allocate(16 * batches.num_batches());
  for (Buffer<double>* of : {&out.tiles, &out.diagonal, &out.product, &out.gradient, &out.factors})
    of->fill(0);
  out.eliminated.factors = out.factors.data();
  out.eliminated.metric = out.metric.data();
  out.point_costs.allocate(8 * batches.groups.size());
  out.eliminated.point_costs = out.point_costs.data();
  out.trial.points = out.trial_points.data();
  out.own_damping.allocate(8 * batches.groups.size());
  for (std::size_t i = 0; i < out.own_damping.size(); ++i)
    out.own_damping[i] = i % 5 == 0 ? 0.05 : 0;  // some points damp themselves
  out.trial.own_damping = out.own_damping.data();
  eliminate(kernels, out);
  multiply(kernels, out);
  const LensTrialInput trial{&batches,
                             &arranged_.tracks,
                             held(),
                             tried(),
                             out.factors.data(),
                             settings_.points_held ? 0 : settings_.inner_iterations,
                             settings_.mean_square,
                             settings_.loss,
                             out.metric.data(),
                             settings_.chart,
                             settings_.blend,
                             {out.point_costs.data(), settings_.damping, 1e-6}};
  for (const Chunk& chunk : chunks_.chunks.chunks) {
    kernels.trial(trial, chunk, out.trial);
    kernels.residuals(input(), chunk, &out.residuals[16 * chunk.first_batch]);
  }
  // Lanes beyond a group's points mean nothing in these.
  for (std::size_t g = 0; g < batches.groups.size(); ++g)
    for (std::uint32_t l = batches.groups[g].lanes; l < 8; ++l) {
      for (std::size_t k = 0; k < 12; ++k) out.factors[kFactorGroup * g + 8 * k + l] = 0;
      for (std::uint32_t o = 0; o < batches.groups[g].track && out.metric.size() > 0; ++o)
        for (std::size_t i = 0; i < 3; ++i)
          out.metric[kMetricBatch * (batches.groups[g].first_batch + o) + 8 * i + l] = 0;
      out.own_damping[8 * g + l] = 0;
    }
  return out;
}

void LensProblem::expect_agreement(const LensKernels& kernels, const Outcome& expected,
                                   double slack) const {
  SCOPED_TRACE(kernels.name);
  const Outcome got = run(kernels);
  const double tolerance = slack * 1e-10;
  expect_same_diagonal(got.diagonal, expected.diagonal, std::sqrt(expected.eliminated.square_sum),
                       tolerance);
  expect_same_tiles(got.tiles, expected.tiles, chunks_.chunks.tiles, expected.diagonal, tolerance);
  for (std::size_t b = 0; b < arranged_.tracks.num_blocks; ++b)
    for (int k = 0; k < 9; ++k) {
      const std::size_t at = kProductRecord * b + std::size_t(k);
      ASSERT_NEAR(got.product[at], expected.product[at],
                  10 * tolerance * column_size(expected.diagonal, b, k))
          << "product, block " << b << ", " << k;
      const double residual = std::sqrt(expected.eliminated.square_sum);
      ASSERT_NEAR(got.gradient[at], expected.gradient[at],
                  10 * tolerance * residual * column_size(expected.diagonal, b, k))
          << "gradient, block " << b << ", " << k;
    }
  expect_close(got.factors, expected.factors, tolerance, "factor");
  expect_close(got.metric, expected.metric, 1e-10, "metric");
  expect_close(got.own_damping, expected.own_damping, 1e-12, "own damping");
  expect_close(got.residuals, expected.residuals, 1e-10, "residual");
  expect_close(got.trial_points, expected.trial_points, tolerance, "trial point");
  const auto near = [slack](double a, double b) { EXPECT_NEAR(a, b, slack * 1e-10 * std::abs(b)); };
  near(got.eliminated.square_sum, expected.eliminated.square_sum);
  near(got.eliminated.loss_sum, expected.eliminated.loss_sum);
  near(got.eliminated.point_decrease, expected.eliminated.point_decrease);
  near(got.eliminated.gradient_max2, expected.eliminated.gradient_max2);
  near(got.trial.square_sum, expected.trial.square_sum);
  near(got.trial.loss_sum, expected.trial.loss_sum);
  near(got.trial.left_decrease, expected.trial.left_decrease);
  near(got.trial.damping_term, expected.trial.damping_term);
  near(got.trial.step2_max, expected.trial.step2_max);
  near(got.curvature.square_sum, expected.curvature.square_sum);
  near(got.curvature.gradient2, expected.curvature.gradient2);
  near(got.point_damping, expected.point_damping);
  for (std::size_t i = 0; i < got.kept.size(); ++i)
    ASSERT_NEAR(got.kept[i], expected.kept[i], 1e-5 * (1 + std::abs(expected.kept[i]))) << i;
}

/// The compiled instruction sets that the machine has, and the baseline.
std::vector<const LensKernels*> compiled() {
  std::vector<const LensKernels*> out{&lens_kernels("baseline")};
  for (const Kernels* kernels : available_kernels())
    if (&lens_kernels(kernels->name) != &reference_lens_kernels())
      out.push_back(&lens_kernels(kernels->name));
  return out;
}

void expect_equivalence(const Problem& problem, const Fixed& fixed, const Settings& settings,
                        double slack = 1) {
  const LensProblem arranged(problem, fixed, settings);
  const Outcome expected = arranged.run(reference_lens_kernels());
  ASSERT_GT(expected.eliminated.square_sum, 0);
  ASSERT_GT(expected.trial.square_sum, 0);
  for (const LensKernels* kernels : compiled())
    arranged.expect_agreement(*kernels, expected, slack);
}

TEST(LensKernels, TheScalarTableIsTheReference) {
  EXPECT_EQ(&lens_kernels("scalar"), &reference_lens_kernels());
  for (const LensKernels* kernels : compiled())
    EXPECT_NE(kernels->linearize, reference_lens_kernels().linearize) << kernels->name;
}

/// Own lenses have riders, shared ones blocks; with nothing held up to two of them.
TEST(LensKernels, EveryModelIsEquivalentToReference) {
  for (CameraModel model : all_models())
    for (bool shared : {true, false})
      for (bool hold : {true, false}) {
        SCOPED_TRACE(std::string(to_string(model)) + (shared ? ", shared" : ", own") +
                     (hold ? "" : ", nothing held"));
        const Problem one = thinned(disturbed({ordinary(model)}, 5, 43, 1), 2);
        const Problem problem = shared ? one : unshared(one);
        expect_equivalence(problem, hold ? Fixed{} : nothing_held(problem), {});
        Settings robust;
        robust.loss = {LossKind::cauchy, 0.5, 1e-2};
        expect_equivalence(problem, hold ? Fixed{} : nothing_held(problem), robust);
      }
}

constexpr LossKind kLosses[] = {LossKind::none,   LossKind::huber, LossKind::soft_l1,
                                LossKind::cauchy, LossKind::tukey, LossKind::geman_mcclure};

/// Points with several slots, lanes with different lenses, lenses of one and of two blocks.
TEST(LensKernels, MixedLensesAreEquivalentToReference) {
  for (const Problem& problem : mixtures())
    for (LossKind loss : kLosses)
      for (bool hold : {true, false}) {
        SCOPED_TRACE(to_string(loss));
        Settings settings;
        settings.loss = {loss, loss == LossKind::tukey ? 5.0 : 1.0, 0.05};
        expect_equivalence(problem, hold ? Fixed{} : nothing_held(problem), settings);
      }
}

TEST(LensKernels, SigmasAndPriorsAreEquivalentToReference) {
  for (Problem problem : mixtures())
    for (LossKind loss : {LossKind::none, LossKind::huber, LossKind::cauchy}) {
      SCOPED_TRACE(to_string(loss));
      problem.observation_sigma.clear(), problem.terms.points.clear();
      test::weigh(problem);
      Settings settings;
      settings.loss = {loss, 1.0, 0.05, true};
      expect_equivalence(problem, {}, settings);
    }
}

TEST(LensKernels, EveryListIsEquivalentToReference) {
  for (const Problem& problem : mixtures())
    for (LensLists lists : {LensLists::diagonal, LensLists::own_lens, LensLists::pairs})
      for (bool points_held : {true, false}) {
        Settings settings;
        settings.lists = lists;
        settings.points_held = points_held;
        expect_equivalence(problem, nothing_held(problem), settings);
      }
}

/// Of few lenses, whose blocks are summed without records where nothing else is wanted.
TEST(LensKernels, BlocksSummedAtOnceAreEquivalentToReference) {
  const Problem problem = mixtures()[2];
  for (LossKind loss : {LossKind::none, LossKind::huber})
    for (bool points_held : {true, false}) {
      Settings settings;
      settings.lists = LensLists::diagonal;
      settings.loss = {loss, 0.5};
      settings.points_held = points_held;
      ASSERT_TRUE(LensProblem(problem, {}, settings).sums_at_once());
      expect_equivalence(problem, {}, settings);
      expect_equivalence(problem, nothing_held(problem), settings);
    }
}

/// About another place and in another unit than the scene's; of points that are near.
TEST(LensKernels, ChartsAreEquivalentToReference) {
  for (const Problem& problem : mixtures())
    for (ChartBase base : {ChartBase::origin, ChartBase::host})
      for (bool crosses : {true, false})
        for (LossKind loss : {LossKind::none, LossKind::huber}) {
          SCOPED_TRACE(base == ChartBase::host ? "host" : "origin");
          Settings settings;
          settings.loss = {loss, 1.0};
          settings.chart = {base, {0.1, -0.2, 0.3}, 0.5, crosses, 1e-12};
          for (int most : {0, 3}) {
            settings.inner_iterations = most;
            expect_equivalence(problem, nothing_held(problem), settings, 100);
          }
        }
}

/// The steps that a dogleg tries: of Newton's and of steepest descent's.
TEST(LensKernels, BlendedStepsAreEquivalentToReference) {
  for (const Problem& problem : mixtures())
    for (LossKind loss : {LossKind::none, LossKind::cauchy}) {
      Settings settings;
      settings.loss = {loss, 1.0};
      settings.blend = {0.6, 0.2 * settings.damping, 2};
      expect_equivalence(problem, {}, settings);
    }
}

TEST(LensKernels, PartsHeldAreEquivalentToReference) {
  for (const Problem& problem : mixtures()) {
    Fixed some = nothing_held(problem);
    for (std::size_t c = 0; c < some.parameters.size(); ++c)
      some.parameters[c] = static_cast<ParameterSet>(0x2d5 >> c % 3);
    some.camera_ids = {1};
    Fixed intrinsics;
    intrinsics.intrinsics = true;
    for (const Fixed& fixed : {some, intrinsics}) expect_equivalence(problem, fixed, {});
  }
}

TEST(LensKernels, OneImageThatSeesAPointTwiceIsEquivalentToReference) {
  for (Problem problem : mixtures()) {
    for (std::size_t i = 0; i < 60; i += 3)
      problem.add_observation(problem.observation_image[i], problem.observation_point[i],
                              problem.observation_xy[2 * i] + 3, problem.observation_xy[2 * i + 1]);
    const std::uint32_t lonely = problem.add_point(0.1, 0.2, 0.3);
    problem.add_observation(0, lonely, 300, 200);
    expect_equivalence(problem, {}, {}, 1000);  // one observation leaves the lonely point loose
  }
}

/// Enough observations for several chunks.
TEST(LensKernels, SeveralChunksAreEquivalentToReference) {
  for (bool shared : {true, false}) {
    const Problem one = thinned(disturbed({ordinary(CameraModel::opencv)}, 12, 900, 21), 22);
    expect_equivalence(shared ? one : unshared(one), {}, {});
  }
}

TEST(LensKernels, InnerIterationsAreEquivalentToReferenceAndLowerTheCost) {
  for (const Problem& problem : mixtures()) {
    double previous = std::numeric_limits<double>::infinity();
    for (int most : {0, 1, 2, 3}) {
      Settings settings;
      settings.inner_iterations = most;
      settings.mean_square = 1e-6;
      const LensProblem arranged(problem, {}, settings);
      const Outcome expected = arranged.run(reference_lens_kernels());
      if (most < 2)
        EXPECT_LT(expected.trial.square_sum, previous);
      else  // the first step leaves little
        EXPECT_LE(expected.trial.square_sum, previous);
      previous = expected.trial.square_sum;
      for (const LensKernels* kernels : compiled())
        arranged.expect_agreement(*kernels, expected, 1);
    }
  }
}

}  // namespace
}  // namespace sheaf
