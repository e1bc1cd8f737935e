// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/colmap.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <set>

#include "geometry/camera_model.h"
#include "io/bytes.h"
#include "io/models.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using namespace test;

void expect_same_files(const ColmapFiles& a, const ColmapFiles& b) {
  EXPECT_EQ(a.cameras, b.cameras);
  EXPECT_EQ(a.images, b.images);
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.rigs, b.rigs);
  EXPECT_EQ(a.frames, b.frames);
}

void expect_tiny(const Problem& p) {
  ASSERT_TRUE(validate(p).ok());
  ASSERT_EQ(p.cameras.size(), 2u);
  EXPECT_EQ(p.cameras[0].model, CameraModel::simple_radial);
  EXPECT_EQ(p.cameras[0].parameters[3], -0.01);
  EXPECT_EQ(p.cameras[0].width_px, 640u);
  EXPECT_EQ(p.cameras[1].model, CameraModel::opencv);
  EXPECT_EQ(p.cameras[1].parameters[7], -0.0004);
  EXPECT_EQ(p.image_camera, (std::vector<std::uint32_t>{0, 1, 1}));
  EXPECT_EQ(p.poses[1].translation[0], -0.5);
  EXPECT_EQ(p.poses[0].rotation, (std::array<double, 4>{0.8, 0.6, 0, 0}));
  EXPECT_EQ(p.points, (std::vector<double>{0.125, 0.5, -0.25, -0.125, 0.5, -0.25}));
  EXPECT_EQ(p.observation_image, (std::vector<std::uint32_t>{1, 0, 0}));
  EXPECT_EQ(p.observation_point, (std::vector<std::uint32_t>{0, 0, 1}));
  EXPECT_EQ(p.observation_xy, (std::vector<double>{900.5, 500.25, 300.5, 200.25, 310.5, 210.25}));
  const SceneMetadata& m = *p.metadata;
  EXPECT_EQ(m.camera_ids, (std::vector<std::uint32_t>{7, 3}));
  EXPECT_EQ(m.image_ids, (std::vector<std::uint32_t>{12, 4, 9}));
  EXPECT_EQ(m.image_names, (std::vector<std::string>{"left image.png", "b.png", "sub/c.png"}));
  EXPECT_EQ(m.point_ids, (std::vector<std::uint64_t>{41, 5}));
  EXPECT_EQ(m.point_colours[1], (std::array<std::uint8_t, 3>{11, 20, 255}));
  EXPECT_EQ(m.point_errors_px, (std::vector<double>{1.75, 0.5}));
  EXPECT_EQ(m.feature_begin, (std::vector<std::uint64_t>{0, 3, 5, 5}));
  EXPECT_EQ(m.observation_feature, (std::vector<std::uint32_t>{1, 0, 2}));
  EXPECT_EQ(m.feature_xy[2], 10);
}

TEST(Colmap, ReadsBinaryAndText) {
  expect_tiny(parse_colmap(tiny_binary()).value());
  expect_tiny(parse_colmap(tiny_text()).value());
}

TEST(Colmap, WritesWhatItReadByteForByte) {
  ColmapFiles binary = tiny_binary();
  expect_same_files(format_colmap(parse_colmap(binary).value(), false).value(), binary);
  binary.rigs = rigs_binary();
  binary.frames = frames_binary();
  expect_same_files(format_colmap(parse_colmap(binary).value(), false).value(), binary);
  const ColmapFiles text = tiny_text();
  expect_same_files(format_colmap(parse_colmap(text).value(), true).value(), text);
}

TEST(Colmap, TextAndBinaryTurnIntoEachOther) {
  const Problem from_text = parse_colmap(tiny_text()).value();
  const ColmapFiles binary = format_colmap(from_text, false).value();
  expect_same_files(binary, tiny_binary());
  const ColmapFiles text = format_colmap(parse_colmap(binary).value(), true).value();
  const Problem again = parse_colmap(text).value();
  EXPECT_TRUE(same_state(again, from_text));
  EXPECT_EQ(again.metadata->image_names, from_text.metadata->image_names);
  EXPECT_EQ(again.metadata->feature_xy, from_text.metadata->feature_xy);
  EXPECT_EQ(again.metadata->point_errors_px, from_text.metadata->point_errors_px);
}

