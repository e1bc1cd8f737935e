// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "pieces/split_scene.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <set>

#include "sheaf/scene.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

struct Split {
  std::vector<ScenePiece> pieces;
  SplitSummary summary;
};

Problem scene_of(std::size_t images) {
  SceneOptions options;
  options.images = images;
  options.points = 60 * images;
  return generate(options).value().start;
}

/// All images share the first lens.
Problem with_one_lens(Problem problem) {
  problem.cameras.resize(1);
  std::fill(problem.image_camera.begin(), problem.image_camera.end(), 0u);
  return problem;
}

Split split(const Problem& problem, std::uint32_t pieces) {
  Split out;
  const std::vector<std::uint32_t> of_image = partition_images(problem, pieces).value();
  out.summary = split_scene(problem, of_image, pieces, [&](ScenePiece piece) -> Result<void> {
                  out.pieces.push_back(std::move(piece));
                  return {};
                }).value();
  return out;
}

TEST(SplitScene, EveryImagePointAndObservationHasOneOwner) {
  const Problem problem = scene_of(24);
  const Split cut = split(problem, 5);
  ASSERT_EQ(cut.pieces.size(), 5u);
  std::multiset<std::uint32_t> images, points;
  std::uint64_t observations = 0;
  for (const ScenePiece& p : cut.pieces) {
    EXPECT_TRUE(validate(p.problem).ok());
    EXPECT_GT(p.owned_images, 0u);
    images.insert(p.image.begin(), p.image.begin() + p.owned_images);
    points.insert(p.point.begin(), p.point.end());
    observations += p.problem.num_observations();
  }
  EXPECT_EQ(images.size(), problem.num_images());
  EXPECT_EQ(std::set<std::uint32_t>(images.begin(), images.end()).size(), problem.num_images());
  EXPECT_EQ(points.size(), problem.num_points());
  EXPECT_EQ(std::set<std::uint32_t>(points.begin(), points.end()).size(), problem.num_points());
  EXPECT_EQ(observations, problem.num_observations());
}

TEST(SplitScene, GhostsAreWhereTheirOwnersSay) {
  for (const Problem& problem : {scene_of(24), with_one_lens(scene_of(24))}) {
    const Split cut = split(problem, 4);
    for (const ScenePiece& p : cut.pieces) {
      for (std::size_t k = 0; k < p.ghost_images.size(); ++k) {
        const ScenePiece& owner = cut.pieces[p.ghost_images[k].piece];
        ASSERT_LT(p.ghost_images[k].index, owner.owned_images);
        EXPECT_EQ(owner.image[p.ghost_images[k].index], p.image[p.owned_images + k]);
      }
      for (std::size_t k = 0; k < p.ghost_cameras.size(); ++k) {
        const ScenePiece& owner = cut.pieces[p.ghost_cameras[k].piece];
        ASSERT_LT(p.ghost_cameras[k].index, owner.owned_cameras);
        EXPECT_EQ(owner.camera[p.ghost_cameras[k].index], p.camera[p.owned_cameras + k]);
      }
    }
  }
}

TEST(SplitScene, ALensThatIsSharedLooksSoInEveryPiece) {
  Problem problem = scene_of(12);
  problem.image_camera[11] = 0;  // far apart, in pieces of their own
  std::vector<std::uint32_t> of_image(12);
  for (std::uint32_t i = 0; i < 12; ++i) of_image[i] = i;
  const Result<SplitSummary> done =
      split_scene(problem, of_image, 12, [&](ScenePiece p) -> Result<void> {
        std::vector<int> uses(p.camera.size(), 0);
        for (const std::uint32_t c : p.problem.image_camera) ++uses[c];
        for (std::size_t c = 0; c < uses.size(); ++c)
          EXPECT_EQ(uses[c] > 1, p.camera[c] == 0) << "lens " << p.camera[c];
        return {};
      });
  EXPECT_TRUE(done.ok());
}

TEST(SplitScene, PointsBelongToWhereMostOfTheirImagesDo) {
  const Problem problem = scene_of(24);
  const std::vector<std::uint32_t> of_image = partition_images(problem, 3).value();
  std::vector<std::array<int, 3>> seen(problem.num_points());
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    ++seen[problem.observation_point[i]][of_image[problem.observation_image[i]]];
  for (const ScenePiece& p : split(problem, 3).pieces)
    for (const std::uint32_t point : p.point)
      EXPECT_EQ(seen[point][p.number], *std::max_element(seen[point].begin(), seen[point].end()));
}

