// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// OpenSfM, OpenMVG and AliceVision: texts put together here, with measurements by each program's
// own formulas, written down once more; their residuals are then 0.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "io/alicevision.h"
#include "io/models.h"
#include "io/openmvg.h"
#include "io/opensfm.h"
#include "io/view_scene.h"

namespace sheaf {
namespace {

using namespace test;

// OpenSfM

struct Opensfm {
  std::string reconstruction, tracks;
};

/// As OpenSfM and OpenMVG have it, in units of the larger side and from the middle.
Vec2 sphere(const Vec3& P) {
  const double longitude = std::atan2(P[0], P[2]);
  const double latitude = std::atan2(-P[1], std::hypot(P[0], P[2]));
  return {longitude / (2 * std::numbers::pi), -latitude / (2 * std::numbers::pi)};
}

Opensfm opensfm_of(const Scene& scene, const Stated& lens, const std::string& height = "480") {
  Opensfm out{"[{\"cameras\": {\"v2 a\": {" + lens.members +
                  ", \"width\": 640, \"height\": " + height + "}}, \"shots\": {",
              "OPENSFM_TRACKS_VERSION_v2\n"};
  for (std::size_t j = 0; j < 2; ++j) {
    const std::string name = j == 0 ? "a b.jpg" : "c.jpg";
    out.reconstruction += (j == 0 ? "\"" : ", \"") + name +
                          "\": {\"rotation\": " + list_of(scene.angle_axis(j)) +
                          ", \"translation\": " + list_of(scene.translation(j)) +
                          ", \"camera\": \"v2 a\", \"gps_dop\": " + text_of(5.5 + j) + "}";
    for (std::size_t p = 0; p < scene.points.size(); ++p) {
      const Vec2 u = lens.project(scene.in_camera(j, scene.points[p]));
      out.tracks += name + "\t" + std::to_string(p + 7) + "\t" + std::to_string(10 * p + j) + "\t" +
                    text_of(u[0]) + "\t" + text_of(u[1]) + "\t0.002\t1\t2\t3\t-1\t-1\n";
    }
  }
  out.reconstruction += "}, \"reference_lla\": {\"latitude\": 1.5}, \"points\": {";
  for (std::size_t p = 0; p < scene.points.size(); ++p)
    out.reconstruction += (p == 0 ? "\"" : ", \"") + std::to_string(p + 7) +
                          "\": {\"coordinates\": " + list_of(scene.points[p]) +
                          ", \"color\": [10.0, 20, 255]}";
  out.reconstruction += "}}]";
  out.tracks += "a b.jpg\t99\t5\t0.1\t0.1\t0.1\t0\t0\t0\t-1\t-1\n";
  return out;
}

/// Normalised by the larger side: focal lengths, principal points and measurements alike.
std::vector<Stated> opensfm_lenses() {
  const auto affine = [](double fx, double fy, double cx, double cy, const Vec2& p) {
    return Vec2{fx * p[0] + cx, fy * p[1] + cy};
  };
  return {{"\"projection_type\": \"perspective\", \"focal\": 0.9, \"k1\": -0.1, \"k2\": 0.02",
           [=](const Vec3& P) {
             return affine(0.9, 0.9, 0, 0, radial(straight(P), {-0.1, 0.02}));
           },
           CameraModel::radial},
          {"\"projection_type\": \"brown\", \"focal_x\": 0.9, \"focal_y\": 0.91, \"c_x\": 0.01, "
           "\"c_y\": "
           "-0.02, \"k1\": -0.1, \"k2\": 0.02, \"k3\": 0.003, \"p1\": 0.001, \"p2\": -0.002",
           [=](const Vec3& P) {
             return affine(0.9, 0.91, 0.01, -0.02,
                           brown(straight(P), {-0.1, 0.02, 0.003}, 0.001, -0.002));
           },
           CameraModel::full_opencv},
          {"\"projection_type\": \"radial\", \"focal_x\": 0.9, \"focal_y\": 0.91, \"c_x\": 0.01, "
           "\"c_y\": "
           "-0.02, \"k1\": -0.1, \"k2\": 0.02",
           [=](const Vec3& P) {
             return affine(0.9, 0.91, 0.01, -0.02, radial(straight(P), {-0.1, 0.02}));
           },
           CameraModel::opencv},
          {"\"projection_type\": \"fisheye\", \"focal\": 0.6, \"k1\": -0.03, \"k2\": 0.01",
           [=](const Vec3& P) {
             return affine(0.6, 0.6, 0, 0, radial(bent(P), {-0.03, 0.01}));
           },
           CameraModel::radial_fisheye},
          {"\"projection_type\": \"fisheye_opencv\", \"focal_x\": 0.6, \"focal_y\": 0.61, \"c_x\": "
           "0.01, "
           "\"c_y\": 0.02, \"k1\": -0.03, \"k2\": 0.01, \"k3\": 0.002, \"k4\": -0.001",
           [=](const Vec3& P) {
             return affine(0.6, 0.61, 0.01, 0.02, radial(bent(P), {-0.03, 0.01, 0.002, -0.001}));
           },
           CameraModel::opencv_fisheye},
          {"\"projection_type\": \"spherical\"", sphere, CameraModel::equirectangular}};
}

TEST(OpenSfm, ReadsItsLensesAndWritesThemBack) {
  for (const Stated& lens : opensfm_lenses()) {
    SCOPED_TRACE(lens.members);
    const bool whole = lens.model == CameraModel::equirectangular;
    const Opensfm files = opensfm_of(Scene(), lens, whole ? "320" : "480");
    Notes notes;
    const Problem p =
        parsed("opensfm", files.reconstruction, notes, holding("tracks.csv", files.tracks));
    ASSERT_TRUE(validate(p).ok());
    EXPECT_EQ(p.cameras[0].model, lens.model);
    EXPECT_EQ(p.num_observations(), 8u);
    EXPECT_LT(evaluate(p).cost, 1e-20);
    EXPECT_EQ(p.metadata->image_names[0], "a b.jpg");
    EXPECT_EQ(p.metadata->point_ids, (std::vector<std::uint64_t>{7, 8, 9, 10}));
    EXPECT_EQ(p.metadata->observation_feature[3], 30u);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_TRUE(notes[0].starts_with("1 lines of tracks.csv")) << notes[0];

    const FormatOutput out = format_opensfm(p).value();
    EXPECT_NE(out.text.find("\"gps_dop\": 6.5"), std::string::npos) << "what means nothing here";
    EXPECT_NE(out.text.find("\"reference_lla\": {\"latitude\": 1.5}"), std::string::npos);
    const Problem again =
        parsed("opensfm", out.text, notes, holding("tracks.csv", out.beside[0].bytes));
    EXPECT_EQ(again.poses[1].rotation, p.poses[1].rotation);
    EXPECT_EQ(again.observation_xy, p.observation_xy) << "as they were";
    EXPECT_LT(evaluate(again).cost, 1e-20);
    EXPECT_EQ(format_opensfm(again).value().text, out.text);
    EXPECT_EQ(format_opensfm(again).value().beside[0].bytes, out.beside[0].bytes);
    Problem moved = p;
    moved.points[0] += 0.01;
    const FormatOutput changed = format_opensfm(moved).value();
    const Problem third =
        parsed("opensfm", changed.text, notes, holding("tracks.csv", changed.beside[0].bytes));
    EXPECT_NEAR(evaluate(third).cost, evaluate(moved).cost, 1e-12 * evaluate(moved).cost);
  }
}

TEST(OpenSfm, WhatThereIsNoModelOfIsRefusedByName) {
  Notes notes;
  for (const auto& [what, message] :
       {std::pair{"\"projection_type\": \"brown\"", "f:1: found no \"focal_x\""},
        {"\"projection_type\": \"spherical\"",
         "f:1: found a spherical lens whose images are not twice as wide as high"},
        {"\"projection_type\": \"fisheye62\", \"focal_x\": 1, \"focal_y\": 1",
         "f:1: found 'fisheye62', expected a lens that Sheaf has a model of"}}) {
    const Opensfm files = opensfm_of(Scene(), {what, straight, CameraModel::bal});
    const JsonValue root = parse_json(files.reconstruction, "f").value();
    const Result<Problem> refused = parse_opensfm({files.reconstruction, "f", &root, {}, notes});
    ASSERT_FALSE(refused.ok());
    EXPECT_TRUE(std::string(refused.error().what()).starts_with(message)) << refused.error().what();
  }
}

// AliceVision

std::string alicevision_of(const Scene& scene, const Stated& lens, const std::string& version) {
  std::string text = "{\"version\": " + version +
                     ", \"featuresFolders\": [\"/f\"], \"intrinsics\": [{\"intrinsicId\": \"5\", "
                     "\"width\": \"640\", \"height\": \"480\", \"serialNumber\": \"s7\", " +
                     lens.members +
                     "}], \"views\": [{\"viewId\": \"77\", \"poseId\": \"4\", "
                     "\"intrinsicId\": \"6\", \"path\": \"unplaced.jpg\"}";
  std::string poses;
  for (std::size_t j = 0; j < 2; ++j) {
    const auto R = scene.rotation(j);
    text += ", {\"viewId\": \"" + std::to_string(20 + j) + "\", \"poseId\": \"" +
            std::to_string(30 + j) + "\", \"intrinsicId\": \"5\", \"path\": \"/p/" +
            std::to_string(j) + ".jpg\", \"metadata\": {\"Make\": \"x\"}}";
    poses += (j == 0 ? "" : ", ") + std::string("{\"poseId\": \"") + std::to_string(30 + j) +
             "\", \"pose\": {\"transform\": {\"rotation\": " +
             list_of(std::array{R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]}, "\"") +
             ", \"center\": " + list_of(scene.centre[j], "\"") + "}, \"locked\": \"0\"}}";
  }
  text += "], \"poses\": [" + poses + "], \"structure\": [";
  for (std::size_t p = 0; p < scene.points.size(); ++p) {
    text += (p == 0 ? "" : ", ") + std::string("{\"landmarkId\": \"") + std::to_string(p + 3) +
            "\", \"descType\": \"sift\", \"color\": [\"1\", \"2\", \"200\"], \"X\": " +
            list_of(scene.points[p], "\"") + ", \"observations\": [";
    for (std::size_t j = 0; j < 2; ++j)
      text += (j == 0 ? "" : ", ") + std::string("{\"observationId\": \"") +
              std::to_string(20 + j) + "\", \"featureId\": \"" + std::to_string(10 * p + j) +
              "\", \"x\": " + list_of(lens.project(scene.in_camera(j, scene.points[p])), "\"") +
              ", \"scale\": \"1.5\"}";
    text += "]}";
  }
  return text + "]}";
}

TEST(AliceVision, ReadsWhatEachVersionStatesDifferently) {
  const auto project = [](const Vec3& P) { return pixel(radial(straight(P), {-0.1})); };
  const auto two = [](const Vec3& P) { return pixel(radial(straight(P), {-0.1}), 550); };
  const std::string top = "\"principalPoint\": [\"330\", \"220\"], ";
  const std::string off = "\"principalPoint\": [\"10\", \"-20\"], ";
  const std::string mm = "\"sensorWidth\": \"32\", \"focalLength\": \"";
  const std::string one = "\"distortionParams\": [\"-0.1\"], \"type\": \"radial1\"";
  const std::string split =
      "\"distortionParams\": [\"-0.1\"], \"type\": \"pinhole\", \"distortionType\": \"radialk1\", "
      "\"undistortionType\": \"none\"";
  struct Case {
    std::string version, members;
    bool two_focals;
  };
  for (const Case& c :
       {Case{"[\"1\", \"0\", \"0\"]", top + "\"pxFocalLength\": \"500\", " + one, false},
        Case{"[\"1\", \"2\", \"0\"]", top + "\"pxFocalLength\": [\"500\", \"550\"], " + one, true},
        Case{"[\"1\", \"2\", \"1\"]", off + "\"pxFocalLength\": [\"500\", \"550\"], " + one, true},
        Case{"[\"1\", \"2\", \"2\"]",
             off + mm + "25\", \"pixelRatio\": \"" + text_of(500.0 / 550) + "\", " + one, true},
        Case{"[\"1\", \"2\", \"6\"]", off + mm + "25\", \"pixelRatio\": \"1.1\", " + one, true},
        Case{"[\"1\", \"2\", \"8\"]", off + mm + "25\", \"pixelRatio\": \"1.1\", " + split, true},
        Case{"[1, 2, 11]", off + mm + "27.5\", \"pixelRatio\": \"1.1\", " + split, true},
        Case{"[1, 2, 14]", off + mm + "25\", \"pixelRatio\": \"1\", " + split, false}}) {
    SCOPED_TRACE(c.version);
    Notes notes;
    const Stated lens{c.members, c.two_focals ? std::function<Vec2(const Vec3&)>(two) : project,
                      CameraModel::simple_radial};
    const Problem p = parsed("alicevision", alicevision_of(Scene(), lens, c.version), notes);
    EXPECT_LT(evaluate(p).cost, 1e-20);
    EXPECT_EQ(p.cameras[0].model, c.two_focals ? CameraModel::opencv : CameraModel::simple_radial);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_TRUE(notes[0].starts_with("1 of 3 views have no pose")) << notes[0];
  }
}

TEST(AliceVision, ReadsItsLensesAndWritesThemBack) {
  const std::string off =
      "\"principalPoint\": [\"10\", \"-20\"], \"sensorWidth\": \"32\", \"focalLength\": \"25\", "
      "\"pixelRatio\": \"1\", ";
  for (const Stated& lens : std::vector<Stated>{
           {"\"type\": \"pinhole\", \"distortionParams\": \"\"",
            [](const Vec3& P) { return pixel(straight(P)); }, CameraModel::simple_pinhole},
           {"\"type\": \"radial3\", \"distortionParams\": [\"-0.1\", \"0.02\", \"0.003\"]",
            [](const Vec3& P) {
              return pixel(radial(straight(P), {-0.1, 0.02, 0.003}));
            },
            CameraModel::radial_k3},
           {"\"type\": \"brown\", \"distortionParams\": [\"-0.1\", \"0.02\", \"0.003\", \"0.001\", "
            "\"-0.002\"]",
            [](const Vec3& P) {
              return pixel(brown(straight(P), {-0.1, 0.02, 0.003}, 0.001, -0.002));
            },
            CameraModel::full_opencv},
           {"\"type\": \"fisheye4\", \"distortionParams\": [\"-0.03\", \"0.01\", \"0.002\", "
            "\"-0.001\"]",
            [](const Vec3& P) {
              return pixel(radial(bent(P), {-0.03, 0.01, 0.002, -0.001}));
            },
            CameraModel::opencv_fisheye},
           {"\"type\": \"fisheye1\", \"distortionParams\": [\"0.9\"]",
            [](const Vec3& P) {
              const Vec2 p = straight(P);
              const double r = std::hypot(p[0], p[1]);
              const double k = std::atan(2 * r * std::tan(0.45)) / 0.9 / r;
              return pixel({k * p[0], k * p[1]});
            },
            CameraModel::fov}}) {
    SCOPED_TRACE(lens.members);
    Notes notes;
    const Stated whole{off + lens.members, lens.project, lens.model};
    const Problem p =
        parsed("alicevision", alicevision_of(Scene(), whole, "[\"1\", \"2\", \"6\"]"), notes);
    ASSERT_TRUE(validate(p).ok());
    EXPECT_LT(evaluate(p).cost, 1e-20);
    EXPECT_EQ(p.cameras[0].model, lens.model);
    EXPECT_EQ(p.metadata->image_ids, (std::vector<std::uint32_t>{20, 21}));
    const std::string text = format_alicevision(p).value().text;
    for (const char* kept : {"unplaced.jpg", "\"serialNumber\": \"s7\"", "\"Make\": \"x\"",
                             "\"featuresFolders\": [\"/f\"]", "\"poseId\": \"31\""})
      EXPECT_NE(text.find(kept), std::string::npos) << kept;
    const Problem again = parsed("alicevision", text, notes);
    EXPECT_TRUE(same_state(again, p));
    EXPECT_EQ(format_alicevision(again).value().text, text);
  }
}

/// A lens of fewer coefficients than its model has stays one when it is refined.
TEST(AliceVision, CoefficientsThatItsLensHasNotAreHeld) {
  Notes notes;
  const Stated lens{
      "\"principalPoint\": [\"10\", \"-20\"], \"focalLength\": \"25\", \"type\": \"brown\", "
      "\"distortionParams\": [\"-0.1\", \"0.02\", \"0.003\", \"0.001\", \"-0.002\"]",
      straight, CameraModel::full_opencv};
  const Problem p =
      parsed("alicevision", alicevision_of(Scene(), lens, "[\"1\", \"2\", \"6\"]"), notes);
  // fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6
  EXPECT_EQ(held_parameters(p, {})[0], 0b111000001100);
  Fixed asked;
  asked.parameters = {0b1100};
  EXPECT_EQ(held_parameters(p, asked)[0], 0b1100);
}

/// cam_from_world of a view of a rig is its sub-pose after the rig's.
TEST(AliceVision, ViewsOfRigsHaveTheirSubPose) {
  Scene scene;
  Notes notes;
  const Stated lens{
      "\"principalPoint\": [\"10\", \"-20\"], \"sensorWidth\": \"32\", \"focalLength\": \"25\", "
      "\"type\": \"pinhole\", \"distortionParams\": \"\"",
      [](const Vec3& P) { return pixel(straight(P)); }, CameraModel::simple_pinhole};
  std::string text = alicevision_of(scene, lens, "[\"1\", \"2\", \"6\"]");
  // The second view's pose is the first's, and its sub-pose what leads from there to its own.
  const auto A = scene.rotation(0), B = scene.rotation(1);
  std::array<double, 9> R{};  // B A^T
  for (std::size_t r = 0; r < 3; ++r)
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t k = 0; k < 3; ++k) R[3 * r + c] += B[3 * r + k] * A[3 * c + k];
  const Vec3 C = scene.in_camera(0, scene.centre[1]);
  const std::string stated = "\"viewId\": \"21\", \"poseId\": \"31\"";
  text.replace(text.find(stated), stated.size(),
               "\"viewId\": \"21\", \"poseId\": \"30\", \"rigId\": \"9\", \"subPoseId\": \"1\", "
               "\"isPoseIndependant\": \"false\"");
  const std::string sub = "{\"status\": \"estimated\", \"pose\": {\"rotation\": ";
  text.insert(text.find("\"structure\""),
              "\"rigs\": [{\"rigId\": \"9\", \"subPoses\": [" + sub +
                  "[\"1\", \"0\", \"0\", \"0\", \"1\", \"0\", \"0\", \"0\", \"1\"], \"center\": "
                  "[\"0\", \"0\", \"0\"]}}, " +
                  sub +
                  list_of(std::array{R[0], R[3], R[6], R[1], R[4], R[7], R[2], R[5], R[8]}, "\"") +
                  ", \"center\": " + list_of(C, "\"") + "}}]}], ");
  const Problem p = parsed("alicevision", text, notes);
  EXPECT_LT(evaluate(p).cost, 1e-20);
  EXPECT_LT(evaluate(parsed("alicevision", format_alicevision(p).value().text, notes)).cost, 1e-18);
}

