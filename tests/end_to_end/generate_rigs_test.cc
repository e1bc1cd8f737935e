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

class GenerateRigs : public testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  TemporaryFolder folder_;
};

TEST_F(GenerateRigs, WritesTheModelThatTheLibraryMakes) {
  const Outcome outcome = run({"generate",
                               "model",
                               "--rigs",
                               "around",
                               "--rig-sensors",
                               "4",
                               "--frames",
                               "15",
                               "--points",
                               "400",
                               "--camera",
                               "SIMPLE_RADIAL",
                               "--missing",
                               "0.2",
                               "--single-images",
                               "2",
                               "--sensor-rotation-noise",
                               "0.01",
                               "--sensor-translation-noise",
                               "0.02",
                               "--seed",
                               "3",
                               "--truth",
                               "truth",
                               "--json",
                               "g.json"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  RigSceneOptions options;
  options.kind = RigKind::around;
  options.model = CameraModel::simple_radial;
  options.sensors = 4;
  options.frames = 15;
  options.missing = 0.2;
  options.single_images = 2;
  options.sensor_rotation_noise_rad = 0.01;
  options.sensor_translation_noise = 0.02;
  options.scene = {.points = 400, .seed = 3};
  const Scene scene = generate(options).value();
  const InputFile start = read_file(folder_ / "model").value();
  EXPECT_EQ(start.format, "colmap");
  EXPECT_EQ(start.problem.cameras.size(), 5u);
  EXPECT_EQ(start.problem.observation_xy, scene.start.observation_xy);
  EXPECT_EQ(start.problem.points, scene.start.points);
  EXPECT_EQ(read(folder_ / "truth").value().points, scene.truth.points);
  const nlohmann::json made = json_of(folder_ / "g.json");
  EXPECT_EQ(made["options"]["rigs"], "around");
  EXPECT_EQ(made["options"]["rig_sensors"], 4);
  EXPECT_EQ(made["options"]["frames"], 15);
  EXPECT_EQ(made["options"]["camera"], "SIMPLE_RADIAL");
  EXPECT_TRUE(made["options"]["cameras"].is_null());
  EXPECT_EQ(made["poses"], scene.start.num_images());
}

TEST_F(GenerateRigs, RefusesWhatIsNotOfRigs) {
  EXPECT_EQ(run({"generate", "m", "--rigs", "around", "--cameras", "9"}).exit_code, 2);
  EXPECT_EQ(run({"generate", "m", "--rigs", "boat"}).exit_code, 2);
  EXPECT_EQ(run({"generate", "m.txt", "--frames", "9"}).exit_code, 2);
  EXPECT_EQ(run({"generate", "m", "--rigs", "stereo", "--camera", "BAL"}).exit_code, 2);
}

}  // namespace
}  // namespace sheaf
