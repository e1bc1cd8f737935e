// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "inspect/clean.h"
#include "io/colmap.h"
#include "io/models.h"
#include "sheaf/io.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

using namespace test;

/// A good problem: exact but for a little noise, so that a residual has an ordinary size.
Problem good() {
  Problem p = seen_by({{CameraModel::radial, {500, 320, 240, 0.01, 0}, 640, 480},
                       {CameraModel::opencv, {600, 610, 320, 240, 0, 0, 0, 0}, 640, 480}},
                      6, 40, 1);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> noise(-0.5, 0.5);
  for (double& x : p.observation_xy) x += noise(random);
  return p;
}

std::set<std::string> codes(const Problem& problem) {
  std::set<std::string> out;
  for (const Finding& finding : check(problem)) {
    out.insert(finding.code);
    EXPECT_FALSE(finding.words.empty());
    EXPECT_GT(finding.count, 0u);
  }
  return out;
}

Finding only(const Problem& problem, const std::string& code) {
  for (const Finding& finding : check(problem))
    if (finding.code == code) return finding;
  ADD_FAILURE() << "no " << code;
  return {};
}

TEST(Check, FindsNothingWrongWithAGoodProblem) {
  EXPECT_TRUE(check(good()).empty());
  SceneOptions options;
  options.points = 500;
  for (const Finding& finding : check(generate(options).value().truth))
    EXPECT_FALSE(finding.grave) << finding.words;
}

TEST(Check, FindsTheSameWithAnyNumberOfThreads) {
  Problem p = good();
  for (std::size_t i = 0; i < 40; i += 3) p.observation_xy[2 * i] += 300;
  p.add_observation(p.observation_image[7], p.observation_point[7], 11, 12);
  p.add_point(0, 0, -3);
  p.add_observation(0, static_cast<std::uint32_t>(p.num_points() - 1), 1e7, 5);
  const std::vector<Finding> one = check(p, 1), several = check(p, 5);
  ASSERT_GT(one.size(), 3u);
  ASSERT_EQ(several.size(), one.size());
  for (std::size_t k = 0; k < one.size(); ++k) {
    EXPECT_EQ(several[k].code, one[k].code);
    EXPECT_EQ(several[k].first, one[k].first);
    EXPECT_EQ(several[k].words, one[k].words);
  }
}

TEST(Check, FindsPartsThatNothingJoins) {
  Problem p = good();
  const std::size_t observations = p.num_observations();
  for (std::size_t i = 0; i < 20; ++i)
    p.add_point(p.points[3 * i], p.points[3 * i + 1], p.points[3 * i + 2]);
  // The first image sees points of its own now, as does a seventh that looks from beside it.
  p.poses.push_back(p.poses[1]), p.image_camera.push_back(p.image_camera[1]);
  for (std::size_t i = 0; i < observations; ++i)
    if (p.observation_image[i] == 1) {
      const std::uint32_t point = p.observation_point[i];
      if (point >= 20) continue;
      p.add_observation(6, 40 + point, p.observation_xy[2 * i], p.observation_xy[2 * i + 1]);
    }
  const Finding finding = only(p, "parts");
  EXPECT_EQ(finding.count, 1u);
  EXPECT_EQ(finding.first, (std::vector<std::uint64_t>{6}));
  EXPECT_TRUE(finding.grave);
  EXPECT_EQ(only(p, "lone-points").count, 20u);
}

TEST(Check, FindsWeakAndBlindImagesAndLonePoints) {
  Problem p = good();
  p.add_image(p.poses[0], 0u);
  p.add_image(p.poses[1], 1u);
  for (std::uint32_t i = 0; i < 9; ++i)
    p.add_observation(7, i, p.observation_xy[2 * (40 + i)], p.observation_xy[2 * (40 + i) + 1]);
  p.add_point(0, 0, 0);
  const std::uint32_t lone = p.add_point(0.1, 0, 0);
  p.add_observation(0, lone, 320, 240);
  EXPECT_EQ(only(p, "blind-images").first, (std::vector<std::uint64_t>{6}));
  EXPECT_EQ(only(p, "weak-images").first, (std::vector<std::uint64_t>{7}));
  EXPECT_EQ(only(p, "lone-points").first, (std::vector<std::uint64_t>{40, 41}));
}

TEST(Check, FindsTooFewMeasurements) {
  Problem p = seen_by({Camera{}}, 2, 5, 1);
  p.cameras[0].parameters = {500};
  EXPECT_TRUE(codes(p).contains("rank"));  // 20 for 12 + 15 + 3 - 7
  EXPECT_FALSE(codes(seen_by({Camera{CameraModel::bal, {500}}}, 2, 40, 1)).contains("rank"));
}