// OpenMVG

std::string openmvg_of(const Scene& scene, const Stated& lens) {
  std::string views, poses, points;
  for (std::size_t j = 0; j < 3; ++j) {
    const std::string key = std::to_string(20 + j);
    views += (j == 0 ? "" : ",\n") + std::string("{\"key\": ") + key +
             ", \"value\": {\"polymorphic_id\": 1073741824, \"ptr_wrapper\": {\"id\": " +
             std::to_string(2147483649 + j) +
             ", \"data\": {\"local_path\": \"p/\", \"filename\": \"" + key +
             ".jpg\", \"width\": 640, \"height\": 480, \"id_view\": " + key +
             ", \"id_intrinsic\": 5, \"id_pose\": " + std::to_string(j < 2 ? 30 + j : 4294967295) +
             "}}}}";
    if (j == 2) break;
    const auto R = scene.rotation(j);
    poses += (j == 0 ? "" : ",") + std::string("{\"key\": ") + std::to_string(30 + j) +
             ", \"value\": {\"rotation\": [" + list_of(std::array{R[0], R[1], R[2]}) + ", " +
             list_of(std::array{R[3], R[4], R[5]}) + ", " + list_of(std::array{R[6], R[7], R[8]}) +
             "], \"center\": " + list_of(scene.centre[j]) + "}}";
  }
  for (std::size_t p = 0; p < scene.points.size(); ++p) {
    points += (p == 0 ? "" : ",\n") + std::string("{\"key\": ") + std::to_string(p + 3) +
              ", \"value\": {\"X\": " + list_of(scene.points[p]) + ", \"observations\": [";
    for (std::size_t j = 0; j < 2; ++j)
      points += (j == 0 ? "" : ", ") + std::string("{\"key\": ") + std::to_string(20 + j) +
                ", \"value\": {\"id_feat\": " + std::to_string(10 * p + j) +
                ", \"x\": " + list_of(lens.project(scene.in_camera(j, scene.points[p]))) + "}}";
    points += "]}}";
  }
  return "{\"sfm_data_version\": \"0.3\", \"root_path\": \"/images\", \"views\": [" + views +
         "], \"intrinsics\": [" + lens.members + "], \"extrinsics\": [" + poses +
         "], \"structure\": [" + points + "], \"control_points\": []}";
}