/// Windows line ends and a last line without its end are text all the same.
TEST(Colmap, TakesAnyLineEnds) {
  ColmapFiles text = tiny_text();
  for (std::string* part : {&text.cameras, &text.images, &text.points}) {
    std::string lines;
    for (const char c : *part) lines += c == '\n' ? "\r\n" : std::string(1, c);
    *part = lines;
  }
  text.cameras.resize(text.cameras.size() - 2);
  const Problem problem = parse_colmap(text).value();
  expect_tiny(problem);
  expect_same_files(format_colmap(problem, true).value(), text);
}

/// A quaternion of six digits is no unit quaternion: poses are rotations, files stay as they were.
TEST(Colmap, NormalisesRotationsAndWritesThemAsStated) {
  ColmapFiles text = tiny_text();
  const std::string stated = "0.983789 0.00113517 0.176825 -0.0298644";
  text.images.replace(text.images.find("0.80 0.60 0 0"), 13, stated);
  const Problem problem = parse_colmap(text).value();
  double norm2 = 0;
  for (const double q : problem.poses[0].rotation) norm2 += q * q;
  EXPECT_NEAR(norm2, 1, 1e-15);
  EXPECT_NE(problem.poses[0].rotation[0], 0.983789);
  expect_same_files(format_colmap(problem, true).value(), text);
  const Problem binary = parse_colmap(format_colmap(problem, false).value()).value();
  EXPECT_EQ(binary.metadata->stated_rotations[0], 0.983789);
  EXPECT_TRUE(same_state(binary, problem));
}

/// What moved is stated anew, lines that nothing touched are as they stood.
TEST(Colmap, RestatesOnlyWhatChanged) {
  const ColmapFiles text = tiny_text();
  Problem problem = parse_colmap(text).value();
  problem.poses[1].translation[0] = 1e-5;
  const ColmapFiles now = format_colmap(problem, true).value();
  EXPECT_EQ(now.cameras, text.cameras);
  std::string images = text.images;
  images.replace(images.find("4 0.8 0.6 0 0 -.5 0.25 5 3 b.png"), 32,
                 "4 0.8 0.6 0 0 1e-05 0.25 5 3 b.png");
  EXPECT_EQ(now.images, images);
  // Errors of points are of the state that is written.
  const Problem again = parse_colmap(now).value();
  EXPECT_NE(again.metadata->point_errors_px[0], 1.75);
  EXPECT_NEAR(again.metadata->point_errors_px[1], std::sqrt(2 * evaluate(again).cost), 400);
  EXPECT_TRUE(same_state(again, problem));
  EXPECT_EQ(again.metadata->feature_xy, problem.metadata->feature_xy);
}

TEST(Colmap, ErrorsOfPointsAreMeansOfTheirResiduals) {
  Problem problem =
      seen_by({{CameraModel::simple_radial, {500, 320, 240, 0.02}, 640, 480}}, 3, 5, 1);
  problem.observation_xy[0] += 3;  // image 0, point 0
  problem.observation_xy[1] += 4;
  const Problem again = parse_colmap(format_colmap(problem, false).value()).value();
  EXPECT_NEAR(again.metadata->point_errors_px[0], 5.0 / 3, 1e-9);
  EXPECT_NEAR(again.metadata->point_errors_px[1], 0, 1e-9);
}

TEST(Colmap, PosesOfFramesFollowTheirImages) {
  ColmapFiles binary = tiny_binary();
  binary.rigs = rigs_binary();
  binary.frames = frames_binary();
  Problem problem = parse_colmap(binary).value();
  problem.poses[1].translation[0] = 0.75;  // image 4
  const ColmapFiles now = format_colmap(problem, false).value();
  EXPECT_EQ(now.rigs, binary.rigs);
  std::string frames = binary.frames;
  const double moved = 0.75;
  frames.replace(8 + 4 + 4 + 32, 8, reinterpret_cast<const char*>(&moved), 8);
  EXPECT_EQ(now.frames, frames);
  EXPECT_TRUE(lost_in("colmap", problem).empty());
}

