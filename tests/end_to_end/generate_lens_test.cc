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

class GenerateLens : public testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  TemporaryFolder folder_;
};

TEST_F(GenerateLens, WritesTheModelThatTheLibraryMakes) {
  const Outcome outcome =
      run({"generate", "model", "--camera", "OPENCV_FISHEYE", "--lenses", "2", "--cameras", "20",
           "--points", "400", "--seed", "3", "--truth", "truth", "--json", "g.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  LensSceneOptions options;
  options.model = CameraModel::opencv_fisheye;
  options.lenses = 2;
  options.scene = {.images = 20, .points = 400, .seed = 3};
  const Scene scene = generate(options).value();
  const InputFile start = read_file(folder_ / "model").value();
  EXPECT_EQ(start.format, "colmap");
  EXPECT_EQ(start.problem.cameras.size(), 2u);
  EXPECT_EQ(start.problem.observation_xy, scene.start.observation_xy);
  EXPECT_EQ(start.problem.points, scene.start.points);
  EXPECT_EQ(read(folder_ / "truth").value().points, scene.truth.points);
  const nlohmann::json made = json_of(folder_ / "g.json");
  EXPECT_EQ(made["options"]["camera"], "OPENCV_FISHEYE");
  EXPECT_EQ(made["options"]["lenses"], 2);
  EXPECT_TRUE(made["options"]["field_of_view_deg"].is_null());
  EXPECT_TRUE(made["options"]["family"].is_null());
  EXPECT_EQ(made["cameras"], 2);
  EXPECT_EQ(made["poses"], 20);
  // A lakeside has the same keys.
  ASSERT_EQ(run({"generate", "l.txt", "--points", "300", "--json", "l.json"}).exit_code, 0);
  const nlohmann::json lakeside = json_of(folder_ / "l.json");
  for (const auto& [key, ignored] : made["options"].items())
    EXPECT_TRUE(lakeside["options"].contains(key)) << key;
  EXPECT_EQ(made["options"].size(), lakeside["options"].size());
}

TEST_F(GenerateLens, AnExtensionSaysWhatIsWritten) {
  ASSERT_EQ(run({"generate", "s.txt", "--camera", "SIMPLE_RADIAL", "--points", "300"}).exit_code,
            0);
  EXPECT_EQ(read_file(folder_ / "s.txt").value().format, "bal");
  EXPECT_EQ(run({"generate", "s.txt", "--camera", "EUCM", "--points", "300"}).exit_code, 2);
}

TEST_F(GenerateLens, RefusesWhatDoesNotGoTogether) {
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"--camera", "FISH"},
                                             {"--shared"},
                                             {"--lenses", "2"},
                                             {"--camera", "OPENCV", "--shared", "--lenses", "2"},
                                             {"--camera", "OPENCV", "--lenses", "0"},
                                             {"--camera", "OPENCV", "--field-of-view", "150"},
                                             {"--camera", "OPENCV", "--family", "street"},
                                             {"--camera", "OPENCV", "--photometric"}}) {
    std::vector<std::string> all = {"generate", "model"};
    all.insert(all.end(), words.begin(), words.end());
    EXPECT_EQ(run(all).exit_code, 2) << words[0] << words.back();
  }
}

}  // namespace
}  // namespace sheaf
