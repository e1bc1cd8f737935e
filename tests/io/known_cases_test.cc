// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Files as other programs leave them, which are no textbook's: quaternions of any length, names
// with blanks and accents, empty parts, marks at the beginning.
#include <gtest/gtest.h>

#include <memory>

#include "inspect/check.h"
#include "io/bytes.h"
#include "io/models.h"
#include "io/nvm.h"
#include "io/rig_models.h"
#include "io/rotation_norms.h"
#include "platform/unicode.h"
#include "report/matching.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using namespace test;

constexpr double kThreeCost = 3.0544728874777;

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != text.npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

Problem nvm(const std::string& text) {
  std::vector<std::string> notes;
  return parse_nvm(text, "f", notes).value();
}

double length_of_stated(const ColmapFiles& files, std::size_t image) {
  const Problem problem = parse_colmap(files).value();
  if (problem.metadata->stated_rotations.empty()) return 1;
  double squares = 0;
  for (std::size_t k = 0; k < 4; ++k)
    squares += std::pow(problem.metadata->stated_rotations[4 * image + k], 2);
  return std::sqrt(squares);
}

/// COLMAP takes quaternions as they are: at one of length 1.0018 its cost would be 3.5752.
TEST(KnownCases, WhatAnNvmMeansIsWhatAModelOfColmapSays) {
  const std::string text = slurp("tests/data/three.nvm");
  const Problem problem = nvm(text);
  EXPECT_NEAR(evaluate(problem).cost, kThreeCost, 1e-12);
  for (const bool as_text : {false, true})
    EXPECT_NEAR(length_of_stated(format_colmap(problem, as_text).value(), 1), 1, 1e-15);
  const std::string own = format_nvm(problem).value();
  EXPECT_NE(own.find(" 0.9809789619797997 "), std::string::npos) << "as it stood";
  Problem moved = problem;
  moved.points[0] += 1e-3;
  EXPECT_EQ(format_nvm(moved).value().find(" 0.9809789619797997 "), std::string::npos);
  EXPECT_EQ(nvm(format_nvm(moved).value()).poses[1].rotation, moved.poses[1].rotation);

  const OffNorms off = off_norms(problem);
  EXPECT_EQ(off.images, (std::vector<std::uint64_t>{1}));
  EXPECT_NEAR(off.largest, 0.0018, 1e-4);
  const std::vector<Finding> findings = check(problem);
  EXPECT_TRUE(std::any_of(findings.begin(), findings.end(),
                          [](const Finding& f) { return f.code == "rotation-norms"; }));
}

/// A frame's quaternion, and a sensor's, likewise.
TEST(KnownCases, QuaternionsOfFramesAreNormalisedOnceAnythingChanges) {
  ColmapFiles files = tiny_rigs();
  files.frames = replaced(files.frames, "0.80 0.6 0 0", "0.8016 0.6012 0 0");
  files.images = replaced(files.images, "0.80 0.60 0 0", "0.8016 0.6012 0 0");
  Problem problem = parse_colmap(files).value();
  EXPECT_EQ(off_norms(problem).images.size(), 2u);
  EXPECT_EQ(format_colmap(problem, true).value().frames, files.frames);
  problem.points[0] += 1e-3;
  const ColmapFiles now = format_colmap(problem, true).value();
  EXPECT_EQ(now.frames.find("0.8016"), std::string::npos) << now.frames;
  EXPECT_EQ(now.images.find("0.8016"), std::string::npos) << now.images;
  EXPECT_TRUE(off_norms(parse_colmap(now).value()).images.empty());
}

TEST(KnownCases, NamesInAnNvmMayHaveBlanks) {
  const std::string text = slurp("tests/data/three.nvm");
  for (const char* behind : {" ", "\t"}) {
    const Problem problem =
        nvm(replaced(text, "view1.jpg ", "my  view 1.jpg" + std::string(behind)));
    EXPECT_EQ(problem.metadata->image_names[1], "my  view 1.jpg");
    EXPECT_EQ(problem.metadata->image_names[2], "view2.jpg");
    EXPECT_NEAR(evaluate(problem).cost, kThreeCost, 1e-12);
    EXPECT_EQ(nvm(format_nvm(problem).value()).metadata->image_names,
              problem.metadata->image_names);
  }
  // Numbers may go on on further lines.
  EXPECT_NEAR(evaluate(nvm(replaced(text, "view1.jpg 1000.0 ", "view1.jpg 1000.0\n"))).cost,
              kThreeCost, 1e-12);
}

TEST(KnownCases, AModelOfPosesAloneHasAnEmptyTextOfPoints) {
  const Folder folder;
  const ColmapFiles files = tiny_text();
  std::filesystem::create_directory(folder / "m");
  spill(folder / "m/cameras.txt", files.cameras);
  spill(folder / "m/images.txt", "3 1 0 0 0 0 0 5 7 a.png\n\n1 1 0 0 0 0 1 5 7 b.png\n\n");
  spill(folder / "m/points3D.txt", "");
  const Problem problem = read(folder / "m").value();
  EXPECT_EQ(problem.num_images(), 2u);
  EXPECT_EQ(problem.num_points(), 0u);
  for (const char* format : {"colmap-text", "colmap"}) {
    write(problem, folder / format, {.format = format}).value();
    EXPECT_EQ(read(folder / format).value().num_images(), 2u) << format;
  }
  write(nvm("NVM_V3\n1\na 9 1 0 0 0 0 0 0 0 0\n0\n"), folder / "b.txt").value();
  EXPECT_EQ(read(folder / "b.txt").value().num_images(), 1u) << "BAL, without an observation";
  EXPECT_TRUE(std::filesystem::exists(folder / "colmap-text/points3D.txt"));
}

