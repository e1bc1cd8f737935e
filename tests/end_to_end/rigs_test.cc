// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Models with rigs, through the command: what their frames say holds, and comes back.
#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "end_to_end/rig_folders.h"

namespace sheaf {
namespace {

using json = nlohmann::json;

class RigsTest : public testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  json info(const std::string& path) {
    EXPECT_EQ(run({"info", path, "--json", "info.json"}).exit_code, 0);
    return json::parse(contents_of(folder_ / "info.json"));
  }
  /// A model whose images have the names left/N and right/N, without rigs.
  void make_stereo() {
    test::make_rig_folder(folder_, "stereo");
    cost_ = info("stereo")["cost"];
    std::filesystem::remove(folder_ / "stereo/rigs.txt");
    std::filesystem::remove(folder_ / "stereo/frames.txt");
    std::string text;
    int image = 0;
    std::istringstream lines(contents_of(folder_ / "stereo/images.txt"));
    for (std::string line; std::getline(lines, line);) {
      if (line.ends_with(".png")) {
        line.erase(line.find_last_of(' ') + 1);
        line += (image % 2 == 0 ? "left/" : "right/") + std::to_string(image / 2);
        ++image;
      }
      text += line + "\n";
    }
    ASSERT_EQ(image, 8);
    write_text(folder_ / "stereo/images.txt", text);
  }
  TemporaryFolder folder_;
  double cost_ = 0;  ///< of the model before anything was edited
};

TEST_F(RigsTest, FramesHoldWhereImagesStateOldPoses) {
  const std::string path = "stale";
  test::make_rig_folder(folder_, "agrees");
  test::make_stale_folder(folder_, path);
  const json document = info(path);
  const double cost = info("agrees")["cost"];
  EXPECT_NEAR(document["cost"].get<double>(), cost, 1e-9 * cost);
  // Without rigs the images' own poses hold: these are old.
  std::filesystem::remove(folder_ / "stale/rigs.txt");
  std::filesystem::remove(folder_ / "stale/frames.txt");
  EXPECT_GT(info(path)["cost"].get<double>(), 100 * cost);
  std::filesystem::remove_all(folder_ / "stale"),
      std::filesystem::remove_all(folder_ / "stale-binary");
  test::make_stale_folder(folder_, path);
  EXPECT_EQ(document["rigs"], (json{{"count", 1}, {"sensors", 2}, {"frames", 4}, {"images", 8}}));
  EXPECT_EQ(document["stale_poses"]["count"], 8);
  const Outcome outcome = run({"info", path});
  EXPECT_NE(outcome.out.find("\nrigs        1 of 2 sensors, 4 frames of 8 images\n"),
            std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find("\nstale       "), std::string::npos);
  EXPECT_NE(run({"check", path}).out.find("another pose in the file of images"), std::string::npos);
}

TEST_F(RigsTest, ASensorThatIsNoCameraIsNotMistakenForOne) {
  test::make_rig_folder(folder_, "agrees");
  test::make_imu_folder(folder_, "imu");
  const double cost = info("agrees")["cost"];
  EXPECT_NEAR(info("imu")["cost"].get<double>(), cost, 1e-9 * cost);
  EXPECT_EQ(info("imu")["stale_poses"]["count"], 0);
}

TEST_F(RigsTest, CleaningLeavesRigsAsTheyWere) {
  const std::string path = "imu";
  test::make_imu_folder(folder_, path);
  const Outcome outcome = run({"convert", path, "cleaned", "--max-error", "1.5"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find("dropped"), std::string::npos) << outcome.out;
  for (const char* name : {"/rigs.txt", "/frames.txt", "/cameras.txt"})
    EXPECT_EQ(contents_of(folder_ / ("cleaned" + std::string(name))),
              contents_of(folder_ / (path + name)));
}

TEST_F(RigsTest, AConfigurationIsLaidOverAModelWithout) {
  make_stereo();
  write_text(folder_ / "rig.json",
             "[{\"cameras\": [{\"image_prefix\": \"left/\", \"ref_sensor\": true},\n"
             "  {\"image_prefix\": \"right/\"}]}]\n");
  EXPECT_EQ(info("stereo")["rigs"]["count"], 0);
  EXPECT_TRUE(info("stereo")["rig_configuration"].is_null());
  const Outcome outcome =
      run({"convert", "stereo", "rigged", "--rigs", "rig.json", "--json", "c.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("right/: pose averaged"), std::string::npos) << outcome.err;
  const json document = json::parse(contents_of(folder_ / "c.json"))["rig_configuration"];
  EXPECT_EQ(document["images"], 8);
  EXPECT_EQ(document["frames"], 4);
  EXPECT_EQ(document["sensors"][1]["image_prefix"], "right/");
  EXPECT_LT(document["sensors"][1]["translation"]["max"], 1e-9);
  const json rigged = info("rigged");
  EXPECT_EQ(rigged["rigs"]["sensors"], 2);
  EXPECT_NEAR(rigged["cost"].get<double>(), cost_, 1e-6);
  EXPECT_EQ(run({"info", "rigged", "--rigs", "rig.json"}).exit_code, 2);
  write_text(folder_ / "rig.json", "[{\"cameras\": 3}]");
  const Outcome wrong = run({"info", "stereo", "--rigs", "rig.json"});
  EXPECT_EQ(wrong.exit_code, 3);
  EXPECT_NE(wrong.err.find("rig.json:1: found 3, expected a list of a rig's cameras"),
            std::string::npos)
      << wrong.err;
}

}  // namespace
}  // namespace sheaf