std::string openmvg_lens(const std::string& type, const std::string& coefficients,
                         std::uint64_t key = 5) {
  return "{\"key\": " + std::to_string(key) +
         ", \"value\": {\"polymorphic_id\": 2147483649, \"polymorphic_name\": \"" + type +
         "\", \"ptr_wrapper\": {\"id\": 2147483654, \"data\": {\"width\": 640, \"height\": 480, "
         "\"focal_length\": 500, \"principal_point\": [330, 220]" +
         coefficients + "}}}}";
}

std::string openmvg_sphere(int width, int height) {
  return "{\"key\": 5, \"value\": {\"polymorphic_id\": 2147483649, \"polymorphic_name\": "
         "\"spherical\", \"ptr_wrapper\": {\"id\": 2147483654, \"data\": {\"value0\": "
         "{\"width\": " +
         std::to_string(width) + ", \"height\": " + std::to_string(height) + "}}}}}";
}

/// Both scale the two angles alike, by the larger side; w and h of EQUIRECTANGULAR may differ.
TEST(OpenMvg, OfPanoramasItHasWholeOnes) {
  Notes notes;
  const Stated narrow{openmvg_sphere(640, 480), sphere, CameraModel::equirectangular};
  const std::string text = openmvg_of(Scene(), narrow);
  const JsonValue root = parse_json(text, "f").value();
  const Result<Problem> refused = parse_openmvg({text, "f", &root, {}, notes});
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(std::string(refused.error().what()).find("twice as wide as high"), std::string::npos);
  const Problem other =
      test::seen_by({{CameraModel::equirectangular, {640, 480}, 640, 480}}, 2, 5, 1);
  EXPECT_FALSE(format_openmvg(other).ok());
  EXPECT_FALSE(format_opensfm(other).ok());
}