TEST(KnownCases, AFolderThatIsThereMayEndInASlash) {
  const Folder folder;
  std::filesystem::create_directory(folder / "m");
  EXPECT_TRUE(check_writable(folder / "m/", true).ok());
  EXPECT_TRUE(check_writable(folder / "n/", true).ok());
  EXPECT_FALSE(check_writable(folder / "n/m/", true).ok());
  EXPECT_EQ(folder.files(), 1u);
}

TEST(KnownCases, AByteOrderMarkIsNoPartOfAText) {
  const std::string mark = "\xef\xbb\xbf";
  ColmapFiles files = tiny_text();
  for (std::string* part : {&files.cameras, &files.images, &files.points}) *part = mark + *part;
  const Problem problem = parse_colmap(files).value();
  EXPECT_TRUE(same_state(problem, parse_colmap(tiny_text()).value()));
  EXPECT_EQ(format_colmap(problem, true).value().images, files.images);
  const Folder folder;
  for (const auto& [format, text] :
       {std::pair{"nvm", slurp("tests/data/three.nvm")}, {"bal", slurp("tests/data/z-zero.txt")}}) {
    spill(folder / "plain", text);
    spill(folder / "marked", mark + text);
    const InputFile marked = read_file(folder / "marked").value();
    EXPECT_EQ(marked.format, format);
    EXPECT_TRUE(same_state(marked.problem, read(folder / "plain").value()));
  }
}

/// "é" as one letter and as "e" with an accent; what is no UTF-8 is itself.
TEST(KnownCases, NamesAreEqualUpToUnicodesNormalForm) {
  const std::string one = "caf\xc3\xa9.jpg", two = "cafe\xcc\x81.jpg", latin1 = "caf\xe9.jpg";
  EXPECT_EQ(comparable_name(one), comparable_name(two));
  EXPECT_EQ(comparable_name(latin1), latin1);
  EXPECT_NE(comparable_name("cafe.jpg"), comparable_name(one));
  Problem a = seen_by({{CameraModel::pinhole, {500, 500, 320, 240}, 640, 480}}, 3, 6, 5), b = a;
  const auto named = [](Problem& problem, const std::string& first) {
    auto metadata = std::make_shared<SceneMetadata>();
    metadata->image_names = {first, "x", "y"};
    problem.metadata = metadata;
  };
  named(a, one), named(b, two);
  const Matching matching = match_models(a, b).value();
  EXPECT_EQ(matching.images.size(), 3u);
  EXPECT_TRUE(matching.only_in_estimate.empty());
}

TEST(KnownCases, WhatCannotBeReadBackIsNotWritten) {
  const Problem plain = seen_by({{CameraModel::pinhole, {500, 500, 320, 240}, 640, 480}}, 3, 6, 5);
  const auto complaint = [&](auto change, bool text) {
    auto metadata = std::make_shared<SceneMetadata>();
    change(*metadata);
    Problem problem = plain;
    problem.metadata = metadata;
    const Result<ColmapFiles> files = format_colmap(problem, text);
    EXPECT_FALSE(files.ok());
    return files.ok() ? std::string() : std::string(files.error().what());
  };
  for (const bool text : {false, true}) {
    EXPECT_NE(complaint(
                  [](SceneMetadata& m) {
                    m.image_ids = {4, 7, 4};
                  },
                  text)
                  .find("two images have the id 4"),
              std::string::npos);
    EXPECT_NE(complaint([](SceneMetadata& m) { m.point_ids = {1, 2, 3, 9, 9, 4}; }, text)
                  .find("two points have the id 9"),
              std::string::npos);
    EXPECT_NE(complaint(
                  [](SceneMetadata& m) {
                    m.image_names = {"a", std::string("b\0c", 3), "d"};
                  },
                  text)
                  .find("'b\\x00c' holds a zero byte"),
              std::string::npos);
  }
}

/// A model of two parameters is shorter than any that is known: it is named all the same.
TEST(KnownCases, AnUnknownCameraModelIsNamedBeforeAnyCountIsDoubted) {
  ColmapFiles files = tiny_binary();
  files.cameras = Bytes()
                      .add<std::uint64_t>(1)
                      .add<std::uint32_t>(1)
                      .add<std::int32_t>(99)
                      .add<std::uint64_t>(640)
                      .add<std::uint64_t>(480)
                      .add(640.0)
                      .add(480.0)
                      .take();
  const std::string message = parse_colmap(files).error().what();
  EXPECT_NE(message.find("found camera model 99"), std::string::npos) << message;
}

}  // namespace
}  // namespace sheaf
