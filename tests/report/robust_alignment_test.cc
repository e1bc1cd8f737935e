// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "platform/random.h"
#include "report/alignment.h"
#include "report/errors.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

using Places = std::vector<Vector3<double>>;

Vector3<double> normal3(Random& random, double scale) {
  const double x = random.normal(), y = random.normal(), z = random.normal();
  return {scale * x, scale * y, scale * z};
}

const Similarity kMove{2.5, quaternion_from_angle_axis<double>({0.4, -1.1, 0.7}), {5, -8, 3}};

// Noise of 0.01 on all, and gross errors on the first `wrong` of 100 places.
void make_places(int wrong, Places& from, Places& to) {
  Random random(11);
  for (int i = 0; i < 100; ++i) {
    from.push_back(normal3(random, 3));
    to.push_back(kMove(from.back()));
    const Vector3<double> noise = normal3(random, 0.01), gross = normal3(random, 40);
    for (int k = 0; k < 3; ++k) to.back()[k] += noise[k] + (i < wrong ? gross[k] + 30 : 0);
  }
}

// How far the right places end from where they should be.
double worst_of_the_right(const Similarity& S, int wrong, const Places& from) {
  double worst = 0;
  for (std::size_t i = wrong; i < from.size(); ++i) {
    const Vector3<double> a = S(from[i]), b = kMove(from[i]);
    worst = std::max(worst, std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]));
  }
  return worst;
}

class RobustAlignmentTest : public testing::TestWithParam<int> {};

TEST_P(RobustAlignmentTest, IsNotLedAstray) {
  Places from, to;
  make_places(GetParam(), from, to);
  const RobustAlignment robust = align_robustly(from, to);
  EXPECT_LT(worst_of_the_right(robust.alignment.similarity, GetParam(), from), 0.02);
  EXPECT_NEAR(robust.inliers, 100 - GetParam(), 2);
  if (GetParam() >= 10) {
    EXPECT_GT(worst_of_the_right(align(from, to).similarity, GetParam(), from), 1);
  }
}

INSTANTIATE_TEST_SUITE_P(Wrong, RobustAlignmentTest, testing::Values(0, 10, 30, 45));

TEST(RobustAlignment, KeepsAnExactMatch) {
  Places from, to;
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    from.push_back(normal3(random, 2));
    to.push_back(kMove(from.back()));
  }
  to[4][0] += 100;
  EXPECT_LT(worst_of_the_right(align_robustly(from, to).alignment.similarity, 5, from), 1e-11);
  EXPECT_EQ(align_robustly({}, {}).inliers, 0u);
}

TEST(WeightedAlign, CountsAPlaceOfWeightTwoTwice) {
  Places from, to;
  make_places(0, from, to);
  std::vector<double> weights(from.size(), 1);
  weights[7] = 2, weights[9] = 0;
  const Similarity weighted = align(from, to, weights).similarity;
  from.push_back(from[7]), to.push_back(to[7]);
  from.erase(from.begin() + 9), to.erase(to.begin() + 9);
  const Similarity repeated = align(from, to).similarity;
  EXPECT_NEAR(weighted.scale, repeated.scale, 1e-13);
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(weighted.translation[k], repeated.translation[k], 1e-12);
}

TEST(ListErrors, RobustAlignmentLeavesTheErrorWhereItIs) {
  SceneOptions options;
  options.images = 60;  // around the lake: fewer stand almost on a line, and points take over
  const Problem truth = generate(options).value().truth;
  Problem estimate = truth;
  for (std::size_t j = 0; j < 15; ++j) estimate.poses[j].translation[0] += 25;
  const ErrorLists plain = list_errors(estimate, truth, AlignBy::least_squares).value();
  const ErrorLists robust = list_errors(estimate, truth, AlignBy::robust).value();
  EXPECT_GT(statistics_of_errors(plain.point).median, 0.5);
  EXPECT_LT(statistics_of_errors(robust.point).max, 1e-6);
  EXPECT_NEAR(robust.center[0], 25, 1e-6);
  EXPECT_LT(robust.center[20], 1e-6);
  EXPECT_EQ(robust.alignment.inliers, 45u);
  EXPECT_EQ(robust.alignment.places, 60u);
  EXPECT_FALSE(robust.alignment.by_points);
}

}  // namespace
}  // namespace sheaf
