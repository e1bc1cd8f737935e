// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <numeric>
#include <string>
#include <vector>

#include "sheaf/io.h"
#include "sheaf/problem.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

std::vector<std::uint64_t> histogram_of(const std::vector<std::uint32_t>& ids, std::size_t size) {
  std::vector<std::uint64_t> counts(size, 0);
  for (const std::uint32_t id : ids) ++counts.at(id);
  return counts;
}

std::vector<std::vector<std::uint32_t>> tracks_of(const Problem& problem) {
  std::vector<std::vector<std::uint32_t>> tracks(problem.num_points());
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    tracks[problem.observation_point[i]].push_back(problem.observation_image[i]);
  return tracks;
}

// Points that each pair of images shares.
std::vector<std::uint32_t> shared_points(const Problem& problem) {
  const std::size_t n = problem.num_images();
  std::vector<std::uint32_t> shared(n * n, 0);
  for (const auto& track : tracks_of(problem))
    for (const std::uint32_t a : track)
      for (const std::uint32_t b : track) ++shared[a * n + b];
  return shared;
}

struct Shape {
  double mean = 0, two = 0, five = 0, ten = 0, longest = 0;  // tracks: P(= 2), P(>= 5), P(>= 10)
  double spread = 0;               // of observations per image: deviation over mean
  double density = 0, strong = 0;  // blocks of the reduced camera matrix; with 16 points or more
};

Shape shape_of(const Problem& problem) {
  Shape shape;
  const double points = static_cast<double>(problem.num_points());
  for (const std::uint64_t length : histogram_of(problem.observation_point, problem.num_points())) {
    shape.mean += static_cast<double>(length) / points;
    shape.two += (length == 2) / points;
    shape.five += (length >= 5) / points;
    shape.ten += (length >= 10) / points;
    shape.longest = std::max(shape.longest, static_cast<double>(length));
  }
  const double images = static_cast<double>(problem.num_images());
  const double mean = static_cast<double>(problem.num_observations()) / images;
  double square = 0;
  for (const std::uint64_t count : histogram_of(problem.observation_image, problem.num_images()))
    square += (static_cast<double>(count) - mean) * (static_cast<double>(count) - mean) / images;
  shape.spread = std::sqrt(square) / mean;
  for (const std::uint32_t shared : shared_points(problem)) {
    shape.density += (shared > 0) / (images * images);
    shape.strong += (shared >= 16) / (images * images);
  }
  return shape;
}

bool connected(const Problem& problem) {
  std::vector<std::uint32_t> parent(problem.num_images());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const auto& track : tracks_of(problem))
    for (const std::uint32_t image : track) parent[root(image)] = root(track[0]);
  for (std::uint32_t i = 0; i < parent.size(); ++i)
    if (root(i) != root(0)) return false;
  return true;
}

// FNV-1a over the numbers that a file states.
class HashSink : public SceneSink {
 public:
  void counts(std::uint64_t images, std::uint64_t points, std::uint64_t observations) override {
    add(images), add(points), add(observations);
  }
  void observation(std::uint32_t image, std::uint32_t point, double x_px, double y_px) override {
    add(std::uint64_t{image}), add(std::uint64_t{point}), add(x_px), add(y_px);
  }
  void image(const std::array<double, 3>& angle_axis, const std::array<double, 3>& translation,
             const std::array<double, 3>& intrinsics) override {
    for (const auto& numbers : {angle_axis, translation, intrinsics})
      for (const double x : numbers) add(x);
  }
  void point(const std::array<double, 3>& xyz) override {
    for (const double x : xyz) add(x);
  }
  std::uint64_t value = 0xcbf29ce484222325u;

 private:
  void add(std::uint64_t word) { value = (value ^ word) * 0x100000001b3u; }
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
};

std::uint64_t hash_of(const Problem& problem) {
  HashSink hash;
  hash.counts(problem.num_images(), problem.num_points(), problem.num_observations());
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    hash.observation(problem.observation_image[i], problem.observation_point[i],
                     problem.observation_xy[2 * i], problem.observation_xy[2 * i + 1]);
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    const double* a = &problem.bal_angle_axis[3 * j];
    const auto& k = problem.cameras[j].parameters;
    hash.image({a[0], a[1], a[2]}, problem.poses[j].translation, {k[0], k[1], k[2]});
  }
  for (std::size_t i = 0; i < problem.points.size(); i += 3)
    hash.point({problem.points[i], problem.points[i + 1], problem.points[i + 2]});
  return hash.value;
}

std::uint64_t streamed_hash(const FamilyOptions& options, SceneState state) {
  HashSink hash;
  EXPECT_TRUE(stream(options, state, hash).ok());
  return hash.value;
}

