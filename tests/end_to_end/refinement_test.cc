// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// --fix and --refine, on a COLMAP model whose images and lenses have names.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/sheaf.h"

namespace sheaf {
namespace {

using Words = std::vector<std::string>;

class RefinementCommand : public testing::Test {
 protected:
  void SetUp() override {
    const Outcome made = run({"generate", "model", "--camera", "RADIAL", "--lenses", "3",
                              "--cameras", "12", "--points", "300", "--mean-track", "5"});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    ASSERT_EQ(run({"convert", "model", "text", "--format", "colmap-text"}).exit_code, 0);
  }
  Outcome run(const Words& arguments) { return run_command(arguments, folder_.path()); }
  /// Solves the text into `after` and says what moved.
  std::vector<std::string> moved(Words options) {
    std::filesystem::remove_all(folder_ / "after");
    options.insert(options.begin(), {"solve", "text", "-o", "after", "--max-iterations", "4"});
    const Outcome outcome = run(options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    out_ = outcome.out;
    std::vector<std::string> names;
    for (const auto& [file, what] : {std::pair<std::string, std::string>{"cameras", "camera"},
                                     {"images", "image"},
                                     {"points3D", "point"}}) {
      const auto before = records("text/" + file + ".txt", file == "images");
      const auto after = records("after/" + file + ".txt", file == "images");
      EXPECT_EQ(before.size(), after.size());
      for (const auto& [id, line] : before)
        if (after.at(id) != line && (what != "point" || names.back() != "points"))
          names.push_back(what == "point" ? "points" : what + " " + id);
    }
    return names;
  }
  /// Text of each record as it stands in the file, by id; of a point only where it is.
  std::map<std::string, std::string> records(const std::string& file, bool images) {
    std::istringstream text(contents_of(folder_ / file));
    std::map<std::string, std::string> out;
    bool features = false;
    for (std::string line; std::getline(text, line);) {
      if (!line.empty() && line[0] == '#') continue;
      if (images && (features = !features, !features)) continue;
      std::istringstream words(line);
      std::string id, word, kept;
      words >> id;
      const int most = file.find("points") != std::string::npos ? 3 : 100;
      for (int k = 0; k < most && words >> word; ++k) kept += word + " ";
      out[id] = kept;
    }
    return out;
  }
  std::string complaint(const Words& options) {
    Words words = {"solve", "text"};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, 2);
    return outcome.err;
  }
  TemporaryFolder folder_;
  std::string out_;
};

TEST_F(RefinementCommand, ANamedCameraStaysToTheLastBit) {
  const Words all = moved({});
  EXPECT_EQ(all.size(), 3 + 12 + 1u);
  const auto without = [&](const Words& held) {
    Words rest = all;
    for (const std::string& name : held) std::erase(rest, name);
    EXPECT_EQ(rest.size(), all.size() - held.size());
    return rest;
  };
  // Images take the three lenses in turn: the second image has the second.
  EXPECT_EQ(moved({"--fix", "image=image-000002.png"}), without({"image 2", "camera 2"}));
  EXPECT_NE(
      out_.find("held        poses of 1 of 12 images; all of 1 of 3 lenses; cx, cy of 2 of 3"),
      std::string::npos)
      << out_;
  EXPECT_EQ(moved({"--fix", "pose=image-000007.png"}), without({"image 7"}));
  EXPECT_EQ(moved({"--fix", "pose=7,camera=3"}), without({"image 7", "camera 3"}));
  EXPECT_EQ(moved({"--fix", "camera=image-000004.png"}), without({"camera 1"}));
  EXPECT_EQ(moved({"--fix", "pose=image-00000[1-3]*", "--fix", "points"}),
            without({"image 1", "image 2", "image 3", "points"}));
  EXPECT_EQ(moved({"--fix", "intrinsics", "--refine", "f=2"}), without({"camera 1", "camera 3"}));
  EXPECT_EQ(moved({"--fix", "f,k", "--refine", "k1=3"}), without({"camera 1", "camera 2"}));
}

TEST_F(RefinementCommand, OnlyANewImageMoves) {
  EXPECT_EQ(moved({"--fix", "points,poses,intrinsics", "--refine", "pose=image-000005.png"}),
            (Words{"image 5"}));
  EXPECT_EQ(moved({"--fix", "points,poses", "--refine", "pose=image-*", "--fix",
                   "intrinsics,pose=image-000001.png"})
                .size(),
            11u);
}

TEST_F(RefinementCommand, SingleParametersMoveAlone) {
  const auto parameters = [&](const std::string& id) {
    std::istringstream words(records("after/cameras.txt", false).at(id));
    Words out;
    for (std::string word; words >> word;) out.push_back(word);
    return out;
  };
  const auto all = [&](const std::string& folder) {
    std::istringstream words(records(folder + "/cameras.txt", false).at("2"));
    Words out;
    for (std::string word; words >> word;) out.push_back(word);
    return out;
  };
  moved({"--fix", "k1=2"});
  const Words before = all("text"), after = parameters("2");
  // RADIAL 1800 1200 f cx cy k1 k2
  ASSERT_EQ(before.size(), 8u);
  EXPECT_NE(after[3], before[3]);
  EXPECT_EQ(after[4], before[4]);
  EXPECT_EQ(after[6], before[6]);
  EXPECT_NE(after[7], before[7]);
  moved({"--refine", "cx=2"});
  EXPECT_NE(parameters("2")[4], before[4]);
  EXPECT_EQ(parameters("2")[5], before[5]);
  moved({"--refine", "pp"});
  EXPECT_NE(parameters("2")[4], before[4]);
  EXPECT_NE(parameters("2")[5], before[5]);
}

TEST_F(RefinementCommand, WhatIsNotThereIsNamedWithWhatIs) {
  for (const auto& [options, words] : std::vector<std::pair<Words, std::string>>{
           {{"--fix", "camera=9"},
            "--fix camera=9: no camera has the id 9, and no image is called 9; of cameras, there "
            "are 1, 2, 3; images are called image-000001.png"},
           {{"--fix", "pose=left.jpg"},
            "--fix pose=left.jpg: no image is called left.jpg; images are called image-000001.png, "
            "image-000002.png, image-000003.png, image-000004.png, image-000005.png and 7 more"},
           {{"--refine", "pose=17"},
            "--refine pose=17: no image has the id or name 17; of ids, there "
            "are 1, 2, 3, 4, 5 and 7 more"},
           {{"--refine", "omega"},
            "--refine omega: no camera that is meant has this parameter; RADIAL has f, cx, cy, k1, "
            "k2"},
           {{"--fix", "fx=2"}, "RADIAL has f, cx, cy, k1, k2"},
           {{"--fix", "poses", "--refine", "poses"},
            "--fix poses and --refine poses contradict each other"},
           {{"--fix", "camera=2", "--refine", "camera=image-000002.png"},
            "--fix camera=2 and --refine camera=image-000002.png contradict each other"},
           {{"--fix", "lens"}, "not 'lens'"},
           {{"--fix", "camera"}, "not 'camera'"},
           {{"--refine", "points=3"}, "not 'points=3'"},
           {{"--refine", "f="}, "not 'f='"}}) {
    const std::string said = complaint(options);
    EXPECT_NE(said.find(words), std::string::npos) << said;
  }
}

TEST_F(RefinementCommand, NamesWithCommasAreNamed) {
  Problem problem = read(folder_ / "model").value();
  auto metadata = std::make_shared<SceneMetadata>(*problem.metadata);
  metadata->image_names[3] = "b,2.png";
  problem.metadata = metadata;
  std::filesystem::remove_all(folder_ / "text");
  write(problem, folder_ / "text", {.format = "colmap-text"}).value();
  const Words names = moved({"--fix", "pose=b\\,2.png,points"});
  EXPECT_EQ(names.size(), 3 + 11u);
  EXPECT_EQ(std::count(names.begin(), names.end(), "image 4"), 0);
}

TEST_F(RefinementCommand, AFileWithoutNamesCountsFromZero) {
  ASSERT_EQ(run({"generate", "s.txt", "--points", "300", "--cameras", "8"}).exit_code, 0);
  ASSERT_EQ(
      run({"solve", "s.txt", "-o", "r.txt", "--fix", "image=0,k2", "--json", "j.json"}).exit_code,
      0);
  const Problem before = read(folder_ / "s.txt").value(), after = read(folder_ / "r.txt").value();
  EXPECT_EQ(before.bal_angle_axis[0], after.bal_angle_axis[0]);
  EXPECT_EQ(before.poses[0].translation, after.poses[0].translation);
  EXPECT_EQ(before.cameras[0].parameters, after.cameras[0].parameters);
  EXPECT_NE(before.cameras[1].parameters, after.cameras[1].parameters);
  EXPECT_EQ(before.cameras[1].parameters[2], after.cameras[1].parameters[2]);
  const nlohmann::json options = json_of(folder_ / "j.json")["options"];
  EXPECT_EQ(options["fix"], (nlohmann::json{"image=0", "k2"}));
  EXPECT_EQ(options["refine"], nlohmann::json::array());
  EXPECT_EQ(run({"solve", "s.txt", "--fix", "pose=8"}).exit_code, 2);
}

}  // namespace
}  // namespace sheaf