void expect_binary_stands_for(const Problem& problem) {
  const auto files = format_colmap(problem, false);
  if (problem.cameras[0].model == CameraModel::double_sphere) {
    ASSERT_FALSE(files.ok());
    EXPECT_NE(std::string(files.error().what()).find("DOUBLE_SPHERE"), std::string::npos);
    EXPECT_EQ(can_hold("colmap", problem).error().code(), ErrorCode::usage);
    return;
  }
  const Problem again = parse_colmap(files.value()).value();
  EXPECT_GE(colmap_id(again.cameras[0].model), 0);
  EXPECT_EQ(lost_in("colmap", problem).size(), 1u);
  for (const std::array<double, 3>& P : {std::array{0.1, -0.2, 1.0}, {-0.3, 0.1, 0.8}}) {
    const auto before = project(problem.cameras[0], P).pixel;
    const auto after = project(again.cameras[0], P).pixel;
    for (std::size_t k = 0; k < 2; ++k) EXPECT_NEAR(before[k], after[k], 1e-12);
  }
}

/// Every camera model goes through both forms, those without a number by name alone: the binary
/// form has what sees the same, or refuses.
TEST(Colmap, HoldsEveryCameraModel) {
  for (std::size_t i = 1; i < kCameraModels; ++i) {
    Camera camera{static_cast<CameraModel>(i), {}, 640, 480};
    camera.parameters.fill(0);
    for (std::size_t k = 0; k < parameter_count(camera.model); ++k)
      camera.parameters[k] = 0.1 * static_cast<double>(k + 1) + 1.0 / 3;
    const Problem problem = seen_by({camera}, 2, 3, 1);
    const bool numbered = colmap_id(camera.model) >= 0;
    if (!numbered) expect_binary_stands_for(problem);
    EXPECT_EQ(lost_in("colmap-text", problem).size(), numbered ? 0u : 1u);
    for (const bool text : {false, true}) {
      if (!text && !numbered) continue;
      const Problem again = parse_colmap(format_colmap(problem, text).value()).value();
      EXPECT_EQ(again.cameras[0].model, camera.model);
      EXPECT_EQ(again.cameras[0].parameters, camera.parameters);
      EXPECT_TRUE(same_state(again, parse_colmap(format_colmap(again, text).value()).value()));
    }
  }
}

/// Whatever their order.
std::set<std::array<double, 4>> measurements(const Problem& p) {
  std::set<std::array<double, 4>> out;
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    out.insert({static_cast<double>(p.observation_image[i]),
                static_cast<double>(p.observation_point[i]), p.observation_xy[2 * i],
                p.observation_xy[2 * i + 1]});
  return out;
}

/// BAL cameras look the other way: the cost is the same, and back again nothing has changed.
TEST(Colmap, HoldsBalCamerasExactly) {
  Problem problem = seen_by(
      {{CameraModel::bal, {500, -0.05, 0.01}}, {CameraModel::bal, {400, 0.1, 0}}}, 4, 20, 2);
  for (double& x : problem.observation_xy) x += 0.25;
  const Problem again = parse_colmap(format_colmap(problem, true).value()).value();
  EXPECT_EQ(again.cameras[0].model, CameraModel::radial);
  EXPECT_GT(again.cameras[0].width_px, 0u);
  const Evaluation before = evaluate(problem), after = evaluate(again);
  EXPECT_NEAR(before.cost, after.cost, 1e-12 * before.cost);
  EXPECT_EQ(after.behind.size(), before.behind.size());

  const Folder folder;
  write(problem, folder / "a.txt").value();
  write(problem, folder / "model", {.format = "colmap"}).value();
  write(read(folder / "model").value(), folder / "b.txt").value();
  const Problem a = read(folder / "a.txt").value(), b = read(folder / "b.txt").value();
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(measurements(a), measurements(b));
  for (std::size_t j = 0; j < 4; ++j) {
    EXPECT_EQ(a.poses[j].translation, b.poses[j].translation);
    EXPECT_EQ(a.cameras[j].parameters, b.cameras[j].parameters);
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_NEAR(a.poses[j].rotation[k], b.poses[j].rotation[k], 1e-15);
  }
}