FamilyOptions small(SceneFamily family) {
  FamilyOptions options;
  options.family = family;
  options.images = 130;
  options.points = 5000;
  options.observations = 21000;
  return options;
}

TEST(Family, HasTheSameBitsOnEveryMachine) {
  EXPECT_EQ(streamed_hash(small(SceneFamily::street), SceneState::start), 6779479106411867742u);
  EXPECT_EQ(streamed_hash(small(SceneFamily::collection), SceneState::start),
            17791114014675846617u);
}

TEST(Family, StreamsWhatItGenerates) {
  for (const SceneFamily family : {SceneFamily::street, SceneFamily::collection}) {
    const FamilyOptions options = small(family);
    const Scene scene = generate(options).value();
    EXPECT_EQ(hash_of(scene.start), streamed_hash(options, SceneState::start));
    EXPECT_EQ(hash_of(scene.truth), streamed_hash(options, SceneState::truth));
    HashSink ignored;
    const StreamedScene streamed = stream(options, SceneState::start, ignored).value();
    const Evaluation evaluation = evaluate(scene.start);
    EXPECT_EQ(streamed.observations, scene.start.num_observations());
    EXPECT_NEAR(streamed.rms_px, evaluation.rms_px, 1e-6 * evaluation.rms_px);
    EXPECT_EQ(streamed.behind, evaluation.behind.size());
  }
}

TEST(Family, SeedsDiffer) {
  FamilyOptions options = small(SceneFamily::collection);
  const std::uint64_t first = streamed_hash(options, SceneState::start);
  options.seed = 2;
  EXPECT_NE(streamed_hash(options, SceneState::start), first);
}

class FamilySizes : public testing::TestWithParam<const char*> {};

TEST_P(FamilySizes, MeetsTheCountsAndIsConnected) {
  const FamilyOptions options = scene_like(GetParam()).value();
  const Problem truth = generate(options).value().truth;
  ASSERT_TRUE(validate(truth).ok());
  EXPECT_EQ(truth.num_images(), options.images);
  EXPECT_EQ(truth.num_points(), options.points);
  const double wanted = static_cast<double>(options.observations);
  EXPECT_NEAR(static_cast<double>(truth.num_observations()), wanted, 0.01 * wanted);
  const auto images = histogram_of(truth.observation_image, truth.num_images());
  EXPECT_GE(*std::min_element(images.begin(), images.end()), 8u);
  for (auto track : tracks_of(truth)) {
    ASSERT_GE(track.size(), 2u);
    ASSERT_TRUE(std::adjacent_find(track.begin(), track.end(), std::greater_equal<>()) ==
                track.end());
  }
  EXPECT_TRUE(connected(truth));
}

TEST_P(FamilySizes, StartIsRoughAndTruthIsExact) {
  FamilyOptions options = scene_like(GetParam()).value();
  Scene scene = generate(options).value();
  const Evaluation exact = evaluate(scene.truth);
  EXPECT_LT(exact.rms_px, 1e-7);
  EXPECT_TRUE(exact.behind.empty());
  scene.truth.observation_xy = scene.start.observation_xy;
  const double noise = evaluate(scene.truth).cost;
  const Evaluation start = evaluate(scene.start);
  EXPECT_TRUE(start.not_finite.empty());
  EXPECT_GT(start.rms_px, 5);
  EXPECT_LT(start.rms_px, 30);
  EXPECT_GT(start.cost, 10 * noise);
  EXPECT_LT(start.cost, 1000 * noise);
  EXPECT_LT(static_cast<double>(start.behind.size()),
            0.005 * static_cast<double>(options.observations));
}

INSTANTIATE_TEST_SUITE_P(Sizes, FamilySizes,
                         testing::Values("ladybug-49", "ladybug-138", "ladybug-372", "trafalgar-21",
                                         "trafalgar-257", "dubrovnik-16", "dubrovnik-88",
                                         "final-93"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), '-', 'x');
                           return name;
                         });

// The tolerances say how near the scenes come: tracks closely, the blocks roughly (real images of
// one place that look apart share nothing more often than these do).
class FamilyShape : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(FamilyShape, IsLikeTheRealOne) {
  const char* data = std::getenv("SHEAF_DATA");
  const std::filesystem::path path =
      std::filesystem::path(data != nullptr ? data : "data") / "bal" / GetParam().second;
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  const Shape real = shape_of(read(path).value());
  const Shape made = shape_of(generate(scene_like(GetParam().first).value()).value().start);
  EXPECT_NEAR(made.mean, real.mean, 0.01 * real.mean);
  EXPECT_NEAR(made.two, real.two, 0.1);
  EXPECT_NEAR(made.five, real.five, 0.04);
  EXPECT_NEAR(made.ten, real.ten, 0.02);
  EXPECT_GT(made.longest, 0.7 * real.longest);
  EXPECT_LT(made.longest, 1.5 * real.longest);
  EXPECT_NEAR(made.spread, real.spread, 0.1);
  EXPECT_NEAR(made.density, real.density, 0.2);
  EXPECT_NEAR(made.strong, real.strong, 0.12);
}

