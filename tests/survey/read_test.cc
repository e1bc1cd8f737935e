// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "sheaf/survey.h"

namespace sheaf {
namespace {

std::string refusal(const std::string& text) {
  const Result<Constraints> read = parse_constraints(text, "s.json");
  return read.ok() ? "read" : read.error().what();
}

TEST(SurveyRead, BadSurveysAreToldWithFileAndLine) {
  const std::string position = R"({"image": "a", "xyz": [1, 2, 3], "sigma": 1})";
  const std::string point = R"({"id": 1, "xyz": [1, 2, 3], "sigma": 1, "marks": []})";
  const struct {
    std::string text, expected;
  } kCases[] = {
      {"[]", "s.json:1: found a list of 0, expected an object: a survey"},
      {"{\n\"pints\": []}", "s.json:2: found the key 'pints', expected one of a survey: frame"},
      {"{\"positions\": [\n{\"image\": \"a\", \"xyz\": [1, 2, 3], \"sigma\": 0}]}",
       "s.json:2: found 0, expected \"sigma\" above 0"},
      {"{\"positions\": [\n{\"image\": \"a\", \"xyz\": [1, 2, 3], \"sigma\": [1, 1, -1]}]}",
       "s.json:2: found -1, expected \"sigma\" above 0"},
      {"{\"positions\": [\n{\"image\": \"a\", \"xyz\": [1, 2], \"sigma\": 1}]}",
       "s.json:2: found a list of 2, expected \"xyz\": a list of 3 finite numbers"},
      {"{\"positions\": [\n{\"image\": \"a\", \"xyz\": [1, 2, 1e999], \"sigma\": 1}]}",
       "s.json:2: "},
      {"{\"positions\": [\n{\"image\": \"a\", \"xyz\": [1, 2, null], \"sigma\": 1}]}",
       "s.json:2: found null, expected \"xyz\""},
      {"{\"positions\": [\n{\"image\": \"a\", \"lat_lon_height\": [1, 2, 3], \"sigma\": 1}]}",
       "s.json:2: found \"lat_lon_height\" of a position, expected \"xyz\""},
      {"{\"frame\": {\"kind\": \"geodetic\"}, \"positions\": [\n" + position + "]}",
       "s.json:2: found \"xyz\" of a position, expected \"lat_lon_height\""},
      {"{\"positions\": [" + position + ",\n" + position + "]}",
       "s.json:2: found a second position of image 'a', expected one (line 1)"},
      {"{\"points\": [" + point + ",\n" + point + "]}",
       "s.json:2: found the id '1' a second time, expected ids of their own (line 1)"},
      {"{\"scale_bars\": [\n{\"first\": 1, \"second\": 2, \"distance\": 1, \"sigma\": 1}]}",
       "s.json:2: found a scale bar at point '1', expected the id of one of the points"},
      {"{\"positions\": [\n{\"image\": \"a\", \"xyz\": [1, 2, 3]}]}",
       "s.json:2: found no \"sigma\", expected one in this object"},
      {"EPSG:32633\n1 2 3 4 5\n1 2 x 4 5 a.jpg\n", "s.json:3: found 'x'"},
      {"some grid\na.jpg 1 2 3\n", "s.json:1: found 'some grid', expected the frame"},
      {"EPSG:32633\na.jpg 1 2 3 0 0 0 0 1\n", "s.json:2: found '1', expected a horizontal and"},
      {"label,x,y,z\na,1,2,3\n", "s.json:1: found no accuracies"},
      {"label,x,y,z,accuracy\na,1,2,3,0\n", "s.json:2: found an accuracy of 0 or less"},
      {"label,lon,lat,alt,accuracy\na,1,2,three,1\n", "s.json:2: found 'three' in column 4"},
  };
  for (const auto& [text, expected] : kCases)
    EXPECT_TRUE(refusal(text).starts_with(expected)) << text << "\n" << refusal(text);
}

TEST(SurveyRead, TheExampleOfThePageIsRead) {
  std::ifstream page("docs/constraints.md");
  std::stringstream all;
  all << page.rdbuf();
  const std::string text = all.str();
  const std::size_t begin = text.find("```json\n") + 8, end = text.find("```", begin);
  ASSERT_LT(end, text.size());
  const Constraints c = parse_constraints(text.substr(begin, end - begin), "page").value();
  EXPECT_EQ(c.frame.kind, WorldKind::projected);
  EXPECT_EQ(c.positions.size(), 2u);
  EXPECT_EQ(c.positions[0].loss.kind, LossKind::cauchy);
  EXPECT_EQ(c.points.size(), 3u);
  EXPECT_EQ(c.points[0].marks[1].sigma_px, 0.5);
  EXPECT_EQ(c.rotations.size() + c.gravities.size() + c.scale_bars.size() + c.lenses.size(), 5u);
  EXPECT_EQ(c.lenses[0].value, 3650);
  EXPECT_FALSE(c.lenses[1].value);
  EXPECT_EQ(c.lenses[1].lower, -0.3);
  EXPECT_EQ(c.lenses[1].upper, 0);
}

TEST(SurveyRead, FilesOfOtherProgramsAreRead) {
  const Constraints gcp = parse_constraints(
                              "EPSG:32633\n"
                              "500001.5 4649999 300 100 200 a.jpg tower\n"
                              "500001.5 4649999 300 110 210 b.jpg tower\n"
                              "# a comment\n"
                              "500011.5 4649989 301 110 210 b.jpg\n",
                              "gcp_list.txt")
                              .value();
  ASSERT_EQ(gcp.points.size(), 2u);
  EXPECT_EQ(gcp.points[0].id, "tower");
  EXPECT_EQ(gcp.points[0].marks.size(), 2u);
  EXPECT_EQ(gcp.points[0].marks[1].pixel[0], 110.5);
  EXPECT_EQ(gcp.frame.kind, WorldKind::projected);

  const Constraints geo = parse_constraints(
                              "EPSG:4326\na.jpg 13.4 52.5 34 1 2 3 0.5 0.9\n"
                              "b.jpg 13.5 52.6 35\n",
                              "geo.txt")
                              .value();
  ASSERT_EQ(geo.positions.size(), 2u);
  EXPECT_EQ(geo.positions[0].at, (std::array<double, 3>{52.5, 13.4, 34}));
  EXPECT_DOUBLE_EQ(geo.positions[0].covariance[8], 0.81);
  EXPECT_EQ(geo.notes.size(), 1u);

  const Constraints table =
      parse_constraints(
          "#Label,X/Longitude,Y/Latitude,Z/Altitude,Accuracy_XY (m),Accuracy_Z (m)\n"
          "a.jpg,13.4,52.5,34,0.02,0.05\n",
          "positions.csv")
          .value();
  ASSERT_EQ(table.positions.size(), 1u);
  EXPECT_EQ(table.frame.kind, WorldKind::geodetic);
  EXPECT_DOUBLE_EQ(table.positions[0].covariance[0], 0.0004);
}

TEST(SurveyFrame, GeodeticCoordinatesComeBack) {
  const WorldFrame frame{WorldKind::geodetic, "", std::array<double, 3>{52.5, 13.4, 34}};
  const std::array<double, 3> up = to_local(frame, {52.5, 13.4, 44});
  EXPECT_NEAR(up[0], 0, 1e-8);
  EXPECT_NEAR(up[1], 0, 1e-8);
  EXPECT_NEAR(up[2], 10, 1e-8);
  // A thousandth of a degree to the north is 111 metres.
  EXPECT_NEAR(to_local(frame, {52.501, 13.4, 34})[1], 111.27, 0.02);
  const std::array<double, 3> back = to_world(frame, to_local(frame, {52.6, 13.2, 100}));
  EXPECT_NEAR(back[0], 52.6, 1e-12);
  EXPECT_NEAR(back[1], 13.2, 1e-12);
  EXPECT_NEAR(back[2], 100, 1e-7);
}

}  // namespace
}  // namespace sheaf
