// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/survey.h"
#include "survey/survey_scene.h"

namespace sheaf {
namespace {

const char* const kOpensfm = R"({"points": [
  {"id": "0", "position": {"latitude": 52.5, "longitude": 13.25, "altitude": 14.5},
   "observations": [{"shot_id": "a.jpg", "projection": [-0.25, 0.125]},
                    {"shot_id": "b.jpg", "projection": [0.5, -0.375], "uid": 7}]},
  {"id": "1", "observations": []},
  {"id": "2", "position": {"latitude": 52.5, "longitude": 13.25}, "observations": []}]})";

std::string refusal(const std::string& text) {
  const Result<Constraints> read = parse_constraints(text, "g.json");
  return read.ok() ? "read" : read.error().what();
}

TEST(SurveyFiles, PointsOfOpensfmAreRead) {
  const Constraints c = parse_constraints(kOpensfm, "g.json").value();
  EXPECT_EQ(c.frame.kind, WorldKind::geodetic);
  ASSERT_EQ(c.points.size(), 3u);
  EXPECT_EQ(c.points[0].at, (std::array<double, 3>{52.5, 13.25, 14.5}));
  EXPECT_EQ(c.points[0].sigma, (std::array<double, 3>{0.01, 0.01, 0.1}));
  ASSERT_EQ(c.points[0].marks.size(), 2u);
  EXPECT_TRUE(c.points[0].marks[1].normalised);
  EXPECT_EQ(c.points[0].marks[1].pixel, (std::array<double, 2>{0.5, -0.375}));
  EXPECT_EQ(c.points[0].marks[1].line, 4u);
  EXPECT_EQ(c.points[1].role, SurveyRole::tie);
  // A height that is not stated says nothing.
  EXPECT_EQ(c.points[2].sigma, (std::array<double, 3>{0.01, 0.01, 1e4}));
}

TEST(SurveyFiles, BadPointsOfOpensfmAreToldWithLine) {
  const std::string position = R"("position": {"latitude": 1, "longitude": 2, "altitude": 3})";
  const struct {
    std::string point, expected;
  } kCases[] = {
      {R"({"observations": []})", "g.json:2: found no \"id\", expected one in this object"},
      {R"({"id": 1, "observations": 3})", "g.json:2: found 3, expected \"observations\": a list"},
      {R"({"id": 1, "observations": [7]})", "g.json:2: found 7, expected an observation"},
      {R"({"id": 1, "observations": [{"shot_id": "a"}]})", "g.json:2: found no \"projection\""},
      {R"({"id": 1, "observations": [{"shot_id": "a", "projection": [1]}]})",
       "g.json:2: found a list of 1, expected \"projection\": a list of 2 finite numbers"},
      {R"({"id": 1, "position": [1, 2, 3], "observations": []})",
       "g.json:2: found a list of 3, expected \"position\": an object of latitude"},
      {R"({"id": 1, "position": {"latitude": 95, "longitude": 2}, "observations": []})",
       "g.json:2: found a latitude or longitude out of range"},
      {R"({"id": 1, "position": {"longitude": 2}, "observations": []})",
       "g.json:2: found no \"latitude\""},
      {R"({"id": 1, )" + position + R"(, "observations": []}, {"id": 1, "observations": []})",
       "g.json:2: found the id '1' a second time"},
  };
  for (const auto& [point, expected] : kCases) {
    // Another point has observations, so that it is a file of OpenSfM.
    const std::string text =
        "{\"points\": [{\"id\": \"x\", \"observations\": []},\n" + point + "]}";
    EXPECT_TRUE(refusal(text).starts_with(expected)) << point << "\n" << refusal(text);
  }
}

TEST(SurveyFiles, AHeightOfNanIsNotKnown) {
  const Constraints c = parse_constraints(
                            "EPSG:32633\n500001.5 4649999 NaN 100 200 a.jpg tower\n"
                            "500001.5 4649999 nan 110 210 b.jpg tower\n",
                            "gcp_list.txt")
                            .value();
  ASSERT_EQ(c.points.size(), 1u);
  EXPECT_EQ(c.points[0].at[2], 0);
  EXPECT_EQ(c.points[0].sigma[2], 1e4);
  EXPECT_EQ(c.points[0].marks[0].pixel[0], 100.5);
}

class SurveyMerge : public testing::Test {
 protected:
  Result<Constraints> read(const std::vector<std::string>& texts) {
    std::vector<std::filesystem::path> paths;
    for (std::size_t i = 0; i < texts.size(); ++i) {
      paths.emplace_back(folder_ / std::string(1, static_cast<char>('a' + i)));
      write_text(paths.back(), texts[i]);
    }
    return read_constraints(paths);
  }
  /// With the names of files alone.
  std::string refusal(const std::vector<std::string>& texts) {
    const Result<Constraints> got = read(texts);
    std::string out = got.ok() ? "read" : got.error().what();
    const std::string folder = folder_.path().string() + "/";
    while (out.find(folder) != std::string::npos) out.erase(out.find(folder), folder.size());
    return out;
  }
  TemporaryFolder folder_;
};

const char* const kGeo = "EPSG:32633\na.jpg 500000 4600000 100\nb.jpg 500010 4600000 100\n";
const char* const kGcp = "EPSG:32633\n500001 4600000 100 1 2 a.jpg p\n";

