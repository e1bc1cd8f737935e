// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// g2o, SBA and nerfstudio, likewise by formulas of their own.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "io/bytes.h"
#include "io/g2o.h"
#include "io/nerfstudio.h"
#include "io/view_scene.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using namespace test;

// g2o

std::string g2o_of(const Scene& scene, bool parameters, const std::string& information) {
  std::string text = parameters ? "PARAMS_CAMERAPARAMETERS 0 500 330 220 0.1\n" : "";
  for (std::size_t j = 0; j < 2; ++j) {
    const Vec3 turn = scene.angle_axis(j);
    const double half = scene.turn[j] / 2;
    // world_from_camera: turned back.
    const std::array<double, 4> q{-std::sin(half) * (turn[0] != 0),
                                  -std::sin(half) * (turn[1] != 0), 0, std::cos(half)};
    text += (parameters ? "VERTEX_SE3:EXPMAP " : "VERTEX_CAM ") + std::to_string(j);
    for (const double x : scene.centre[j]) text += " " + text_of(x);
    for (const double x : q) text += " " + text_of(x);
    text += parameters ? "\n" : " 500 500 330 220 0.1\n";
  }
  for (std::size_t p = 0; p < scene.points.size(); ++p) {
    text += "VERTEX_XYZ " + std::to_string(10 + p);
    for (const double x : scene.points[p]) text += " " + text_of(x);
    text += "\n";
    for (std::size_t j = 0; j < 2; ++j) {
      const Vec2 u = pixel(straight(scene.in_camera(j, scene.points[p])));
      text += (parameters ? "EDGE_PROJECT_XYZ2UV:EXPMAP " : "EDGE_PROJECT_P2MC ") +
              std::to_string(10 + p) + " " + std::to_string(j) + (parameters ? " 0 " : " ") +
              text_of(u[0] + 2) + " " + text_of(u[1]) + " " + information + "\n";
    }
  }
  return text + "FIX 0\n";
}

TEST(G2o, ReadsBothKindsOfBundleAdjustment) {
  for (const bool parameters : {false, true}) {
    Notes notes;
    const Problem p = parse_g2o(g2o_of(Scene(), parameters, "4 0 4"), "f", notes).value();
    ASSERT_TRUE(validate(p).ok());
    EXPECT_EQ(p.cameras.size(), parameters ? 1u : 2u);
    EXPECT_EQ(p.metadata->point_ids[0], 10u);
    // Each of eight measurements is off by 2 px, of a sigma of a half: 1/2 8 (2 / 0.5)^2.
    EXPECT_NEAR(evaluate(p).cost, 64, 1e-12);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("--fix pose=0"), std::string::npos) << notes[0];
    const Problem plain = parse_g2o(g2o_of(Scene(), parameters, "1 0 1"), "f", notes).value();
    EXPECT_TRUE(plain.observation_sigma.empty());
  }
}

TEST(G2o, BrokenFilesAreRefusedWithTheirLine) {
  Notes notes;
  const std::string good = g2o_of(Scene(), false, "1 0 1");
  const auto message = [&](const std::string& text) {
    const Result<Problem> refused = parse_g2o(text, "f", notes);
    EXPECT_FALSE(refused.ok());
    return refused.ok() ? std::string() : std::string(refused.error().what());
  };
  EXPECT_TRUE(message("EDGE_PROJECT_P2SC 1 2 3\n").starts_with("f:1: found 'EDGE_PROJECT_P2SC'"));
  EXPECT_TRUE(
      message(good + "VERTEX_XYZ 10 0 0 0\n").starts_with("f:16: found vertex 10 a second"));
  EXPECT_TRUE(message(good + "VERTEX_XYZ 11 0 x 0\n").starts_with("f:16: found 'x'"));
  EXPECT_TRUE(
      message(good + "EDGE_PROJECT_P2MC 99 0 1 2 1 0 1\n").starts_with("f:16: found point 99"));
  EXPECT_TRUE(message(good + "EDGE_PROJECT_P2MC 10 0 1 2 1 0.5 1\n")
                  .starts_with("f:16: found an information matrix"));
}

// SBA

