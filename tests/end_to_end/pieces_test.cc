// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

class Pieces : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run({"generate", "in.txt", "--cameras", "12", "--points", "600"}).exit_code, 0);
    const Outcome cut = run({"split", "in.txt", "pieces", "--pieces", "3", "--json", "split.json"});
    ASSERT_EQ(cut.exit_code, 0) << cut.err;
  }
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  TemporaryFolder folder_;
};

TEST_F(Pieces, JoinedAgainAreTheScene) {
  const nlohmann::json split = json_of(folder_ / "split.json");
  ASSERT_EQ(split["pieces"].size(), 3u);
  double images = 0, observations = 0;
  for (const auto& piece : split["pieces"]) {
    images += piece["images"].get<double>();
    observations += piece["observations"].get<double>();
    EXPECT_TRUE(piece.contains("ghosts") && piece.contains("points"));
  }
  EXPECT_EQ(images, 12);
  EXPECT_EQ(observations, split["input"]["observations"].get<double>());
  EXPECT_GE(split["imbalance"].get<double>(), 1);
  const Outcome joined = run({"join", "in.txt", "pieces", "-o", "out.txt", "--json", "join.json"});
  ASSERT_EQ(joined.exit_code, 0) << joined.err;
  EXPECT_EQ(contents_of(folder_ / "out.txt"), contents_of(folder_ / "in.txt"));
  const nlohmann::json join = json_of(folder_ / "join.json");
  EXPECT_EQ(join["initial_cost"], join["final_cost"]);
  EXPECT_EQ(join["rms_px"]["before"], join["rms_px"]["after"]);
}

TEST_F(Pieces, OfAnotherSceneAreRefused) {
  ASSERT_EQ(
      run({"generate", "other.txt", "--cameras", "12", "--points", "600", "--seed", "2"}).exit_code,
      0);
  const Outcome joined = run({"join", "other.txt", "pieces", "-o", "out.txt"});
  EXPECT_EQ(joined.exit_code, 2) << joined.out;
  EXPECT_FALSE(fs::exists(folder_ / "out.txt"));
}

TEST_F(Pieces, ReplacePiecesAndNothingElse) {
  ASSERT_EQ(run({"split", "in.txt", "pieces", "--pieces", "2"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "pieces/piece-2.bin"));
  write_text(folder_ / "pieces/mine.txt", "keep");
  const Outcome refused = run({"split", "in.txt", "pieces", "--pieces", "4"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("found mine.txt"), std::string::npos) << refused.err;
  EXPECT_EQ(contents_of(folder_ / "pieces/mine.txt"), "keep");
}

#if defined(SHEAF_MPI_COMMAND)

class Ranks : public Pieces {
 protected:
  Outcome solve(int ranks, const std::string& out, const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {
        "OMP_NUM_THREADS=1",   "timeout",         "60",    SHEAF_MPIRUN,
        "--allow-run-as-root", "--oversubscribe", "-n",    std::to_string(ranks),
        SHEAF_MPI_COMMAND,     "solve",           "pieces"};
    if (!out.empty()) words.insert(words.end(), {"-o", out});
    words.insert(words.end(), more.begin(), more.end());
    return run_program("/usr/bin/env", words, folder_.path());
  }
  std::string bytes_of(const std::string& folder) {
    std::string all;
    for (int k = 0; k < 3; ++k)
      all += contents_of(folder_ / (folder + "/piece-" + std::to_string(k) + ".bin"));
    return all;
  }
};

TEST_F(Ranks, OfAnyNumberGiveTheSameBytesAndTheCostOfSolve) {
  const std::vector<std::string> options = {"--tolerance", "1e-12", "--loss", "huber:1"};
  std::vector<std::string> alone = {"solve", "in.txt", "--json", "solve.json"};
  alone.insert(alone.end(), options.begin(), options.end());
  ASSERT_EQ(run(alone).exit_code, 0);
  const double cost = json_of(folder_ / "solve.json")["final_cost"].get<double>();
  for (int ranks = 1; ranks <= 3; ++ranks) {
    const std::string out = "refined-" + std::to_string(ranks);
    std::vector<std::string> more = options;
    more.insert(more.end(), {"--threads", std::to_string(1 + ranks % 2), "--json", out + ".json"});
    const Outcome solved = solve(ranks, out, more);
    ASSERT_EQ(solved.exit_code, 0) << solved.err;
    const double found = json_of(folder_ / (out + ".json"))["final_cost"].get<double>();
    EXPECT_NEAR(found, cost, 1e-9 * cost);
    EXPECT_EQ(bytes_of(out), bytes_of("refined-1")) << ranks << " ranks";
  }
  ASSERT_EQ(run({"join", "in.txt", "refined-3", "-o", "joined.txt"}).exit_code, 0);
}

TEST_F(Ranks, EndTogetherWhereAPieceIsMissingOrThereAreTooMany) {
  const Outcome many = solve(4, "out");
  EXPECT_EQ(many.exit_code, 2);
  EXPECT_NE(many.err.find("no more ranks than pieces"), std::string::npos) << many.err;
  fs::remove(folder_ / "pieces/piece-2.bin");
  const Outcome missing = solve(2, "out");
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_NE(missing.err.find("piece-2.bin"), std::string::npos) << missing.err;
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

#endif

}  // namespace
}  // namespace sheaf