TEST(Check, FindsWhatOccursTwice) {
  Problem p = good();
  p.add_observation(p.observation_image[3], p.observation_point[3], p.observation_xy[6],
                    p.observation_xy[7]);
  p.add_observation(p.observation_image[5], p.observation_point[5], p.observation_xy[10] + 1,
                    p.observation_xy[11]);
  EXPECT_EQ(only(p, "repeated-observations").first, (std::vector<std::uint64_t>{240}));
  EXPECT_EQ(only(p, "two-pixels").first, (std::vector<std::uint64_t>{241}));
  EXPECT_EQ(clean(p, {.repeated = true}).repeated, (std::vector<std::uint64_t>{240}));
  EXPECT_EQ(p.num_observations(), 241u);
}

TEST(Check, FindsPointsBehindNarrowRaysAbsurdFocalsAndOutliers) {
  Problem p = good();
  for (std::size_t k = 0; k < 3; ++k) p.points[k] *= 1000;  // far behind some, far away for all
  p.observation_xy[2 * 7] += 300;
  p.cameras[1].parameters[0] = -600;
  const auto found = codes(p);
  EXPECT_TRUE(found.contains("absurd-focal"));
  EXPECT_EQ(only(p, "absurd-focal").first, (std::vector<std::uint64_t>{1}));
  Problem q = good();
  q.observation_xy[2 * 7] += 300;
  q.points[0] = 1, q.points[1] = 2, q.points[2] = -900;
  EXPECT_EQ(only(q, "behind-camera").count, 6u);
  const Finding far = only(q, "far-off");
  EXPECT_FALSE(far.grave);
  EXPECT_NE(std::find(far.first.begin(), far.first.end(), 7u), far.first.end());
  q.points[2] = 900;
  EXPECT_EQ(only(q, "narrow-points").first, (std::vector<std::uint64_t>{0}));
}

TEST(Clean, LeavesOutByErrorDepthAngleAndTrack) {
  Problem p = good();
  p.observation_xy[2 * 45] += 50;  // image 1, point 5
  const auto at = [&](std::uint32_t point, std::array<double, 3> X) {
    std::copy(X.begin(), X.end(), p.points.begin() + 3 * point);
  };
  at(7, {0, 0, -900});  // behind all
  Problem cleaned = p;
  const CleanRecord record = clean(cleaned, {.max_error_px = 10, .behind = true, .min_track = 2});
  EXPECT_NE(std::find(record.far_off.begin(), record.far_off.end(), 45u), record.far_off.end());
  EXPECT_EQ(record.behind.size(), 6u);
  EXPECT_EQ(record.short_tracks, (std::vector<std::uint64_t>{7}));
  EXPECT_EQ(cleaned.num_points(), 39u);
  EXPECT_EQ(cleaned.num_observations(), 240u - 7);
  EXPECT_EQ(record.observations, 7u);
  EXPECT_LT(evaluate(cleaned).rms_px, 1);
  EXPECT_EQ(cleaned.points[3 * 7], p.points[3 * 8]);

  p = good();
  at(3, {20, 30, 4000});
  cleaned = p;
  EXPECT_EQ(clean(cleaned, {.min_angle_deg = 0.5}).narrow, (std::vector<std::uint64_t>{3}));
  EXPECT_EQ(cleaned.num_observations(), 234u);
  cleaned = p;
  EXPECT_EQ(clean(cleaned, {}).observations, 0u);
  EXPECT_TRUE(same_state(cleaned, p));
}

/// Where the file names one observation without a pixel, the check does, under one code and no
/// other, and says what helps.
TEST(Check, FindsPointsInPlanesAndAtCentres) {
  const struct {
    const char *file, *code;
    std::uint64_t observation;
  } cases[] = {{"z-zero", "camera-plane", 176},
               {"point-at-centre", "camera-centre", 15},
               {"point-at-origin", "camera-centre", 0}};
  for (const auto& [file, code, observation] : cases) {
    const Problem p = read(std::string("tests/data/") + file + ".txt").value();
    for (const Finding& finding : check(p)) {
      const bool names =
          std::find(finding.first.begin(), finding.first.end(), observation) != finding.first.end();
      EXPECT_EQ(names && finding.of == "observations", finding.code == code) << finding.words;
    }
    const Finding finding = only(p, code);
    EXPECT_EQ(finding.first, (std::vector<std::uint64_t>{observation}));
    EXPECT_TRUE(finding.grave);
    EXPECT_NE(finding.words.find("--drop-behind"), std::string::npos);
    EXPECT_NE(finding.words.find("--cheirality hold-out"), std::string::npos);
    Problem cleaned = p;
    clean(cleaned, {.behind = true});
    EXPECT_FALSE(codes(cleaned).contains(code));
  }
}

