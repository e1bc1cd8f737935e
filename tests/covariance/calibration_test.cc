// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "geometry/camera_model.h"
#include "sheaf/board.h"
#include "sheaf/covariance.h"
#include "sheaf/solve.h"

namespace sheaf {
namespace {

/// Ten views of thirty corners, one not found, some at half the resolution: drawn through a lens
/// of f 1400, 1410 with a noise of 0.3 px. tests run from the root of the project.
const char* const kCorners = "tests/data/board_corners.vnl";
constexpr Board kBoard{6, 5, 0.14};

Camera unknown_lens(CameraModel model) {
  Camera out;
  out.model = model;
  out.parameters = {};
  out.width_px = 1600, out.height_px = 1200;
  return out;
}

Problem calibrated(CameraModel model) {
  const auto views = read_board_corners(kCorners, kBoard).value();
  Problem p = calibration_of(kBoard, views, unknown_lens(model)).value();
  SolveOptions options;
  options.fixed.points = true;
  options.fixed.parameters = {0};
  options.tolerance = 1e-14;
  options.max_iterations = 200;
  solve(p, options);
  return p;
}

Covariance covariance_of(const Problem& p, double sigma) {
  CovarianceOptions options;
  options.fixed.points = true;
  options.fixed.parameters = {0};
  options.lens_motions = true;
  options.sigma = sigma;
  return covariance(p, options).value();
}

// The lens and its projection uncertainty as mrcal 2.2 has them (mrcal.optimize without
// regularisation and warp, mrcal.projection_uncertainty): distance (0: at infinity), pixel, sigma
// of the worst direction.
TEST(Calibration, AgreesWithMrcal) {
  const Problem p = calibrated(CameraModel::opencv);
  EXPECT_EQ(p.num_observations(), 299u);
  const double lens[] = {1400.46833645,  1410.9477958,    800.966053524,    592.774004521,
                         -0.11732425713, 0.0452673515766, 0.00101576081352, -0.000747159628118};
  const double reach[] = {1, 1, 1, 1, 1400, 1400, 1400, 1400};
  for (std::size_t k = 0; k < 8; ++k)
    EXPECT_NEAR(p.cameras[0].parameters[k], lens[k], 2e-4 / reach[k]) << k;
  const Covariance c = covariance_of(p, 0.283883472196);
  struct Node {
    double distance, x, y, sigma;
  };
  const Node nodes[] = {
      {0, 0, 0, 1.23164378371},       {0, 1200, 0, 1.09045963266},
      {0, 400, 600, 0.588903420861},  {0, 1600, 600, 1.21036700923},
      {0, 800, 1200, 0.784153467666}, {2, 0, 0, 0.755175725093},
      {2, 1200, 0, 0.358891077629},   {2, 400, 600, 0.176468047824},
      {2, 1600, 600, 0.515275860888}, {2, 800, 1200, 0.302408968838},
  };
  for (const double distance : {0.0, 2.0}) {
    const ProjectionUncertainty of =
        projection_uncertainty(p.cameras[0], c.lens_motions[0], {5, 3, distance}).value();
    ASSERT_EQ(of.pixels.size(), 15u);
    int found = 0;
    for (const Node& node : nodes)
      for (std::size_t k = 0; k < of.pixels.size(); ++k)
        if (node.distance == distance && of.pixels[k][0] == node.x && of.pixels[k][1] == node.y) {
          ++found;
          EXPECT_NEAR(of.worst_direction(k), node.sigma, 1e-6 * node.sigma) << node.x << node.y;
        }
    EXPECT_EQ(found, 5);
  }
}

/// A start without a stated focal length, for lenses of every formula.
TEST(Calibration, StartsFromHomographiesThroughAnyLens) {
  for (const CameraModel model :
       {CameraModel::simple_pinhole, CameraModel::radial, CameraModel::full_opencv,
        CameraModel::opencv_fisheye, CameraModel::thin_prism_fisheye, CameraModel::fov,
        CameraModel::eucm, CameraModel::rad_tan_thin_prism_fisheye, CameraModel::division,
        CameraModel::radial_k3, CameraModel::double_sphere, CameraModel::ucm}) {
    SCOPED_TRACE(to_string(model));
    const Problem p = calibrated(model);
    EXPECT_EQ(p.num_images(), 10u);
    // By the pixels near the axis: a double sphere's xi is a part of its focal length.
    const auto at = project(p.cameras[0], {1e-3, 0, 1}).pixel;
    EXPECT_NEAR((at[0] - project(p.cameras[0], {0, 0, 1}).pixel[0]) / 1e-3, 1400, 60);
    EXPECT_LT(evaluate(p).rms_px, 2.0);
  }
}

TEST(Calibration, ViewsThatCannotStartAreLeftOut) {
  auto views = read_board_corners(kCorners, kBoard).value();
  views[2].corners.resize(5), views[2].xy.resize(5), views[2].sigma.resize(5);
  views[4].corners.resize(6), views[4].xy.resize(6), views[4].sigma.resize(6);  // one row
  std::vector<std::string> left_out;
  const Problem p =
      calibration_of(kBoard, views, unknown_lens(CameraModel::opencv), &left_out).value();
  EXPECT_EQ(left_out, (std::vector<std::string>{"img002.jpg", "img004.jpg"}));
  EXPECT_EQ(p.num_images(), 8u);
}

TEST(Calibration, WhatMakesNoSenseIsRefused) {
  const auto views = read_board_corners(kCorners, kBoard).value();
  const auto words = [&](const Board& board, const Camera& lens) {
    const auto p = calibration_of(board, views, lens);
    return p.ok() ? std::string() : std::string(p.error().what());
  };
  Camera sizeless = unknown_lens(CameraModel::opencv);
  sizeless.width_px = 0;
  EXPECT_NE(words(kBoard, sizeless).find("size of the images"), std::string::npos);
  EXPECT_NE(words(kBoard, unknown_lens(CameraModel::bal)).find("BAL"), std::string::npos);
  EXPECT_NE(words(kBoard, unknown_lens(CameraModel::equirectangular)).find("EQUIRECTANGULAR"),
            std::string::npos);
  EXPECT_NE(words({6, 5, 0}, unknown_lens(CameraModel::opencv)).find("spacing"), std::string::npos);
  EXPECT_NE(words({5, 5, 1}, unknown_lens(CameraModel::opencv)).find("expected one below 25"),
            std::string::npos);
  const Camera lens = calibrated(CameraModel::opencv).cameras[0];
  EXPECT_FALSE(projection_uncertainty(lens, {1, 2, 3}).ok());
  EXPECT_FALSE(projection_uncertainty(lens, std::vector<double>(196, 0), {1, 3}).ok());
  EXPECT_FALSE(projection_uncertainty(sizeless, std::vector<double>(196, 0)).ok());
}

std::string refusal_of(const std::string& text) {
  const auto path = std::filesystem::temp_directory_path() /
                    ("sheaf-corners-" + std::to_string(::getpid()) + ".vnl");
  std::ofstream(path) << text;
  const auto read = read_board_corners(path.string(), {2, 2, 1});
  std::filesystem::remove(path);
  if (read.ok()) return "read";
  const std::string words = read.error().what();
  return words.substr(words.find(".vnl") + 4);
}

TEST(Calibration, CornersAreRefusedByLine) {
  EXPECT_EQ(refusal_of("# a comment\na 1 2\na 2 2\na - -\na 3 3 1\nb - - -\n"), "read");
  EXPECT_EQ(refusal_of("a 1 2\na 2 2\na x 2\n"), ":3: found 'x 2', expected the numbers X and Y");
  EXPECT_EQ(refusal_of("a 1 2\na 2 2\nb 1 1\n"),
            ":3: found 2 corners of image a, expected the board's 4");
  EXPECT_EQ(refusal_of("a 1 2\na 2 2\na 1 1\na 1 1\na 1 1\n"),
            ":5: found more corners of image a than the board's 4");
  EXPECT_EQ(refusal_of("a 1 2 99\n"), ":1: found '99', expected a level from 0 to 30");
  EXPECT_NE(refusal_of("a - -\nb - -\na - -\n").find("found image a again"), std::string::npos);
  EXPECT_NE(refusal_of("# nothing\n").find("found no corner"), std::string::npos);
}

}  // namespace
}  // namespace sheaf
