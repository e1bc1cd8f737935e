// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "scene/similarity.h"
#include "sheaf/io.h"
#include "sheaf/problem.h"

namespace sheaf {
namespace {

class AlignCommand : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run({"generate", "drive", "--rigs", "stereo", "--frames", "8", "--points", "200"})
                  .exit_code,
              0);
    Problem moved = read(folder_ / "drive").value();
    move(moved, kMove);
    write(moved, folder_ / "moved", {.format = "colmap"}).value();
  }
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  const Similarity kMove{0.4, normalized(Quaternion<double>{1, 0.3, -0.2, 0.5}),
                         Vector3<double>{100, 20, -5}};
  TemporaryFolder folder_;
};

TEST_F(AlignCommand, BringsAModelBack) {
  for (const bool robust : {false, true}) {
    std::vector<std::string> words = {"align",       "moved", "-o",     "back",
                                      "--reference", "drive", "--json", "a.json"};
    if (!robust) words.push_back("--least-squares");
    const Outcome outcome = run(words);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const auto document = json_of(folder_ / "a.json");
    EXPECT_NEAR(document["alignment"]["scale"], 2.5, 1e-9);
    EXPECT_EQ(document["alignment"]["robust"], robust);
    EXPECT_LT(document["center_error"]["max"], 1e-8);
    EXPECT_EQ(document["output"]["format"], "colmap");
    ASSERT_EQ(run({"evaluate", "back", "drive", "--no-align", "--json", "e.json"}).exit_code, 0);
    const auto errors = json_of(folder_ / "e.json");
    for (const char* kind : {"translation_error", "center_error", "point_error",
                             "frame_center_error", "sensor_translation_error"})
      EXPECT_LT(errors[kind]["max"], 1e-7) << kind;
    EXPECT_LT(errors["rotation_error_rad"]["max"], 1e-9);
  }
  const Problem back = read(folder_ / "back").value(), drive = read(folder_ / "drive").value();
  EXPECT_EQ(back.observation_xy, drive.observation_xy);
  EXPECT_EQ(back.metadata->feature_xy, drive.metadata->feature_xy);
  EXPECT_EQ(back.metadata->image_names, drive.metadata->image_names);
  const double cost = evaluate(drive).cost;
  EXPECT_NEAR(evaluate(back).cost, cost, 1e-9 * cost);
}

TEST_F(AlignCommand, KeepsTheScaleOfARigidMotion) {
  const Outcome outcome = run({"align", "moved", "-o", "back", "--reference", "drive", "--rigid"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("\nscale       1\n"), std::string::npos) << outcome.out;
  const Problem back = read(folder_ / "back").value(), moved = read(folder_ / "moved").value();
  EXPECT_EQ(back.rigs.sensor_from_rig[1].translation, moved.rigs.sensor_from_rig[1].translation);
}

TEST_F(AlignCommand, WritesOtherFormatsAndSaysWhatTheyDrop) {
  const Outcome outcome =
      run({"align", "moved", "-o", "back", "--reference", "drive", "--format", "colmap-text"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("wrote       back (colmap-text)"), std::string::npos) << outcome.out;
}

TEST_F(AlignCommand, RefusesWhatDeterminesNothing) {
  ASSERT_EQ(run({"generate", "other", "--camera", "PINHOLE", "--points", "200"}).exit_code, 0);
  const Outcome outcome = run({"align", "other", "-o", "out", "--reference", "drive"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("in common"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace sheaf