TEST(Check, FindsAbsurdMeasurements) {
  for (const double x : {1e100, -1e100, 1e200, 2000.0}) {
    Problem p = good();
    p.observation_xy[2 * 100] = x;
    EXPECT_EQ(only(p, "absurd-measurements").first, (std::vector<std::uint64_t>{100})) << x;
    EXPECT_EQ(codes(p), (std::set<std::string>{"absurd-measurements"}));
    clean(p, {.max_error_px = 100});
    EXPECT_TRUE(codes(p).empty());
  }
  Problem inside = good();
  inside.observation_xy[2 * 100] = 1000;  // wrong, but not absurd
  EXPECT_EQ(codes(inside), (std::set<std::string>{"far-off"}));
}

/// Behind, in the plane and at the centre: each observation is counted once.
TEST(Clean, LeavesOutWhatHasNoPixel) {
  Problem p = read("tests/data/z-zero.txt").value();
  CleanRecord record = clean(p, {.behind = true});
  EXPECT_EQ(record.in_plane, (std::vector<std::uint64_t>{176}));
  EXPECT_TRUE(record.behind.empty() && record.at_centre.empty());
  EXPECT_EQ(p.num_observations(), 176u);
  EXPECT_TRUE(evaluate(p).not_finite.empty());

  p = read("tests/data/point-at-centre.txt").value();
  record = clean(p, {.behind = true});
  EXPECT_EQ(record.at_centre, (std::vector<std::uint64_t>{15}));
  EXPECT_EQ(record.behind, (std::vector<std::uint64_t>{14}));
  EXPECT_EQ(record.observations, 2u);

  p = good();
  p.points[0] = 1e3, p.points[1] = 0, p.points[2] = -900;  // behind all
  for (std::size_t k = 0; k < 3; ++k) p.points[3 + k] = 0;
  p.poses[2].translation = {0, 0, 0};  // at point 1, and no other's plane
  record = clean(p, {.behind = true, .min_track = 2});
  EXPECT_EQ(record.at_centre, (std::vector<std::uint64_t>{81}));
  EXPECT_TRUE(record.in_plane.empty());
  EXPECT_FALSE(std::count(record.behind.begin(), record.behind.end(), 81u));
  EXPECT_EQ(p.num_observations() + record.observations, 240u);
  EXPECT_EQ(clean(p, {.behind = true}).observations, 0u);
}

/// Two images 90 degrees apart as a point sees them.
TEST(Clean, MeasuresTheAngleOfRays) {
  Problem p;
  p.add_image({{1, 0, 0, 0}, {-1, 0, 0}}, Camera{});  // centre (1, 0, 0)
  p.add_image({{1, 0, 0, 0}, {0, -1, 0}}, 0u);        // centre (0, 1, 0)
  p.add_point(0, 0, 0);
  p.add_observation(0, 0, 0, 0);
  p.add_observation(1, 0, 0, 0);
  EXPECT_NEAR(ray_angles_deg(p, {true, true})[0], 90, 1e-12);
  EXPECT_EQ(ray_angles_deg(p, {true, false})[0], 0);
}

/// What is left out of a COLMAP model: features stay, tracks lose them, ids stay with their points.
TEST(Clean, KeepsTheMetadataOfWhatIsLeft) {
  Problem p = parse_colmap(tiny_binary()).value();
  clean(p, {.min_track = 2});
  EXPECT_EQ(p.metadata->point_ids, (std::vector<std::uint64_t>{41}));
  const Problem again = parse_colmap(format_colmap(p, false).value()).value();
  EXPECT_EQ(again.num_observations(), 2u);
  EXPECT_EQ(again.metadata->feature_xy.size(), 10u);
  EXPECT_EQ(again.metadata->image_names, p.metadata->image_names);
  const Problem text = parse_colmap(tiny_text()).value();
  Problem cut = text;
  clean(cut, {.min_track = 2});
  EXPECT_TRUE(same_state(parse_colmap(format_colmap(cut, true).value()).value(), cut));
}

}  // namespace
}  // namespace sheaf
