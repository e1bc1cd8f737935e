// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/io.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

class PerturbCommand : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run({"generate", "s.txt", "--points", "400", "--truth", "in.txt"}).exit_code, 0);
  }
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  TemporaryFolder folder_;
};

TEST_F(PerturbCommand, WritesWhatTheLibraryMakesAtAnyNumberOfThreads) {
  const std::vector<std::string> options = {
      "--rotation", "0.01", "--translation",  "0.02", "--center",     "0.03",
      "--point",    "0.04", "--pixel",        "0.5",  "--intrinsics", "5,1e-3,2%",
      "--outliers", "0.1",  "--outlier-size", "30",   "--seed",       "9"};
  for (const std::string threads : {"1", "3"}) {
    std::vector<std::string> words = {"perturb", "in.txt", threads + ".txt", "--threads", threads};
    words.insert(words.end(), options.begin(), options.end());
    ASSERT_EQ(run(words).exit_code, 0);
  }
  NoiseOptions noise;
  noise.rotation_rad = 0.01;
  noise.translation = 0.02;
  noise.center = 0.03;
  noise.point = 0.04;
  noise.pixel_px = 0.5;
  noise.intrinsics = {5, 1e-3, 0};
  noise.intrinsics_relative = {0, 0, 0.02};
  noise.outliers = 0.1;
  noise.outlier_px = 30;
  noise.seed = 9;
  Problem problem = read(folder_ / "in.txt").value();
  ASSERT_TRUE(perturb(problem, noise).ok());
  ASSERT_TRUE(write(problem, folder_ / "library.txt").ok());
  const std::string expected = contents_of(folder_ / "library.txt");
  EXPECT_TRUE(contents_of(folder_ / "1.txt") == expected);
  EXPECT_TRUE(contents_of(folder_ / "3.txt") == expected);
}

TEST_F(PerturbCommand, WithoutNoiseTheFileComesBack) {
  ASSERT_EQ(run({"perturb", "in.txt", "o.txt"}).exit_code, 0);
  EXPECT_TRUE(contents_of(folder_ / "o.txt") == contents_of(folder_ / "in.txt"));
}

TEST_F(PerturbCommand, ProtocolsBringTheirOwnDefaults) {
  ASSERT_EQ(
      run({"perturb", "in.txt", "o.txt", "--protocol", "rootba", "--json", "j.json"}).exit_code, 0);
  nlohmann::json document = json_of(folder_ / "j.json");
  EXPECT_EQ(document["options"]["center"], 0.01);
  EXPECT_EQ(document["options"]["point"], 0.01);
  EXPECT_EQ(document["options"]["min_depth"], 0.1);
  EXPECT_EQ(document["options"]["seed"], 38401);
  EXPECT_EQ(document["options"]["normalize_to"], 100);
  EXPECT_GT(document["normalization"]["scale"], 1);
  ASSERT_EQ(run({"perturb", "in.txt", "o.txt", "--protocol", "rootba", "--normalize", "0", "--seed",
                 "3", "--json", "j.json"})
                .exit_code,
            0);
  document = json_of(folder_ / "j.json");
  EXPECT_EQ(document["options"]["seed"], 3);
  EXPECT_TRUE(document["normalization"].is_null());
}

TEST_F(PerturbCommand, TellsWhatItDid) {
  const Outcome outcome = run({"perturb", "in.txt", "o.txt", "--pixel", "2", "--json", "j.json"});
  ASSERT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.out.find("pixels 2 px; seed 1"), std::string::npos) << outcome.out;
  const nlohmann::json document = json_of(folder_ / "j.json");
  EXPECT_NEAR(document["rms_px"]["before"].get<double>(), 0, 1e-9);
  EXPECT_NEAR(document["rms_px"]["after"].get<double>(), 2 * std::sqrt(2.0), 0.15);
}

}  // namespace
}  // namespace sheaf
