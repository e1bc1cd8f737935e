// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "end_to_end/command.h"
#include "sheaf/survey.h"
#include "survey/exif_gps.h"
#include "survey/exif_jpeg.h"

namespace sheaf {
namespace {

using test::exif_jpeg;

std::string refusal(const std::filesystem::path& path) {
  const Result<Constraints> read = read_constraints(path);
  return read.ok() ? "read" : read.error().what();
}

TEST(SurveyExif, AFolderOfImagesGivesTheirPositions) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder.path() / "sub");
  write_text(folder / "a.JPG", exif_jpeg(52.519134104, 13.400740745, 34.5));
  write_text(folder / "sub/b.jpeg", exif_jpeg(-33.85, -70.5, -12.25));
  write_text(folder / "c.jpg", "\xff\xd8\xff\xd9");
  write_text(folder / "notes.txt", "no image");
  const Constraints c = read_constraints(folder.path()).value();
  EXPECT_EQ(c.frame.kind, WorldKind::geodetic);
  ASSERT_EQ(c.positions.size(), 2u);
  EXPECT_EQ(c.positions[0].image, "a.JPG");
  EXPECT_NEAR(c.positions[0].at[0], 52.519134104, 1e-8);
  EXPECT_NEAR(c.positions[0].at[1], 13.400740745, 1e-8);
  EXPECT_NEAR(c.positions[0].at[2], 34.5, 1e-9);
  EXPECT_EQ(c.positions[0].covariance, (Covariance3{25, 0, 0, 0, 25, 0, 0, 0, 100}));
  EXPECT_EQ(c.positions[1].image, "sub/b.jpeg");
  EXPECT_NEAR(c.positions[1].at[0], -33.85, 1e-8);
  EXPECT_NEAR(c.positions[1].at[1], -70.5, 1e-8);
  EXPECT_NEAR(c.positions[1].at[2], -12.25, 1e-9);
  ASSERT_EQ(c.notes.size(), 1u);
  EXPECT_NE(c.notes[0].find("1 of 3 images in"), std::string::npos) << c.notes[0];
  EXPECT_NE(c.notes[0].find("c.jpg: it has no EXIF"), std::string::npos) << c.notes[0];
  // One image alone.
  EXPECT_EQ(read_constraints(folder / "a.JPG").value().positions.at(0).image, "a.JPG");
}

TEST(SurveyExif, AStatedErrorIsTheSigma) {
  const std::string stated =
      exif_jpeg({test::letter(1, 'N'), test::angle(2, 10), test::letter(3, 'W'), test::angle(4, 20),
                 test::one_number(0x1f, 2.5)});
  const TemporaryFolder folder;
  write_text(folder / "a.jpg", stated);
  const Constraints c = read_constraints(folder / "a.jpg").value();
  EXPECT_DOUBLE_EQ(c.positions.at(0).covariance[0], 6.25);
  EXPECT_DOUBLE_EQ(c.positions.at(0).at[1], -20);
  // No height is stated: it is nowhere near what is.
  EXPECT_EQ(c.positions.at(0).at[2], 0);
  EXPECT_EQ(c.positions.at(0).covariance[8], 1e8);
}

TEST(SurveyExif, WhatGivesNoPositionIsToldWithTheReason) {
  const TemporaryFolder folder;
  EXPECT_NE(refusal(folder.path()).find("found no .jpg or .jpeg in the folder, expected images"),
            std::string::npos);
  const auto why = [&](const std::string& bytes) {
    write_text(folder / "a.jpg", bytes);
    return refusal(folder.path());
  };
  const auto of = [](double latitude, char north, double longitude, char east) {
    return exif_jpeg({test::letter(1, north), test::angle(2, latitude), test::letter(3, east),
                      test::angle(4, longitude)});
  };
  const std::string whole = exif_jpeg(52.5, 13.4, 34);
  const struct {
    std::string bytes, expected;
  } kCases[] = {
      {"\xff\xd8\xff\xda", "a.jpg: it has no EXIF"},
      {"no JPEG", "a.jpg: it has no EXIF"},
      {whole.substr(0, 60), "a.jpg: it has no EXIF"},
      {exif_jpeg({}), "a.jpg: it has no GPS position"},
      {exif_jpeg({test::letter(1, 'N'), test::angle(2, 3)}), "a.jpg: it has no GPS position"},
      {exif_jpeg({{2, 5, 3, std::string(24, '\0')}, {4, 5, 3, std::string(24, '\0')}}),
       "a.jpg: it has no GPS position"},
      {of(0, 'N', 0, 'E'), "a.jpg: its latitude and longitude are 0"},
      {of(91, 'N', 3, 'E'), "a.jpg: its latitude or longitude is out of range"},
      {of(9, 'W', 3, 'E'), "a.jpg: its latitude or longitude is of no direction N, S, E or W"},
  };
  for (const auto& [bytes, expected] : kCases) {
    const std::string said = why(bytes);
    EXPECT_NE(said.find("found no image with a GPS position, expected one at least (" + expected),
              std::string::npos)
        << said;
  }
}

TEST(SurveyExif, TruncatedBlocksAreReadWithinTheirBytes) {
  const std::string whole = exif_jpeg(52.5, 13.4, 34);
  const std::size_t begin = whole.find("Exif");
  const std::string block = whole.substr(begin, whole.size() - 2 - begin);
  EXPECT_TRUE(exif_gps(block).position.has_value());
  for (std::size_t size = 0; size < block.size(); ++size)
    EXPECT_EQ(exif_gps(std::string(block, 0, size)).position.has_value(),
              exif_gps(std::string(block, 0, size)).why_not.empty());
}

}  // namespace
}  // namespace sheaf