TEST(OpenMvg, ReadsItsLensesAndWritesThemBack) {
  for (const Stated& lens : std::vector<Stated>{
           {openmvg_lens("pinhole", ""), [](const Vec3& P) { return pixel(straight(P)); },
            CameraModel::simple_pinhole},
           {openmvg_lens("pinhole_radial_k1", ", \"disto_k1\": [-0.1]"),
            [](const Vec3& P) { return pixel(radial(straight(P), {-0.1})); },
            CameraModel::simple_radial},
           {openmvg_lens("pinhole_radial_k3", ", \"disto_k3\": [-0.1, 0.02, 0.0]"),
            [](const Vec3& P) {
              return pixel(radial(straight(P), {-0.1, 0.02}));
            },
            CameraModel::radial},
           {openmvg_lens("pinhole_radial_k3", ", \"disto_k3\": [-0.1, 0.02, 0.003]"),
            [](const Vec3& P) {
              return pixel(radial(straight(P), {-0.1, 0.02, 0.003}));
            },
            CameraModel::radial_k3},
           {openmvg_lens("pinhole_brown_t2", ", \"disto_t2\": [-0.1, 0.02, 0.003, 0.001, -0.002]"),
            [](const Vec3& P) {
              return pixel(brown(straight(P), {-0.1, 0.02, 0.003}, 0.001, -0.002));
            },
            CameraModel::full_opencv},
           {openmvg_lens("fisheye", ", \"fisheye\": [-0.03, 0.01, 0.002, -0.001]"),
            [](const Vec3& P) {
              return pixel(radial(bent(P), {-0.03, 0.01, 0.002, -0.001}));
            },
            CameraModel::opencv_fisheye},
           {openmvg_sphere(640, 320),
            [](const Vec3& P) {
              return Vec2{640 * sphere(P)[0] + 320, 640 * sphere(P)[1] + 160};
            },
            CameraModel::equirectangular}}) {
    SCOPED_TRACE(lens.members);
    Notes notes;
    const Problem p = parsed("openmvg", openmvg_of(Scene(), lens), notes);
    ASSERT_TRUE(validate(p).ok());
    EXPECT_LT(evaluate(p).cost, 1e-20);
    EXPECT_EQ(p.cameras[0].model, lens.model);
    EXPECT_EQ(p.metadata->image_names[1], "p/21.jpg");
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_TRUE(notes[0].starts_with("1 of 3 views")) << notes[0];
    const std::string text = format_openmvg(p).value().text;
    EXPECT_NE(text.find("\"22.jpg\""), std::string::npos) << "the view that has no pose";
    EXPECT_NE(text.find("\"root_path\": \"/images\""), std::string::npos);
    const Problem again = parsed("openmvg", text, notes);
    EXPECT_TRUE(same_state(again, p));
    EXPECT_EQ(format_openmvg(again).value().text, text);
  }
}

TEST(OpenMvg, TypesAndPointersAreNamedWhereTheyOccurFirst) {
  Notes notes;
  std::string second = openmvg_lens("x", "", 6);
  const std::string named = "2147483649, \"polymorphic_name\": \"x\"";
  second.replace(second.find(named), named.size(), "1");
  const std::string data = second.substr(second.find("\"ptr_wrapper\""));
  const Stated lens{openmvg_lens("pinhole", "") + ", " + second.substr(0, second.find(data)) +
                        "\"ptr_wrapper\": {\"id\": 6}}}",
                    [](const Vec3& P) { return pixel(straight(P)); }, CameraModel::simple_pinhole};
  const Problem p = parsed("openmvg", openmvg_of(Scene(), lens), notes);
  ASSERT_EQ(p.cameras.size(), 2u);
  EXPECT_EQ(p.cameras[1].parameters, p.cameras[0].parameters);
  Problem two = p;
  two.cameras[0].model = CameraModel::pinhole;
  two.cameras[0].parameters = {500, 501, 330, 220};
  EXPECT_NE(std::string(format_openmvg(two).error().what()).find("fx and fy"), std::string::npos);
}

}  // namespace
}  // namespace sheaf
