// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/io.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

class GenerateLike : public testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  TemporaryFolder folder_;
};

TEST_F(GenerateLike, StreamsTheFileThatTheLibraryWrites) {
  const Outcome outcome = run({"generate", "s.txt", "--like", "ladybug-49", "--truth", "t.txt.gz",
                               "--seed", "3", "--json", "s.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  FamilyOptions options = scene_like("ladybug-49").value();
  options.seed = 3;
  const Scene scene = generate(options).value();
  ASSERT_TRUE(write(scene.start, folder_ / "s2.txt").ok());
  ASSERT_TRUE(write(scene.truth, folder_ / "t2.txt.gz").ok());
  EXPECT_TRUE(contents_of(folder_ / "s.txt") == contents_of(folder_ / "s2.txt"));
  EXPECT_TRUE(contents_of(folder_ / "t.txt.gz") == contents_of(folder_ / "t2.txt.gz"));

  const nlohmann::json made = json_of(folder_ / "s.json");
  EXPECT_EQ(made["options"]["like"], "ladybug-49");
  EXPECT_EQ(made["options"]["family"], "street");
  ASSERT_EQ(run({"info", "s.txt", "--json", "i.json"}).exit_code, 0);
  const nlohmann::json info = json_of(folder_ / "i.json");
  for (const char* key : {"track", "observations_per_image", "focal_px"})
    EXPECT_EQ(made[key], info[key]) << key;
  EXPECT_EQ(made["observations"], info["input"]["observations"]);
  EXPECT_NEAR(made["rms_px"].get<double>(), info["rms_px"].get<double>(), 1e-6);
}

TEST_F(GenerateLike, HasTheSameKeysAsALakeside) {
  ASSERT_EQ(run({"generate", "a.txt", "--json", "a.json", "--points", "300"}).exit_code, 0);
  ASSERT_EQ(run({"generate", "b.txt", "--json", "b.json", "--family", "collection", "--cameras",
                 "20", "--points", "900", "--drift", "0.5", "--outliers", "0.01"})
                .exit_code,
            0);
  nlohmann::json a = json_of(folder_ / "a.json"), b = json_of(folder_ / "b.json");
  for (nlohmann::json* document : {&a, &b})
    for (auto& [key, value] : (*document)["options"].items()) value = nullptr;
  EXPECT_EQ(a["options"], b["options"]);
  for (const auto& [key, ignored] : a.items()) EXPECT_TRUE(b.contains(key)) << key;
  EXPECT_EQ(a.size(), b.size());
}

TEST_F(GenerateLike, SolvesToTheNoise) {
  for (const std::string name : {"ladybug-49", "trafalgar-21"}) {
    ASSERT_EQ(run({"generate", "s.txt", "--like", name}).exit_code, 0);
    ASSERT_EQ(run({"solve", "s.txt", "--json", "s.json"}).exit_code, 0);
    const nlohmann::json solved = json_of(folder_ / "s.json");
    const double before = solved["initial_cost"], after = solved["final_cost"];
    EXPECT_GT(before, 10 * after) << name;
    EXPECT_LT(before, 1000 * after) << name;
    EXPECT_LT(solved["rms_px"]["after"].get<double>(), 1.2) << name;
  }
}

TEST_F(GenerateLike, WritesAPointCloud) {
  ASSERT_EQ(run({"generate", "s.ply", "--like", "ladybug-49"}).exit_code, 0);
  EXPECT_EQ(contents_of(folder_ / "s.ply").rfind("ply", 0), 0u);
}

TEST_F(GenerateLike, RefusesWhatDoesNotGoTogether) {
  EXPECT_EQ(run({"generate", "s.txt", "--like", "rome-7"}).exit_code, 2);
  EXPECT_EQ(run({"generate", "s.txt", "--family", "village"}).exit_code, 2);
  EXPECT_EQ(run({"generate", "s.txt", "--like", "ladybug-49", "--points", "9"}).exit_code, 2);
  EXPECT_EQ(run({"generate", "s.txt", "--like", "ladybug-49", "--point-noise", "1"}).exit_code, 2);
}

}  // namespace
}  // namespace sheaf