TEST(SplitScene, IsAFunctionOfTheProblem) {
  const Problem problem = scene_of(30);
  EXPECT_EQ(partition_images(problem, 4).value(), partition_images(problem, 4).value());
  EXPECT_LT(split(problem, 4).summary.imbalance, 1.3);
}

TEST(SplitScene, RefusesWhatItCannotCut) {
  const Problem problem = scene_of(8);
  EXPECT_EQ(partition_images(problem, 0).error().code(), ErrorCode::usage);
  EXPECT_EQ(partition_images(problem, 9).error().code(), ErrorCode::usage);
  Problem with_terms = problem;
  with_terms.terms.kept_points.push_back(0);
  const auto take = [](ScenePiece) -> Result<void> { return {}; };
  const std::vector<std::uint32_t> of_image(8, 0);
  EXPECT_EQ(split_scene(with_terms, of_image, 1, take).error().code(), ErrorCode::usage);
}

class PieceFiles : public testing::Test {
 protected:
  void SetUp() override {
    folder_ =
        fs::temp_directory_path() / ("sheaf-pieces-" + std::to_string(::getpid()) + "-" +
                                     testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    problem_ = scene_of(10);
    cut_ = split(problem_, 3);
    for (const ScenePiece& p : cut_.pieces) ASSERT_TRUE(write_piece(p, folder_).ok());
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
  Problem problem_;
  Split cut_;
};

TEST_F(PieceFiles, AreReadAsTheyWereWritten) {
  EXPECT_EQ(count_pieces(folder_).value(), 3u);
  for (const ScenePiece& p : cut_.pieces) {
    const ScenePiece again = read_piece(folder_, p.number).value();
    EXPECT_EQ(state_hash(again.problem), state_hash(p.problem));
    EXPECT_EQ(again.problem.observation_xy, p.problem.observation_xy);
    EXPECT_EQ(again.image, p.image);
    EXPECT_EQ(again.point, p.point);
    EXPECT_EQ(again.scene, digest_of_scene(problem_));
  }
}

TEST_F(PieceFiles, PutTheirStatesBackIntoTheScene) {
  Problem moved = problem_;
  for (const ScenePiece& p : cut_.pieces) {
    ScenePiece other = p;
    for (auto& pose : other.problem.poses) pose.translation[0] += 1;
    for (double& x : other.problem.points) x += 2;
    ASSERT_TRUE(join_piece(other, moved).ok());
  }
  for (std::size_t i = 0; i < problem_.num_images(); ++i)
    EXPECT_EQ(moved.poses[i].translation[0], problem_.poses[i].translation[0] + 1);
  for (std::size_t k = 0; k < problem_.points.size(); ++k)
    EXPECT_EQ(moved.points[k], problem_.points[k] + 2);
  Problem foreign = scene_of(9);
  EXPECT_EQ(join_piece(cut_.pieces[0], foreign).error().code(), ErrorCode::usage);
}

TEST_F(PieceFiles, ThatAreMissingCutOffDamagedOrForeignAreRefusedByName) {
  const fs::path path = piece_path(folder_, 1);
  const auto refusal = [&] {
    const Result<ScenePiece> read = read_piece(folder_, 1);
    EXPECT_FALSE(read.ok());
    EXPECT_EQ(read.error().code(), ErrorCode::unreadable_input);
    const std::string what = read.error().what();
    EXPECT_NE(what.find("piece-1.bin"), std::string::npos) << what;
    return what;
  };
  fs::resize_file(path, fs::file_size(path) - 100);
  EXPECT_NE(refusal().find("damaged"), std::string::npos);
  ASSERT_TRUE(write_piece(cut_.pieces[1], folder_).ok());
  std::fstream(path, std::ios::in | std::ios::out | std::ios::binary).seekp(200).put('\x7f');
  EXPECT_NE(refusal().find("damaged"), std::string::npos);
  fs::copy_file(piece_path(folder_, 0), path, fs::copy_options::overwrite_existing);
  EXPECT_NE(refusal().find("found piece 0"), std::string::npos);
  fs::remove(path);
  refusal();
}

}  // namespace
}  // namespace sheaf
