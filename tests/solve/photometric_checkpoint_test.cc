// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Photometric runs that are stopped at any step, written down and gone on with: the state, the
// costs and the words of the run that was never stopped, bit for bit.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include "sheaf/sheaf.h"

namespace sheaf {
namespace {

class PhotometricCheckpoints : public testing::Test {
 protected:
  PhotometricCheckpoints() { std::filesystem::create_directories(folder_); }
  ~PhotometricCheckpoints() override { std::filesystem::remove_all(folder_); }
  std::string path() const { return folder_ / "checkpoint"; }

  /// Stopped after step `at` of the uninterrupted run; false where that has ended by then.
  bool stop_after(const PhotometricProblem& start, PhotometricOptions options, int at) {
    PhotometricProblem p = start;
    std::filesystem::remove(path());
    options.checkpoint = path();
    options.checkpoint_every_s = 0;
    options.on_iteration = [at](const Iteration& it) { return it.index < at; };
    return refine_photometric(p, options).value().solve.termination == Termination::stopped &&
           std::filesystem::exists(path());
  }

  void expect_same_ends(const PhotometricProblem& start, PhotometricOptions options,
                        const char* what) {
    SCOPED_TRACE(what);
    options.threads = 2;
    PhotometricProblem whole = start;
    const PhotometricSummary expected = refine_photometric(whole, options).value();
    int stopped = 0;
    for (int at = 1; at < static_cast<int>(expected.solve.iterations.size()); at += 1 + at / 2) {
      if (!stop_after(start, options, at)) continue;
      ++stopped;
      SCOPED_TRACE(at);
      PhotometricProblem parts = start;
      PhotometricOptions again = options;
      again.resume = path();
      again.threads = 1 + at % 2;
      const Result<PhotometricSummary> got = refine_photometric(parts, again);
      ASSERT_TRUE(got.ok()) << got.error().what();
      EXPECT_LT(got.value().solve.resumed_after, at);
      expect_same(whole, parts);
      expect_same(expected, got.value());
    }
    EXPECT_GT(stopped, 2);
  }

 private:
  static void expect_same(const PhotometricProblem& a, const PhotometricProblem& b) {
    EXPECT_EQ(a.points, b.points);
    for (std::size_t i = 0; i < a.poses.size(); ++i) {
      EXPECT_EQ(a.poses[i].rotation, b.poses[i].rotation) << i;
      EXPECT_EQ(a.poses[i].translation, b.poses[i].translation) << i;
      EXPECT_EQ(a.brightness[i].a, b.brightness[i].a) << i;
      EXPECT_EQ(a.brightness[i].b, b.brightness[i].b) << i;
    }
  }
  static void expect_same(const PhotometricSummary& a, const PhotometricSummary& b) {
    const std::vector<Iteration>&x = a.solve.iterations, &y = b.solve.iterations;
    ASSERT_EQ(x.size(), y.size());
    for (std::size_t k = 0; k < x.size(); ++k) {
      EXPECT_EQ(x[k].cost, y[k].cost) << k;
      EXPECT_EQ(x[k].damping, y[k].damping) << k;
      EXPECT_EQ(x[k].round, y[k].round) << k;
      EXPECT_EQ(x[k].linear_iterations, y[k].linear_iterations) << k;
    }
    ASSERT_EQ(a.solve.rounds.size(), b.solve.rounds.size());
    for (std::size_t k = 0; k < a.solve.rounds.size(); ++k) {
      EXPECT_EQ(a.solve.rounds[k].scale_px, b.solve.rounds[k].scale_px) << k;
      EXPECT_EQ(a.solve.rounds[k].steps, b.solve.rounds[k].steps) << k;
      EXPECT_EQ(a.solve.rounds[k].initial_cost, b.solve.rounds[k].initial_cost) << k;
    }
    EXPECT_EQ(a.solve.words, b.solve.words);
    EXPECT_EQ(a.solve.solver, b.solve.solver);
    EXPECT_EQ(a.solve.initial_cost, b.solve.initial_cost);
    EXPECT_EQ(a.solve.final_cost, b.solve.final_cost);
    EXPECT_EQ(a.patches_visible, b.patches_visible);
    EXPECT_EQ(a.patches_left, b.patches_left);
    EXPECT_EQ(a.initial_rms_grey, b.initial_rms_grey);
    EXPECT_EQ(a.final_rms_grey, b.final_rms_grey);
    EXPECT_EQ(a.anchor_sigma_grey, b.anchor_sigma_grey);
    EXPECT_EQ(a.final_rms_px, b.final_rms_px);
  }

