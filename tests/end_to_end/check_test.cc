// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using nlohmann::json;

/// What `check` finds in a file, and what `convert` leaves out of it.
class CheckCommand : public testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  static std::string data(const std::string& name) {
    return std::filesystem::absolute("tests/data/" + name);
  }
  json document() { return json_of(folder_ / "o.json"); }
  TemporaryFolder folder_;
};

bool says(const Outcome& outcome, const std::string& words) {
  return outcome.out.find(words) != std::string::npos;
}

TEST_F(CheckCommand, NamesObservationImageAndPoint) {
  const Outcome outcome = run({"check", data("z-zero.txt"), "--json", "o.json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(says(outcome, "in the plane of its camera (Z = 0)")) << outcome.out;
  EXPECT_TRUE(says(outcome, "observations 176 (image 5, point 2)\n")) << outcome.out;
  const json findings = document()["findings"];
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0]["code"], "camera-plane");
  EXPECT_EQ(findings[0]["first"], json({176}));
  EXPECT_EQ(findings[0]["images"], json({5}));
  EXPECT_EQ(findings[0]["points"], json({2}));
}

TEST_F(CheckCommand, NamesLensesWithoutImagesAndPoints) {
  Problem problem = read(data("khuge_1.txt")).value();
  problem.cameras[0].parameters[0] = 0;
  write(problem, folder_ / "in.txt").value();
  const Outcome outcome = run({"check", "in.txt", "--json", "o.json"});
  EXPECT_TRUE(says(outcome, "            lenses 0\n")) << outcome.out;
  const json findings = document()["findings"];
  const auto found = std::find_if(findings.begin(), findings.end(), [](const json& finding) {
    return finding["code"] == "absurd-focal";
  });
  ASSERT_NE(found, findings.end());
  const json& finding = *found;
  EXPECT_EQ(finding["first"], json::array({0}));
  EXPECT_TRUE(finding["images"].empty() && finding["points"].empty());
}

TEST_F(CheckCommand, ConvertDropsWhatHasNoPixel) {
  const Outcome outcome =
      run({"convert", data("z-zero.txt"), "clean.txt", "--drop-behind", "--json", "o.json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(says(outcome, "left out    1 observations: 0 far off, 0 behind, 1 in the plane"))
      << outcome.out;
  const json cleaned = document()["cleaned"];
  EXPECT_EQ(cleaned["observations"], 1);
  EXPECT_EQ(cleaned["in_plane"]["first"], json({176}));
  EXPECT_EQ(cleaned["behind"]["count"], 0);
  EXPECT_EQ(cleaned["at_centre"]["count"], 0);
  ASSERT_EQ(run({"solve", "clean.txt", "--quiet", "--json", "o.json"}).exit_code, 0);
  EXPECT_NEAR(document()["final_cost"], 18.32023299, 1e-7);
}

TEST_F(CheckCommand, ConvertDropsWhatLiesAtACentre) {
  for (const char* name : {"point-at-centre.txt", "point-at-origin.txt"}) {
    const Outcome outcome =
        run({"convert", data(name), "clean.txt", "--drop-behind", "--json", "o.json"});
    EXPECT_TRUE(says(outcome, "1 at its centre")) << outcome.out;
    EXPECT_EQ(document()["cleaned"]["at_centre"]["count"], 1);
    run({"check", "clean.txt", "--json", "o.json"});
    const json findings = document()["findings"];
    for (const json& finding : findings)
      EXPECT_FALSE(finding["grave"].get<bool>()) << finding["words"];
  }
}

}  // namespace
}  // namespace sheaf