TEST_F(SurveyMerge, SeveralFilesAreOneSurvey) {
  const Constraints c =
      read(
          {kGeo, kGcp,
           R"({"points": [{"id": "t", "role": "tie", "marks": [{"image": "a.jpg", "pixel": [1, 2]}]}],
                "scale_bars": [{"first": "p", "second": "t", "distance": 1, "sigma": 1}]})"})
          .value();
  EXPECT_EQ(c.paths.size(), 3u);
  EXPECT_EQ(c.frame.kind, WorldKind::projected);
  EXPECT_EQ(c.frame.name, "EPSG:32633");
  EXPECT_EQ(c.positions.size(), 2u);
  ASSERT_EQ(c.points.size(), 2u);
  EXPECT_EQ(c.points[0].file, 1u);
  EXPECT_EQ(c.points[1].marks[0].file, 2u);
  EXPECT_EQ(c.scale_bars[0].file, 2u);
}

TEST_F(SurveyMerge, ContradictionsNameBothFiles) {
  EXPECT_EQ(refusal({kGeo, kGeo}),
            "b:2: found a second position of image 'a.jpg', expected one (a:2)");
  EXPECT_EQ(refusal({kGcp, kGcp}),
            "b:2: found the id 'p' a second time, expected ids of their own (a:2)");
  EXPECT_EQ(refusal({kGeo, "WGS84\n13 52 100 1 2 a.jpg p\n"}),
            "b: found coordinates of a frame that is geodetic (WGS84), expected one that is "
            "projected (EPSG:32633) as in a: frames of the world are mixed");
  EXPECT_EQ(refusal({kGeo, "EPSG:32634\n500001 4600000 100 1 2 a.jpg p\n"}),
            "b: found coordinates of a frame that is projected (EPSG:32634), expected one that is "
            "projected (EPSG:32633) as in a: frames of the world are mixed");
  const std::string origin = R"({"frame": {"kind": "projected", "origin": [1, 2, 3]}, "positions": [
    {"image": ")";
  EXPECT_EQ(refusal({origin + R"(c", "xyz": [1, 2, 3], "sigma": 1}]})",
                     R"({"frame": {"kind": "projected", "origin": [1, 2, 4]}, "positions": [
                         {"image": "d", "xyz": [1, 2, 3], "sigma": 1}]})"}),
            "b: found another origin, expected the same as in a: frames of the world are mixed");
}

TEST(SurveyPlaces, NormalisedMarksAreCountedInTheImagesOfTheModel) {
  const SurveyScene made;
  Constraints pixels = made.frame(), normalised;
  made.add_points(6, SurveyRole::control, 0.02, 5, pixels);
  normalised = pixels;
  const Camera& camera = made.scene.start.cameras[0];
  const double width = double(camera.width_px), height = double(camera.height_px);
  ASSERT_GT(width, height);
  for (SurveyPoint& point : normalised.points)
    for (SurveyMark& mark : point.marks) {
      mark.pixel = {(mark.pixel[0] - width / 2) / width, (mark.pixel[1] - height / 2) / width};
      mark.normalised = true;
    }
  Problem a = made.scene.start, b = made.scene.start;
  (void)place_survey(a, pixels).value();
  (void)place_survey(b, normalised).value();
  ASSERT_EQ(a.observation_xy.size(), b.observation_xy.size());
  for (std::size_t i = 0; i < a.observation_xy.size(); ++i)
    EXPECT_NEAR(a.observation_xy[i], b.observation_xy[i], 1e-9);

  Problem unknown = made.scene.start;
  unknown.cameras[0].width_px = 0;
  const Result<Survey> refused = place_survey(unknown, normalised);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(std::string(refused.error().what())
                .find("counts in the size of the image, which the model does not have"),
            std::string::npos)
      << refused.error().what();
}

TEST(SurveyPlaces, TwoNamesOfOneImageAreRefused) {
  const SurveyScene made;
  Constraints c = made.frame();
  made.add_positions(0.5, c);
  c.positions[5].image = "photos/" + made.name(4);
  c.positions[5].file = 1;
  c.paths.push_back("other.csv");
  Problem problem = made.scene.start;
  const Result<Survey> refused = place_survey(problem, c);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(std::string(refused.error().what()),
            "other.csv:6: found a second position of the image 'photos/" + made.name(4) +
                "' of the model, expected one (survey.json:5, of '" + made.name(4) + "')");
}

TEST(SurveyPlaces, AMotionAloneIsFoundByWhatIsAskedFor) {
  const SurveyScene made;
  Constraints c = made.frame();
  made.add_positions(0.5, c);
  made.add_points(8, SurveyRole::control, 0.02, 5, c);
  for (ImagePosition& p : c.positions) p.at[2] += 40;  // the antenna's error, not the points'
  Problem problem = made.scene.start;
  const Survey by_points = move_to_survey(problem, c, {.by = SurveyTies::control}).value();
  EXPECT_EQ(by_points.ties, 8u);
  const SurveyReport report = finish_survey(problem, by_points);
  EXPECT_TRUE(problem.terms.empty());
  EXPECT_EQ(problem.num_points(), made.scene.start.num_points());
  ASSERT_EQ(report.positions.size(), 40u);
  EXPECT_NEAR(report.positions_rmse[2], 40, 2);
  EXPECT_LT(report.control_rmse[2], 1);

  Problem other = made.scene.start;
  const Survey by_positions = move_to_survey(other, c, {.by = SurveyTies::positions}).value();
  EXPECT_LT(finish_survey(other, by_positions).positions_rmse[2], 2);
  Problem rigid = made.scene.start;
  EXPECT_EQ(move_to_survey(rigid, c, {.rigid = true}).value().scale, 1);

  c.positions.resize(2);
  Problem few = made.scene.start;
  const Result<Survey> refused = move_to_survey(few, c, {.by = SurveyTies::positions});
  ASSERT_FALSE(refused.ok());
  EXPECT_TRUE(std::string(refused.error().what())
                  .starts_with("survey.json: found 2 positions that can be used, expected three"))
      << refused.error().what();
  EXPECT_EQ(state_hash(few), state_hash(made.scene.start));
}

}  // namespace
}  // namespace sheaf
