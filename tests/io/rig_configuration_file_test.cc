// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/rig_configuration_file.h"

#include <gtest/gtest.h>

#include <string>

namespace sheaf {
namespace {

const char kRig[] =
    "[\n"
    "  {\n"
    "    \"cameras\": [\n"
    "      {\"image_prefix\": \"left/\", \"ref_sensor\": true},\n"
    "      {\n"
    "        \"image_prefix\": \"right/\",\n"
    "        \"camera_model_name\": \"PINHOLE\", \"camera_params\": [1, 1, 0, 0],\n"
    "        \"cam_from_rig_rotation\": [2, 0,\n"
    "           0, 0],\n"
    "        \"cam_from_rig_translation\": [-0.5, 0, 1e-3]\n"
    "      },\n"
    "      {\"image_prefix\": \"up/\", \"ref_sensor\": false}\n"
    "    ]\n"
    "  }\n"
    "]\n";

TEST(RigConfigurationFile, ReadsWhatColmapReads) {
  const RigConfigurationFile file = parse_rig_configuration(kRig, "rig.json").value();
  ASSERT_EQ(file.rigs.size(), 1u);
  const std::vector<RigCamera>& cameras = file.rigs[0].cameras;
  ASSERT_EQ(cameras.size(), 3u);
  EXPECT_EQ(cameras[0].image_prefix, "left/");
  EXPECT_TRUE(cameras[0].reference);
  EXPECT_FALSE(cameras[0].cam_from_rig);
  EXPECT_EQ(cameras[1].cam_from_rig->rotation, (std::array<double, 4>{1, 0, 0, 0}));
  EXPECT_EQ(cameras[1].cam_from_rig->translation, (std::array<double, 3>{-0.5, 0, 1e-3}));
  EXPECT_FALSE(cameras[2].reference);
  ASSERT_EQ(file.notes.size(), 1u);
  EXPECT_NE(file.notes[0].find("not used"), std::string::npos);
}

TEST(RigConfigurationFile, SaysWhereAndWhatIsWrong) {
  const struct {
    const char *from, *to, *expected;
  } changes[] = {
      {"[\n  {", "{\n  \"rig\": {", "rig.json:15: found ']' where it cannot stand, expected JSON"},
      {"\"image_prefix\": \"right/\",", "", "rig.json:5: found a camera without \"image_prefix\""},
      {"\"right/\"", "7", "rig.json:6: found 7, expected a text"},
      {"[2, 0,\n           0, 0]", "[2, 0,\n           0]",
       "rig.json:8: found a list of 3, expected four numbers w, x, y, z"},
      {"[2, 0,\n           0, 0]", "[2, 0,\n           null, 0]",
       "rig.json:9: found null, expected one of four numbers"},
      {"[2, 0,\n           0, 0]", "[0, 0,\n           0, 0]",
       "rig.json:8: found a quaternion of no direction"},
      {"\"cam_from_rig_rotation\"", "\"x\"",
       "rig.json:10: found cam_from_rig_translation alone, expected both or neither"},
      {"\"left/\", \"ref_sensor\": true", "\"left/\"",
       "rig.json:2: found a rig with 0 reference sensors"},
      {"\"ref_sensor\": false", "\"ref_sensor\": true",
       "rig.json:2: found a rig with 2 reference sensors"},
      {"\"ref_sensor\": false", "\"ref_sensor\": 1",
       "rig.json:12: found 1, expected true or false"},
      {"\"cameras\"", "\"camera\"", "rig.json:2: found a rig without \"cameras\""},
      {"true},", "true, \"cam_from_rig_rotation\": []},",
       "rig.json:4: found a pose of the reference sensor"},
      {"1e-3]", "1e-3", "rig.json:11: found "},
  };
  for (const auto& change : changes) {
    std::string text = kRig;
    text.replace(text.find(change.from), std::string(change.from).size(), change.to);
    const Result<RigConfigurationFile> file = parse_rig_configuration(text, "rig.json");
    ASSERT_FALSE(file.ok()) << change.expected;
    EXPECT_EQ(file.error().code(), ErrorCode::unreadable_input);
    EXPECT_EQ(std::string(file.error().what()).rfind(change.expected, 0), 0u)
        << file.error().what();
  }
  for (const std::string& text : {std::string(), std::string("3"), std::string("[1]"),
                                  std::string(500, '['), std::string("[{\"cameras\": []}]")})
    EXPECT_FALSE(parse_rig_configuration(text, "rig.json").ok()) << text;
  EXPECT_FALSE(read_rig_configuration("no such file.json").ok());
}

/// Cut anywhere it is refused, and nothing worse.
TEST(RigConfigurationFile, CutAnywhereItIsRefused) {
  const std::string text = kRig;
  for (std::size_t cut = 0; cut + 2 < text.size(); ++cut) {
    const Result<RigConfigurationFile> file = parse_rig_configuration(text.substr(0, cut), "r");
    ASSERT_FALSE(file.ok()) << cut;
    EXPECT_NE(std::string(file.error().what()).find("found "), std::string::npos);
  }
}

}  // namespace
}  // namespace sheaf
