// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "chart/number_text.h"
#include "end_to_end/command.h"
#include "sheaf/io.h"
#include "survey/exif_jpeg.h"
#include "survey/survey_scene.h"

namespace sheaf {
namespace {

using Words = std::vector<std::string>;
using nlohmann::json;

/// A generated model and surveys of it, in a folder where the command runs.
class ConstraintsCommand : public testing::Test {
 protected:
  ConstraintsCommand() : made_(12) {
    write(made_.scene.start, folder_ / "model", {.format = "colmap"}).value();
    made_.add_positions(0.5, positions_);
    made_.add_points(8, SurveyRole::control, 0.02, 5, points_);
    made_.add_points(4, SurveyRole::check, 0.02, 900, points_);
    write_text(folder_ / "positions.json", survey_of(positions_).dump(1));
    write_text(folder_ / "points.json", survey_of(points_).dump(1));
  }

  Outcome run(const Words& words) { return run_command(words, folder_.path()); }
  /// The command with its JSON, which it writes to out.json.
  json document_of(Words words) {
    words.insert(words.end(), {"--json", "out.json"});
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return json_of(folder_ / "out.json");
  }

  static json survey_of(const Constraints& c) {
    json positions = json::array(), points = json::array();
    for (const ImagePosition& p : c.positions)
      positions.push_back({{"image", p.image}, {"xyz", p.at}, {"sigma", 0.5}});
    for (const SurveyPoint& point : c.points) {
      json marks = json::array();
      for (const SurveyMark& mark : point.marks)
        marks.push_back({{"image", mark.image}, {"pixel", mark.pixel}});
      points.push_back({{"id", point.id},
                        {"role", point.role == SurveyRole::check ? "check" : "control"},
                        {"xyz", point.at},
                        {"sigma", point.sigma},
                        {"marks", marks}});
    }
    return {{"frame", {{"kind", "projected"}, {"name", "EPSG:32633"}}},
            {"positions", positions},
            {"points", points}};
  }