  const std::filesystem::path folder_ = std::filesystem::temp_directory_path() /
                                        ("sheaf-patch-checkpoints-" + std::to_string(::getpid()));
};

PhotometricProblem hillside(double start_px = 2, double measured_px = -1) {
  PhotometricSceneOptions options;
  options.images = 4;
  options.points = 100;
  options.width = 160;
  options.height = 120;
  options.brightness = 0.1;
  options.noise_grey = 1;
  options.outliers = 0.05;
  options.start_px = start_px;
  options.measured_px = measured_px;
  return generate(options).value().start;
}

TEST_F(PhotometricCheckpoints, EveryLevelRoundAndSolverEndsAsIfNothingHadHappened) {
  PhotometricOptions options;
  options.levels = 3;
  options.loss = {LossKind::huber, kAutomaticScale};
  options.min_zncc = 0.2;
  expect_same_ends(hillside(), options, "a pyramid, a dense factor");
  options.solver = CameraSolverKind::iterative_explicit;
  options.levels = 2;
  expect_same_ends(hillside(), options, "conjugate gradients");
  options.solver = CameraSolverKind::automatic;
  options.loss = {LossKind::cauchy, 8};
  options.loss_per_patch = true;
  options.affine_brightness = false;
  options.leaving = Leaving::free;
  expect_same_ends(hillside(), options, "patches that leave cost nothing");
}

TEST_F(PhotometricCheckpoints, SoDoAnchorsAndStoredPatches) {
  PhotometricOptions options;
  options.anchor_px = 0.5;
  options.loss = {LossKind::huber, kAutomaticScale};
  expect_same_ends(hillside(1, 0.3), options, "measured positions");
  PhotometricProblem stored = hillside(0.7);
  stored.patch = make_pattern("4x4").value();
  stored.patches.clear();
  for (std::size_t i = 0; i < stored.num_points(); ++i) {
    const GreyImage& image = stored.images[stored.host[i]];
    for (std::size_t k = 0; k < stored.patch.size(); ++k) {
      const int x = static_cast<int>(stored.host_xy[2 * i]) + stored.patch.dx[k];
      const int y = static_cast<int>(stored.host_xy[2 * i + 1]) + stored.patch.dy[k];
      stored.patches.push_back(image.pixels[std::size_t(y * image.width + x)]);
    }
  }
  options.anchor_px = PhotometricOptions{}.anchor_px;
  options.parametrisation = Parametrisation::xyz;
  options.warp = Warp::translation;
  expect_same_ends(stored, options, "points as X, Y, Z");
}

TEST_F(PhotometricCheckpoints, OtherImagesOptionsAndKindsOfRunsAreRefusedByName) {
  const PhotometricProblem problem = hillside();
  PhotometricOptions options;
  ASSERT_TRUE(stop_after(problem, options, 2));
  options.resume = path();
  const auto words = [&](PhotometricProblem p, const PhotometricOptions& o) {
    const Result<PhotometricSummary> s = refine_photometric(p, o);
    return s.ok() ? std::string("resumed") : std::string(s.error().what());
  };
  EXPECT_EQ(words(problem, options), "resumed");
  PhotometricProblem other = problem;
  other.images[1].pixels[700] += 1;
  EXPECT_NE(words(other, options).find("of another problem"), std::string::npos);
  PhotometricOptions smaller = options;
  smaller.pattern = "3x3";
  EXPECT_NE(words(problem, smaller).find("--pattern 4x4, this one has 3x3"), std::string::npos)
      << words(problem, smaller);
  SceneOptions lakeside;
  lakeside.images = 6;
  Problem cameras = generate(lakeside).value().start;
  SolveOptions solving;
  solving.resume = path();
  EXPECT_NE(std::string(try_solve(cameras, solving).error().what())
                .find("found no checkpoint of a solve"),
            std::string::npos);
  std::filesystem::resize_file(path(), std::filesystem::file_size(path()) - 3);
  EXPECT_NE(words(problem, options).find("damaged"), std::string::npos);
}

}  // namespace
}  // namespace sheaf
