// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

class PhotometricCommand : public testing::Test {
 protected:
  void SetUp() override {
    const Outcome made = run({"generate", "scene", "--photometric", "--points", "300", "--start",
                              "1.5", "--brightness", "0.1", "--truth", "truth"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
  }
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  std::string in_scene(const std::string& name) { return folder_ / ("scene/" + name); }

  TemporaryFolder folder_;
};

TEST_F(PhotometricCommand, RefinesAndWritesWhatItCanReadAgain) {
  const Outcome first = run({"photometric", "scene", "-o", "refined", "--json", "1.json"});
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto before = json_of(folder_ / "1.json");
  EXPECT_LT(before["rms_grey"]["after"], 0.2 * double(before["rms_grey"]["before"]));
  EXPECT_EQ(before["brightness"].size(), 6u);
  ASSERT_EQ(run({"photometric", "refined", "--json", "2.json"}).exit_code, 0);
  const auto again = json_of(folder_ / "2.json");
  EXPECT_NEAR(again["rms_grey"]["before"], before["rms_grey"]["after"], 0.02);
  EXPECT_EQ(contents_of(folder_ / "refined/3.png"), contents_of(in_scene("3.png")));
}

std::size_t lines_of(const std::string& text) {
  return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
}

TEST_F(PhotometricCommand, WritesPicturesACloudAndWhatIsKnownOfPoints) {
  const Outcome outcome = run({"photometric", "scene", "-o", "refined", "--pictures", "a/pictures",
                               "--ply", "cloud.ply", "--json", "1.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto document = json_of(folder_ / "1.json");
  EXPECT_EQ(document["pictures"].size(), 8u);
  for (const std::string name : document["pictures"])
    EXPECT_EQ(contents_of(folder_ / ("a/pictures/" + name)).rfind("<svg ", 0), 0u) << name;
  // Two panels of 320 x 240 pixels twice as large, with margins and a legend.
  EXPECT_NE(contents_of(folder_ / "a/pictures/residuals-5.svg")
                .find(" viewBox=\"0 0 " + std::to_string(2 * 24 + 2 * 640 + 24) + " " +
                      std::to_string(108 + 480 + 104) + "\""),
            std::string::npos);
  const std::string cloud = contents_of(folder_ / "cloud.ply");
  EXPECT_NE(cloud.find("element vertex 660\n"), std::string::npos) << "2 x (300 + 5 x 6)";
  EXPECT_EQ(lines_of(contents_of(folder_ / "refined/visibility.txt")), 300u);
  EXPECT_EQ(lines_of(contents_of(folder_ / "refined/sigma.txt")), 300u);
  EXPECT_GT(document["sigma"]["median"], 0);
  EXPECT_EQ(document["sigma"]["of"], "inverse-depth");
  EXPECT_GT(document["inlier_share"]["after"], document["inlier_share"]["before"]);
  ASSERT_EQ(run({"photometric", "scene", "--pictures", "again"}).exit_code, 0);
  EXPECT_EQ(contents_of(folder_ / "again/worst-patches.svg"),
            contents_of(folder_ / "a/pictures/worst-patches.svg"));
  write_text(folder_ / "file", "");
  const Outcome broken = run({"photometric", "scene", "--pictures", "file"});
  EXPECT_EQ(broken.exit_code, 6);
  EXPECT_NE(broken.err.find("file"), std::string::npos) << broken.err;
  EXPECT_EQ(run({"photometric", "scene", "--ply", "no/cloud.ply"}).exit_code, 6);
}

TEST_F(PhotometricCommand, OptionsWork) {
  ASSERT_EQ(run({"photometric", "scene", "--points", "xyz", "--interpolation", "bilinear",
                 "--brightness", "none", "--loss", "cauchy:8", "--loss-on", "patch", "--leaving",
                 "free", "--max-iterations", "4", "--initial-damping", "0.01", "--quiet"})
                .exit_code,
            0);
  ASSERT_EQ(run({"photometric", "scene", "--levels",     "2",
                 "--pattern",   "8",     "--warp",       "translation",
                 "--min-zncc",  "0.5",   "--rounds",     "1",
                 "--fix",       "poses", "--intrinsics", "288,288,159.5,119.5",
                 "--tolerance", "1e-4",  "--motion",     "0.1"})
                .exit_code,
            0);
  EXPECT_EQ(run({"photometric", "scene", "--time-limit", "1e-9"}).exit_code, 7);
}

TEST_F(PhotometricCommand, IsAnchoredToMeasuredPositions) {
  ASSERT_EQ(run({"generate", "wide", "--photometric", "--points", "300", "--start", "8",
                 "--measured", "0.4"})
                .exit_code,
            0);
  const Outcome outcome = run({"photometric", "wide", "-o", "anchored", "--anchor", "0.4",
                               "--anchor-loss", "huber:2", "--rows", "exact", "--json", "a.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("measured positions, rms"), std::string::npos) << outcome.out;
  const auto json = json_of(folder_ / "a.json");
  EXPECT_GT(json["anchor"]["measurements"], 1000);
  EXPECT_GT(json["anchor"]["rms_px"]["before"], 4);
  EXPECT_LT(json["anchor"]["rms_px"]["after"], 0.8);
  EXPECT_EQ(contents_of(folder_ / "anchored/measurements.txt"),
            contents_of(folder_ / "wide/measurements.txt"));
  // Not asked for, they do not count.
  ASSERT_EQ(run({"photometric", "wide", "--max-iterations", "1", "--json", "b.json"}).exit_code, 0);
  EXPECT_EQ(json_of(folder_ / "b.json")["anchor"]["measurements"], 0);
}

TEST_F(PhotometricCommand, SaysWhatIsWrongWithAnAnchor) {
  const auto refused = [&](int code, const std::vector<std::string>& arguments,
                           const std::string& words) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  };
  refused(2, {"photometric", "scene", "--anchor", "1"}, "measured positions");
  refused(2, {"photometric", "scene", "--anchor", "0"}, "above 0");
  refused(2, {"photometric", "scene", "--anchor-loss", "huber:2"}, "--anchor");
  refused(2, {"photometric", "scene", "--anchor", "1", "--anchor-loss", "huber:auto"},
          "standard deviations");
  refused(2, {"photometric", "scene", "--rows", "some"}, "exact");
  write_text(in_scene("measurements.txt"), "0 1 10 10\n300 1 10 10\n");
  refused(3, {"photometric", "scene"},
          "measurements.txt:2: found '300', expected the point of measured position 1, 0 to 299");
  write_text(in_scene("measurements.txt"), "0 6 10 10\n");
  refused(3, {"photometric", "scene"}, "image of measured position 0, 0 to 5");
  write_text(in_scene("measurements.txt"), "0 1 10\n");
  refused(3, {"photometric", "scene"}, "entry 2 of 2 of measured position 0");
}

TEST_F(PhotometricCommand, SaysWhatIsWrong) {
  const auto refused = [&](int code, const std::vector<std::string>& arguments,
                           const std::string& words) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  };
  refused(3, {"photometric", "nowhere", "--intrinsics", "1,1,0,0"}, "nowhere: no such folder");
  refused(2, {"photometric", "scene", "--intrinsics", "1,1,0"}, "fx,fy,cx,cy");
  refused(2, {"photometric", "scene", "--points", "xyz", "--levels", "2"}, "pyramid");
  refused(2, {"photometric", "scene", "--pattern", "2x2"}, "4x4");
  std::filesystem::remove(in_scene("intrinsics.txt"));
  refused(2, {"photometric", "scene"}, "intrinsics");
  const std::vector<std::string> good = {"photometric", "scene", "--intrinsics", "288,288,159,119"};
  write_text(in_scene("hosts.txt"), "0 1 1\n6 1 1\n");
  refused(3, good, "hosts.txt:2: found '6', expected the host image of point 1, 0 to 5");
  std::filesystem::remove(in_scene("hosts.txt"));
  write_text(in_scene("brightness.txt"), "1 0\n");
  refused(3, good, "brightness.txt");
  std::filesystem::remove(in_scene("brightness.txt"));
  write_text(in_scene("points.txt"), "1 2 3\n4");
  refused(3, good, "points.txt");
  std::filesystem::remove(in_scene("2.png"));
  write_text(in_scene("2.png"), "no image");
  write_text(in_scene("points.txt"), contents_of(folder_ / "truth/points.txt"));
  refused(3, good, "2.png");
  write_text(in_scene("poses.txt"), "0 0 0 0 0 0 0 2\n");
  refused(3, good, "unit quaternion");
}

}  // namespace
}  // namespace sheaf