  TemporaryFolder folder_;
  const SurveyScene made_;
  Constraints positions_, points_;
};

TEST_F(ConstraintsCommand, SolveAdjustsReportsAndWritesTheFrame) {
  const json document =
      document_of({"solve", "model", "-o", "adjusted", "--constraints", "positions.json",
                   "--constraints", "points.json", "--residuals", "residuals.csv"});
  const json& survey = document["survey"];
  EXPECT_EQ(survey["paths"], (json{"positions.json", "points.json"}));
  EXPECT_EQ(survey["frame"]["kind"], "projected");
  EXPECT_EQ(survey["frame"]["name"], "EPSG:32633");
  EXPECT_TRUE(survey["moved"]);
  EXPECT_NEAR(survey["scale"], SurveyScene::kScale, 1);
  EXPECT_EQ(survey["positions"], 12);
  const json& residuals = survey["residuals"];
  EXPECT_EQ(residuals["control"].size(), 8u);
  EXPECT_EQ(residuals["check"].size(), 4u);
  for (const double x : residuals["control_rmse"]) EXPECT_LT(x, 0.1);
  for (const double x : residuals["check_rmse"]) EXPECT_LT(x, 0.5);
  // The file beside the model, and what it leads back to.
  const json frame = json_of(folder_ / "adjusted/frame.json");
  EXPECT_EQ(frame, survey["frame"]);
  const Problem adjusted = read(folder_ / "adjusted").value();
  EXPECT_EQ(adjusted.num_points(), made_.scene.start.num_points());
  const std::string csv = contents_of(folder_ / "residuals.csv");
  EXPECT_TRUE(csv.starts_with("kind,name,image,residual_x,"));
  EXPECT_NE(csv.find("\ncheck," + points_.points[8].id + ","), std::string::npos);
  EXPECT_NE(csv.find("\nposition," + made_.name(0) + ","), std::string::npos);
}

TEST_F(ConstraintsCommand, ThePageTellsWhatIsKnownWithTheSurvey) {
  ASSERT_EQ(run({"solve", "model", "--constraints", "points.json,positions.json", "--report",
                 "a.html", "--sigmas", "sigmas.json"})
                .exit_code,
            0);
  const std::string page = contents_of(folder_ / "a.html");
  EXPECT_NE(
      page.find("The survey fixes where the scene lies, how it is turned and how large it is."),
      std::string::npos);
  EXPECT_EQ(page.find("rests on no measurement"), std::string::npos);
  // Each image's sigmas are those of the same survey's covariance.
  const json known = json_of(folder_ / "sigmas.json");
  EXPECT_EQ(known["gauge"]["deficit"], 0);
  std::size_t found = 0;
  for (const json& image : known["images"]) {
    double place = 0;
    for (const double sigma : image["center_sigma"]) place += sigma * sigma;
    found += page.find("<td>" + digits(std::sqrt(place), 2) + "</td><td>") != std::string::npos;
  }
  EXPECT_EQ(found, 12u);
}

TEST_F(ConstraintsCommand, CheckTellsWhatWouldBeUsed) {
  json survey = survey_of(positions_);
  survey["positions"][2]["image"] = "nowhere.jpg";
  write_text(folder_ / "some.json", survey.dump(1));
  const Outcome outcome = run({"check", "model", "--constraints", "some.json,points.json"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("survey      some.json, points.json: 11 of 12 positions used, 8 "
                             "control, 4 check and 0 tie points, 0 scale bars"),
            std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find("            frame projected EPSG:32633, less "), std::string::npos);
  EXPECT_NE(outcome.out.find("the model was turned, shifted and scaled by "), std::string::npos);
  EXPECT_NE(outcome.out.find("not used    some.json:"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find(": the model has no image 'nowhere.jpg'"), std::string::npos);
}

TEST_F(ConstraintsCommand, BadFilesAreErrorsWithTheirPlace) {
  write_text(folder_ / "bad.json", "{\n\"pints\": []}");
  write_text(folder_ / "wgs.txt", "WGS84\n13 52 100 1 2 " + made_.name(0) + " p\n");
  std::filesystem::create_directory(folder_.path() / "empty");
  const struct {
    Words files;
    int code;
    std::string expected;
  } kCases[] = {
      {{"bad.json"}, 3, "bad.json:2: found the key 'pints', expected one of a survey"},
      {{"none.json"}, 3, "none.json"},
      {{"empty"}, 3, "empty: found no .jpg or .jpeg in the folder, expected images"},
      {{"positions.json", "wgs.txt"}, 3, "wgs.txt: found coordinates of a frame that is geodetic"},
      {{"positions.json", "positions.json"}, 3, "positions.json:"},
  };
  for (const auto& [files, code, expected] : kCases) {
    Words words = {"solve", "model", "-o", "out"};
    for (const std::string& file : files) words.insert(words.end(), {"--constraints", file});
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_NE(outcome.err.find(expected), std::string::npos) << outcome.err;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  }
  const Outcome alone = run({"solve", "model", "--residuals", "r.csv"});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_NE(alone.err.find("--residuals is for --constraints"), std::string::npos) << alone.err;
}

TEST_F(ConstraintsCommand, AlignMovesAndAdjustsNothing) {
  json wrong = survey_of(positions_);
  wrong["positions"][3]["xyz"][1] = double(wrong["positions"][3]["xyz"][1]) + 80;
  write_text(folder_ / "wrong.json", wrong.dump(1));
  const Words words = {"align",       "model",         "-o",         "placed",        "--to",
                       "positions",   "--constraints", "wrong.json", "--constraints", "points.json",
                       "--residuals", "r.csv"};
  const json document = document_of(words);
  const json& survey = document["survey"];
  EXPECT_EQ(document["alignment"]["places"], 12);
  EXPECT_EQ(document["alignment"]["inliers"], 11);
  EXPECT_EQ(survey["outliers"][0]["name"], "the position of '" + made_.name(3) + "'");
  EXPECT_EQ(survey["residuals"]["positions"][0]["name"], made_.name(3));
  EXPECT_EQ(survey["residuals"]["control"].size(), 8u);
  EXPECT_EQ(json_of(folder_ / "placed/frame.json"), survey["frame"]);
  EXPECT_TRUE(contents_of(folder_ / "r.csv").starts_with("kind,name,"));
  // Only the frame is another one.
  const Problem placed = read(folder_ / "placed").value(), model = read(folder_ / "model").value();
  const double cost = evaluate(model).cost;
  EXPECT_NEAR(evaluate(placed).cost, cost, 1e-9 * cost);
  const Outcome outcome = run(words);
  EXPECT_NE(outcome.out.find("outlier     the position of '" + made_.name(3) + "' is "),
            std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find("wrote       placed/frame.json\n"), std::string::npos);
}

TEST_F(ConstraintsCommand, AlignByControlPointsAndRigidly) {
  const json by_points = document_of(
      {"align", "model", "-o", "placed", "--to", "control", "--constraints", "points.json"});
  EXPECT_EQ(by_points["alignment"]["places"], 8);
  EXPECT_NEAR(by_points["alignment"]["scale"], SurveyScene::kScale, 1);
  const json rigid =
      document_of({"align", "model", "-o", "placed", "--rigid", "--constraints", "points.json"});
  EXPECT_EQ(rigid["alignment"]["scale"], 1);
  EXPECT_TRUE(rigid["alignment"]["rigid"]);
}

TEST_F(ConstraintsCommand, AlignRefusesWhatSaysNothing) {
  const struct {
    Words words;
    int code;
    std::string expected;
  } kCases[] = {
      {{}, 2, "onto what? --reference MODEL or --constraints FILE"},
      {{"--reference", "model", "--constraints", "points.json"}, 2, "onto what?"},
      {{"--reference", "model", "--to", "control"}, 2, "--to is for --constraints"},
      {{"--reference", "model", "--residuals", "r.csv"}, 2, "--residuals is for --constraints"},
      {{"--constraints", "points.json", "--least-squares"}, 2, "--least-squares is for"},
      {{"--constraints", "points.json", "--to", "positions"},
       3,
       "points.json: found 0 positions that can be used, expected three"},
  };
  for (const auto& [more, code, expected] : kCases) {
    Words words = {"align", "model", "-o", "out"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, code) << outcome.err;
    EXPECT_NE(outcome.err.find(expected), std::string::npos) << outcome.err;
  }
}

TEST_F(ConstraintsCommand, ImagesOfAFolderSayWhereTheyWereTaken) {
  const WorldFrame berlin{WorldKind::geodetic, "", std::array<double, 3>{52.5, 13.4, 34}};
  std::filesystem::create_directory(folder_.path() / "images");
  for (std::size_t j = 0; j < 12; ++j) {
    std::array<double, 3> at = made_.true_centre(j);
    for (std::size_t k = 0; k < 3; ++k) at[k] -= made_.far[k];
    const auto world = to_world(berlin, at);
    const std::string name = std::filesystem::path(made_.name(j)).stem().string() + ".jpg";
    write_text(folder_ / ("images/" + name), test::exif_jpeg(world[0], world[1], world[2]));
  }
  Problem renamed = made_.scene.start;
  auto metadata = std::make_shared<SceneMetadata>(*renamed.metadata);
  for (std::string& name : metadata->image_names)
    name = "left/" + std::filesystem::path(name).stem().string() + ".jpg";
  renamed.metadata = metadata;
  write(renamed, folder_ / "renamed", {.format = "colmap"}).value();
  const json document =
      document_of({"solve", "renamed", "-o", "adjusted", "--constraints", "images"});
  EXPECT_EQ(document["survey"]["frame"]["kind"], "geodetic");
  EXPECT_EQ(document["survey"]["positions"], 12);
  for (const double x : document["survey"]["residuals"]["positions_rmse"]) EXPECT_LT(x, 0.5);
}

}  // namespace
}  // namespace sheaf
