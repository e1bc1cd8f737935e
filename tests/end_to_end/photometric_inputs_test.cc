// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

#include "end_to_end/command.h"
#include "io/photometric_scenes.h"
#include "report/errors.h"

namespace sheaf {
namespace {

using namespace test;

class PhotometricInputs : public testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  void refused(int code, const std::vector<std::string>& arguments, const std::string& words) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  }
  PhotometricSceneOptions options_ = [] {
    PhotometricSceneOptions o = rgbd_scene();
    o.width = 256, o.height = 192, o.points = 400;
    return o;
  }();
  TemporaryFolder folder_;
};

TEST_F(PhotometricInputs, RgbdComesBackFromDisturbedPoses) {
  write_folder(rgbd_folder(options_, generate(options_).value().truth), folder_ / "in");
  const std::vector<std::string> good = {"photometric",
                                         "in",
                                         "--depth-scale",
                                         "10000",
                                         "--fix",
                                         "points",
                                         "--levels",
                                         "3",
                                         "--disturb-rotation",
                                         "0.01",
                                         "--disturb-center",
                                         "0.02",
                                         "--cell",
                                         "10",
                                         "--seed",
                                         "2",
                                         "-o",
                                         "out",
                                         "--json",
                                         "1.json"};
  const Outcome first = run(good);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const auto json = json_of(folder_ / "1.json");
  EXPECT_EQ(json["input"]["format"], "rgbd");
  EXPECT_GT(json["poses"]["rotation_error_rad"]["before"], 5e-3);
  EXPECT_LT(json["poses"]["rotation_error_rad"]["after"], 5e-4);
  EXPECT_LT(json["poses"]["center_error"]["after"], 2e-3);
  EXPECT_NE(first.out.find("poses "), std::string::npos) << first.out;
  ASSERT_EQ(
      run({"photometric", "out", "--depth-scale", "10000", "--fix", "points", "--json", "2.json"})
          .exit_code,
      0);
  const auto again = json_of(folder_ / "2.json");
  // Patches that left count at the end of the first run, and are not there in the second.
  EXPECT_LT(again["rms_grey"]["before"], json["rms_grey"]["after"]);
  EXPECT_NEAR(again["median_abs_grey"]["before"], json["median_abs_grey"]["after"], 0.1);
  EXPECT_EQ(contents_of(folder_ / "out/rgb/1 a.png"), contents_of(folder_ / "in/rgb/1 a.png"));
}

TEST_F(PhotometricInputs, PointsAreChosenAsAsked) {
  write_folder(numbered_folder(options_, generate(options_).value().truth), folder_ / "in");
  const auto patches = [&](const std::string& tolerance) {
    EXPECT_EQ(run({"photometric", "in", "--depth-scale", "10000", "--every", "2", "--max-points",
                   "50", "--min-slope", "1", "--cell", "12", "--depth-tolerance", tolerance,
                   "--max-iterations", "1", "--json", "1.json"})
                  .exit_code,
              0);
    const auto json = json_of(folder_ / "1.json");
    EXPECT_EQ(json["input"]["images"], 2);
    EXPECT_EQ(json["input"]["points"], 50);
    return int(json["patches"]["total"]);
  };
  EXPECT_LT(patches("0.0001"), patches("0.1"));
}

TEST_F(PhotometricInputs, AColmapModelIsRefinedAndKept) {
  options_.start_px = 1.5;
  const PhotometricScene scene = generate(options_).value();
  Problem start = model_of(scene.start);
  const Problem truth = model_of(scene.truth);
  // What a structure-from-motion run would have: the start's state, the truth's features.
  start.observation_image = truth.observation_image;
  start.observation_point = truth.observation_point;
  start.observation_xy = truth.observation_xy;
  write(start, folder_ / "model", {.format = "colmap-text"}).value();
  write_folder(pictures_of(scene.truth), folder_ / "pictures");
  const Outcome outcome =
      run({"photometric", "model", "--images", "pictures", "-o", "refined", "--json", "1.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(json_of(folder_ / "1.json")["input"]["format"], "colmap-text");
  const Problem before = read(folder_ / "model").value(), after = read(folder_ / "refined").value();
  EXPECT_EQ(after.observation_xy, before.observation_xy);
  EXPECT_EQ(after.metadata->image_names, before.metadata->image_names);
  const auto errors = [&](const Problem& p) {
    return compare_states(p, truth, true).value().rotation_error_rad.mean;
  };
  EXPECT_LT(errors(after), 0.25 * errors(before));
}

TEST_F(PhotometricInputs, ARealModelFitsItsImagesBetter) {
  const char* data = std::getenv("SHEAF_DATA");
  const auto model =
      std::filesystem::absolute(data ? data : "data") / "colmap" / "gtsfm-astrovision-dawn";
  if (!std::filesystem::exists(model)) GTEST_SKIP() << model << " is not there";
  ASSERT_EQ(run({"photometric", model.string(), "--json", "1.json", "-o", "refined"}).exit_code, 0);
  const auto json = json_of(folder_ / "1.json");
  EXPECT_EQ(json["input"]["format"], "colmap");
  EXPECT_GT(json["median_abs_grey"]["before"], 7);
  EXPECT_LT(json["median_abs_grey"]["after"], 1.2);
  EXPECT_EQ(read(folder_ / "refined").value().num_points(), read(model).value().num_points());
}

TEST_F(PhotometricInputs, SaysWhatIsWrong) {
  const PhotometricProblem scene = generate(rgbd_scene()).value().truth;
  Problem model = model_of(scene);
  write(model, folder_ / "model", {.format = "colmap"}).value();
  refused(2, {"photometric", "model"}, "say where they are");
  refused(3, {"photometric", "model", "--images", "."}, "of/0.png");
  refused(2, {"photometric", "model", "--images", ".", "--intrinsics", "1,1,0,0"},
          "intrinsics of its own");
  model.cameras[0].model = CameraModel::opencv;
  write(model, folder_ / "lens", {.format = "colmap"}).value();
  refused(2, {"photometric", "lens", "--images", "."}, "undistort");
  write_text(folder_ / "file", "x");
  refused(3, {"photometric", "file"}, "no such folder");
  std::filesystem::create_directory(folder_ / "empty");
  refused(3, {"photometric", "empty"}, "found none of poses.txt");
  MemoryFolder rgbd = rgbd_folder(rgbd_scene(), scene);
  rgbd.erase("depth/2 a.png");
  write_folder(rgbd, folder_ / "rgbd");
  refused(3, {"photometric", "rgbd", "--depth-scale", "10000"}, "depth/2 a.png");
  refused(2, {"photometric", "rgbd", "--depth-scale", "0"}, "depth-scale");
  refused(2, {"photometric", "rgbd", "--cell", "0"}, "cell");
  rgbd.erase("intrinsics.txt");
  write_folder(rgbd, folder_ / "bare");
  refused(2, {"photometric", "bare"}, "intrinsics");
}

}  // namespace
}  // namespace sheaf