TEST(Colmap, WritesAFolderWholeAndMixesNoModels) {
  const Folder folder;
  const Problem problem = parse_colmap(tiny_binary()).value();
  EXPECT_EQ(write_format(problem, folder / "model"), "colmap");
  EXPECT_EQ(write_format(problem, folder / "model.txt"), "bal");
  EXPECT_EQ(write_format(parse_colmap(tiny_text()).value(), folder / "model"), "colmap-text");
  EXPECT_EQ(write_format(seen_by({Camera{}}, 1, 1, 1), folder / "model"), "bal");
  EXPECT_EQ(write_format(seen_by({Camera{}}, 1, 1, 1), folder / "model/"), "colmap");
  write(problem, folder / "model").value();
  const InputFile input = read_file(folder / "model", {.hash = true}).value();
  EXPECT_EQ(input.format, "colmap");
  EXPECT_EQ(input.sha256.size(), 64u);
  EXPECT_EQ(input.bytes, tiny_binary().cameras.size() + tiny_binary().images.size() +
                             tiny_binary().points.size());
  EXPECT_TRUE(same_state(input.problem, problem));
  write(problem, folder / "model").value();  // again, over itself
  const Result<void> mixed = write(problem, folder / "model", {.format = "colmap-text"});
  ASSERT_FALSE(mixed.ok());
  EXPECT_EQ(mixed.error().code(), ErrorCode::unwritable_output);
  EXPECT_NE(std::string(mixed.error().what()).find("mixed up"), std::string::npos);
  EXPECT_FALSE(write(problem, folder / "absent/model").ok());
  spill(folder / "file", "kept");
  EXPECT_FALSE(write(problem, folder / "file", {.format = "colmap"}).ok());
  EXPECT_EQ(slurp(folder / "file"), "kept");
}

/// Ids that stand in the way of a row of numbers: 64 bits, in no order, text and binary.
TEST(Colmap, KeepsAnyIds) {
  Problem problem = seen_by({{CameraModel::pinhole, {500, 510, 320, 240}, 640, 480}}, 3, 4, 3);
  auto metadata = std::make_shared<SceneMetadata>();
  metadata->point_ids = {9, 0, 18446744073709551613u, 4};
  metadata->image_ids = {4294967295u, 0, 7};
  metadata->camera_ids = {0};
  problem.metadata = metadata;
  const Problem again = parse_colmap(format_colmap(problem, false).value()).value();
  EXPECT_EQ(again.metadata->point_ids, metadata->point_ids);
  EXPECT_EQ(again.metadata->image_ids, metadata->image_ids);
  EXPECT_EQ(evaluate(again).cost, evaluate(problem).cost);
}

std::filesystem::path colmap_data() {
  const char* root = std::getenv("SHEAF_DATA");
  const std::filesystem::path folder = std::filesystem::path(root ? root : "data") / "colmap";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

TEST(ColmapData, RealModelsComeBackByteForByte) {
  if (colmap_data().empty()) GTEST_SKIP() << "no real models";
  for (const char* name : {"gtsfm-lund-door-12", "gtsfm-crane-mast-8", "gtsfm-astrovision-dawn"}) {
    const ColmapFiles files = load_colmap(colmap_data() / name).value();
    const Problem problem = parse_colmap(files).value();
    expect_same_files(format_colmap(problem, files.text).value(), files);
    const Problem turned = parse_colmap(format_colmap(problem, !files.text).value()).value();
    EXPECT_TRUE(same_state(turned, problem)) << name;
    EXPECT_EQ(turned.metadata->feature_xy, problem.metadata->feature_xy);
  }
}

TEST(ColmapData, LundDoorHasItsKnownCost) {
  if (colmap_data().empty()) GTEST_SKIP() << "no real models";
  const Problem problem = read(colmap_data() / "gtsfm-lund-door-12").value();
  EXPECT_EQ(problem.num_images(), 12u);
  EXPECT_EQ(problem.num_points(), 11384u);
  EXPECT_EQ(problem.num_observations(), 73327u);
  EXPECT_NEAR(evaluate(problem).cost, 1.092982e4, 5e-3);
}

}  // namespace
}  // namespace sheaf