TEST(Sba, ReadsCamerasWithAndWithoutTheirLenses) {
  const Scene scene;
  const std::string lens = "500 330 220 1.1 0 ", bent = "-0.1 0.02 0.001 -0.002 0.003 ";
  for (const int kind : {0, 1, 2}) {
    SCOPED_TRACE(kind);
    const auto project = [&](const Vec3& P) {
      const Vec2 p = straight(P);
      return pixel(kind == 2 ? brown(p, {-0.1, 0.02, 0.003}, 0.001, -0.002) : p, 550);
    };
    std::string cameras = "# cameras\n", points;
    for (std::size_t j = 0; j < 2; ++j) {
      const double half = scene.turn[j] / 2;
      cameras += (kind == 0   ? ""
                  : kind == 1 ? lens
                              : lens + bent) +
                 text_of(std::cos(half)) + " " + text_of(j == 1 ? std::sin(half) : 0) + " " +
                 text_of(j == 0 ? std::sin(half) : 0) + " 0";
      for (const double t : scene.translation(j)) cameras += " " + text_of(t);
      cameras += "\n";
    }
    for (const Vec3& X : scene.points) {
      points += text_of(X[0]) + " " + text_of(X[1]) + " " + text_of(X[2]) + "  2 ";
      for (std::size_t j = 0; j < 2; ++j) {
        const Vec2 u = project(scene.in_camera(j, X));
        points += " " + std::to_string(j) + " " + text_of(u[0]) + " " + text_of(u[1]);
      }
      points += "\n";
    }
    const Folder folder;
    spill(folder / "2cams.txt", cameras);
    spill(folder / "2pts.txt", points);
    if (kind == 0) spill(folder / "calib.txt", "500 0 330\n0 550 220\n0 0 1\n");
    const InputFile file = read_file(folder / "", {.hash = true}).value();
    EXPECT_EQ(file.format, "sba");
    EXPECT_EQ(file.notes.size(), kind == 0 ? 1u : 0u);
    EXPECT_EQ(file.problem.cameras.size(), kind == 0 ? 1u : 2u);
    EXPECT_LT(evaluate(file.problem).cost, 1e-20);
    spill(folder / "2pts.txt", points + "0 0 0 1 2 5 5\n");
    const std::string message = read_file(folder / "").error().what();
    EXPECT_NE(message.find("2pts.txt:5: found '2', expected a frame below 2"), std::string::npos)
        << message;
  }
}

// nerfstudio

TEST(Nerfstudio, FramesAreWorldFromCameraOfOpenGl) {
  Problem p = seen_by(
      {{CameraModel::opencv, {500, 501, 320, 240, 0.01, 0.02, 1e-3, 2e-3}, 640, 480}}, 2, 5, 4);
  const FormatOutput out = format_nerfstudio(p).value();
  const JsonValue root = parse_json(out.text, "t").value();
  EXPECT_EQ(root.find("fl_y")->number, 501);
  EXPECT_EQ(root.find("p2")->number, 2e-3);
  EXPECT_EQ(root.find("ply_file_path")->text, out.beside[0].name);
  const JsonValue& rows = *root.find("frames")->items[1].find("transform_matrix");
  // A point one unit before the camera, in OpenGL's frame (0, 0, -1), is at depth 1.
  Vec3 world{};
  for (std::size_t r = 0; r < 3; ++r)
    world[r] = -rows.items[r].items[2].number + rows.items[r].items[3].number;
  const Matrix3<double> R = matrix_from_quaternion(p.poses[1].rotation);
  Vector3<double> camera = multiply(R, Vector3<double>{world[0], world[1], world[2]});
  for (std::size_t k = 0; k < 3; ++k) camera[k] += p.poses[1].translation[k];
  EXPECT_NEAR(camera[0], 0, 1e-12);
  EXPECT_NEAR(camera[1], 0, 1e-12);
  EXPECT_NEAR(camera[2], 1, 1e-12);
  EXPECT_TRUE(out.beside[0].bytes.starts_with("ply\nformat ascii 1.0\nelement vertex 5\n"));
}

}  // namespace
}  // namespace sheaf
