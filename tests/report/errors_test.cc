// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "platform/random.h"
#include "report/alignment.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

Vector3<double> normal3(Random& random, double scale) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {scale * x, scale * y, scale * z};
}

double distance(const Vector3<double>& a, const Vector3<double>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

Similarity random_similarity(Random& random) {
  return {std::exp(random.normal()), quaternion_from_angle_axis(normal3(random, 1.5)),
          normal3(random, 10)};
}

TEST(Align, RecoversASimilarity) {
  Random random(1);
  for (int round = 0; round < 50; ++round) {
    const Similarity truth = random_similarity(random);
    std::vector<Vector3<double>> from, to;
    for (int i = 0; i < 3 + round; ++i) {
      from.push_back(normal3(random, 5));
      to.push_back(truth(from.back()));
    }
    const auto [found, certainty] = align(from, to);
    EXPECT_GT(certainty, 1e-4);
    EXPECT_NEAR(found.scale, truth.scale, 1e-11 * truth.scale);
    for (std::size_t i = 0; i < from.size(); ++i)
      EXPECT_LT(distance(found(from[i]), to[i]), 1e-9 * truth.scale);
  }
}

TEST(Align, IsALeastSquaresMinimum) {
  Random random(2);
  const Similarity truth = random_similarity(random);
  std::vector<Vector3<double>> from, to;
  for (int i = 0; i < 40; ++i) {
    from.push_back(normal3(random, 1));
    to.push_back(truth(from.back()));
    const Vector3<double> noise = normal3(random, 0.1);
    for (int k = 0; k < 3; ++k) to.back()[k] += noise[k];
  }
  const auto cost = [&](const Similarity& s) {
    double sum = 0;
    for (std::size_t i = 0; i < from.size(); ++i) sum += std::pow(distance(s(from[i]), to[i]), 2);
    return sum;
  };
  const Similarity best = align(from, to).similarity;
  for (int round = 0; round < 200; ++round) {
    Similarity other = best;
    other.scale *= 1 + 1e-4 * random.normal();
    other.rotation = multiply(quaternion_from_angle_axis(normal3(random, 1e-4)), other.rotation);
    const Vector3<double> step = normal3(random, 1e-4);
    for (int k = 0; k < 3; ++k) other.translation[k] += step[k];
    EXPECT_GE(cost(other), cost(best) * (1 - 1e-13));
  }
}

TEST(Align, KnowsWhatDoesNotDetermineARotation) {
  const Alignment line = align({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 0, 0}},
                               {{1, 1, 1}, {1, 2, 1}, {1, 3, 1}, {1, 6, 1}});
  EXPECT_LT(line.certainty, 1e-12);
  const Alignment one = align({{1, 2, 3}}, {{4, 4, 4}});
  EXPECT_EQ(one.certainty, 0);
  EXPECT_LT(distance(one.similarity({1, 2, 3}), {4, 4, 4}), 1e-15);
}

TEST(ErrorStatistics, AreWhatTheyAreCalled) {
  const ErrorStatistics s = statistics_of_errors({4, 0, 3, 1});
  EXPECT_EQ(s.mean, 2);
  EXPECT_EQ(s.median, 2);
  EXPECT_DOUBLE_EQ(s.rms, std::sqrt(26.0 / 4));
  EXPECT_EQ(s.max, 4);
  EXPECT_EQ(statistics_of_errors({}).max, 0);
}

// X' = s R X + t moves a camera cam_from_world to R_cam R^T, and its t to s t_cam - R_cam R^T t.
Problem moved(const Problem& problem, const Similarity& S) {
  Problem out = problem;
  out.bal_angle_axis.clear();
  for (std::size_t i = 0; i < problem.num_points(); ++i) {
    const auto X = S({problem.points[3 * i], problem.points[3 * i + 1], problem.points[3 * i + 2]});
    for (int k = 0; k < 3; ++k) out.points[3 * i + k] = X[k];
  }
  const Quaternion<double> inverse = {S.rotation[0], -S.rotation[1], -S.rotation[2],
                                      -S.rotation[3]};
  for (Pose& pose : out.poses) {
    pose.rotation = multiply(Quaternion<double>(pose.rotation), inverse);
    const auto shift =
        multiply(matrix_from_quaternion(Quaternion<double>(pose.rotation)), S.translation);
    for (int k = 0; k < 3; ++k) pose.translation[k] = S.scale * pose.translation[k] - shift[k];
  }
  return out;
}

class CompareStates : public testing::TestWithParam<int> {};

TEST_P(CompareStates, AlignmentUndoesASimilarity) {
  SceneOptions options;
  options.images = static_cast<std::uint64_t>(GetParam());
  options.points = 300;
  options.mean_track = 2;
  const Problem truth = generate(options).value().truth;
  Random random(3);
  const Similarity S = random_similarity(random);
  const Problem other = moved(truth, S);
  EXPECT_LT(evaluate(other).rms_px, 1e-6) << "the same pixels";
  const StateErrors errors = compare_states(other, truth, true).value();
  EXPECT_TRUE(errors.aligned);
  EXPECT_NEAR(errors.scale, 1 / S.scale, 1e-8 / S.scale);
  EXPECT_LT(errors.rotation_error_rad.max, 1e-7);
  EXPECT_LT(errors.translation_error.max, 1e-6);
  EXPECT_LT(errors.center_error.max, 1e-6);
  EXPECT_LT(errors.point_error.max, 1e-6);
  const StateErrors raw = compare_states(other, truth, false).value();
  EXPECT_FALSE(raw.aligned);
  EXPECT_EQ(raw.scale, 1);
  EXPECT_GT(raw.center_error.median, 0.1);
}

// Two centres determine no rotation: the points take over.
INSTANTIATE_TEST_SUITE_P(Images, CompareStates, testing::Values(2, 3, 20));

TEST(CompareStatesOnce, MeasuresKnownErrors) {
  SceneOptions options;
  const Problem truth = generate(options).value().truth;
  Problem off = truth;
  off.points[0] += 3;
  off.points[1] += 4;
  off.poses[2].translation[1] += 0.5;
  off.poses[5].rotation = multiply(quaternion_from_angle_axis<double>({0, 0, 0.25}),
                                   Quaternion<double>(off.poses[5].rotation));
  const StateErrors errors = compare_states(off, truth, false).value();
  EXPECT_NEAR(errors.point_error.max, 5, 1e-12);
  EXPECT_NEAR(errors.point_error.mean, 5.0 / 4000, 1e-12);
  EXPECT_NEAR(errors.rotation_error_rad.max, 0.25, 1e-12);
  EXPECT_NEAR(errors.translation_error.max, 0.5, 1e-12);
  EXPECT_NEAR(errors.center_error.median, 0, 1e-12);
}

TEST(CompareStatesOnce, RefusesOtherCounts) {
  SceneOptions options;
  const Problem truth = generate(options).value().truth;
  options.points = 100;
  const auto result = compare_states(generate(options).value().truth, truth, true);
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code(), ErrorCode::usage);
}

}  // namespace
}  // namespace sheaf