INSTANTIATE_TEST_SUITE_P(Real, FamilyShape,
                         testing::Values(std::pair{"dubrovnik-16", "dubrovnik-16-22106-pre.txt"},
                                         std::pair{"trafalgar-21", "trafalgar-21-11315-pre.txt"},
                                         std::pair{"ladybug-49", "ladybug-49-7776-pre.txt"}));

TEST(Family, LoopsTieAStreetTogether) {
  const Problem street = generate(scene_like("ladybug-372").value()).value().truth;
  std::uint64_t far = 0;
  for (const auto& track : tracks_of(street)) far += track.back() - track.front() > 200;
  EXPECT_GT(far, street.num_points() / 100);
  EXPECT_LT(far, street.num_points() / 5);
}

// As many as stay quick here: what goes wrong with millions shows with thousands.
TEST(Family, ManyImagesStayConnectedAndNear) {
  for (const SceneFamily family : {SceneFamily::street, SceneFamily::collection}) {
    FamilyOptions options;
    options.family = family;
    options.images = 12000;
    options.points = 120000;
    options.observations = 480000;
    const Problem start = generate(options).value().start;
    const auto images = histogram_of(start.observation_image, start.num_images());
    EXPECT_GE(*std::min_element(images.begin(), images.end()), 8u);
    EXPECT_TRUE(connected(start));
    EXPECT_LT(evaluate(start).rms_px, 30);
  }
}

TEST(Family, CollectionsHaveHubs) {
  const Problem problem = generate(scene_like("dubrovnik-253").value()).value().truth;
  const std::size_t n = problem.num_images();
  const std::vector<std::uint32_t> shared = shared_points(problem);
  std::vector<std::uint64_t> degrees(n, 0);
  for (std::size_t i = 0; i < n * n; ++i) degrees[i / n] += shared[i] > 0;
  std::sort(degrees.begin(), degrees.end());
  EXPECT_GT(degrees[n - 1 - n / 20], 2 * degrees[n / 20]);
}

TEST(Family, WithoutDriftTheStartIsTheTruth) {
  FamilyOptions options = small(SceneFamily::street);
  options.drift = 0;
  options.outliers = 0;
  options.pixel_noise_px = 0.6;
  const Scene scene = generate(options).value();
  EXPECT_EQ(scene.start.points, scene.truth.points);
  EXPECT_NEAR(evaluate(scene.start).rms_px, 0.6 * std::sqrt(2.0), 0.01);
}

TEST(Family, OutliersAreAsManyAsAskedFor) {
  FamilyOptions options = small(SceneFamily::collection);
  options.drift = 0;
  options.pixel_noise_px = 0;
  options.outliers = 0.05;
  const Scene scene = generate(options).value();
  const auto& a = scene.start.observation_xy;
  const auto& b = scene.truth.observation_xy;
  double wrong = 0;
  for (std::size_t i = 0; i < a.size(); i += 2) {
    const double size = std::hypot(a[i] - b[i], a[i + 1] - b[i + 1]);
    if (size == 0) continue;
    EXPECT_GE(size, 3.99);
    EXPECT_LE(size, 60.01);
    ++wrong;
  }
  EXPECT_NEAR(wrong / static_cast<double>(a.size() / 2), 0.05, 0.006);
}

TEST(Family, RefusesWhatCannotBeMet) {
  const auto message = [](const FamilyOptions& options) {
    const Result<Scene> result = generate(options);
    EXPECT_FALSE(result.ok());
    return result.ok() ? std::string() : std::string(result.error().what());
  };
  FamilyOptions options = small(SceneFamily::street);
  options.images = 3;
  EXPECT_NE(message(options).find("images"), std::string::npos);
  options = small(SceneFamily::street);
  options.observations = 5000;
  EXPECT_NE(message(options).find("mean track"), std::string::npos);
  options = small(SceneFamily::street);
  options.drift = std::nan("");
  EXPECT_NE(message(options).find("drift"), std::string::npos);
  ASSERT_FALSE(scene_like("rome-7").ok());
  EXPECT_NE(std::string(scene_like("rome-7").error().what()).find("ladybug-1723"),
            std::string::npos);
  EXPECT_EQ(scene_names().size(), 22u);
}

}  // namespace
}  // namespace sheaf
