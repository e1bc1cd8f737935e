// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "sheaf/sheaf.h"

namespace sheaf {
namespace {

using Words = std::vector<std::string>;

/// Every verb on the folder of a COLMAP model, and what each says of it.
class FormatsCommand : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run({"generate", "s.txt", "--points", "300", "--cameras", "8"}).exit_code, 0);
    ASSERT_EQ(run({"convert", "s.txt", "model/"}).exit_code, 0);
  }
  Outcome run(const Words& arguments) { return run_command(arguments, folder_.path()); }
  std::string file(const std::string& name) { return contents_of(folder_ / name); }
  TemporaryFolder folder_;
};

TEST_F(FormatsCommand, ConvertsThereAndBack) {
  for (const char* part : {"cameras.bin", "images.bin", "points3D.bin"})
    EXPECT_TRUE(std::filesystem::exists(folder_ / (std::string("model/") + part)));
  ASSERT_EQ(run({"convert", "model", "text", "--format", "colmap-text"}).exit_code, 0);
  ASSERT_EQ(run({"convert", "text", "again"}).exit_code, 0);  // text, as it was read
  EXPECT_EQ(file("again/images.txt"), file("text/images.txt"));
  ASSERT_EQ(run({"convert", "text", "binary", "--format", "colmap"}).exit_code, 0);
  for (const char* part : {"/cameras.bin", "/images.bin", "/points3D.bin"})
    EXPECT_EQ(file(std::string("binary") + part), file(std::string("model") + part));
  ASSERT_EQ(run({"convert", "model", "o.out"}).exit_code, 0);
  ASSERT_EQ(run({"convert", "o.out", "back.txt"}).exit_code, 0);
  const double cost = evaluate(read(folder_ / "s.txt").value()).cost;
  EXPECT_NEAR(evaluate(read(folder_ / "back.txt").value()).cost, cost, 1e-12 * cost);
}

TEST_F(FormatsCommand, InfoBeginsWithWhatOneLooksFor) {
  ASSERT_EQ(run({"generate", "shared/", "--camera", "OPENCV", "--shared", "--points", "300",
                 "--cameras", "8"})
                .exit_code,
            0);
  const Outcome info = run({"info", "shared", "--json", "i.json"});
  ASSERT_EQ(info.exit_code, 0) << info.err;
  const auto json = json_of(folder_ / "i.json");
  const double mean = json["observations_per_image"]["mean"];
  EXPECT_DOUBLE_EQ(mean, json["input"]["observations"].get<double>() / 8);
  ASSERT_EQ(json["cameras"].size(), 1u);
  EXPECT_EQ(json["cameras"][0]["model"], "OPENCV");
  EXPECT_EQ(json["cameras"][0]["images"], 8);
  EXPECT_EQ(json["cameras"][0]["parameters"].size(), 8u);
  EXPECT_EQ(json["cameras"][0]["observations"], json["input"]["observations"]);
  std::size_t at = 0;
  for (const char* line : {"registered  8 images, mean ", "points      300, mean track length ",
                           "error       mean reprojection error ", "camera 1    OPENCV "}) {
    const std::size_t found = info.out.find(line, at);
    ASSERT_NE(found, std::string::npos) << line << " in\n" << info.out;
    at = found;
  }
  // The lens is one block of the camera system beside the images.
  const Outcome solved = run({"solve", "shared", "-o", "r/", "--max-iterations", "1"});
  EXPECT_NE(solved.out.find("8 images, 1 blocks of lenses, "), std::string::npos) << solved.out;
}

/// OpenMVG has one focal length; a FULL_OPENCV lens, which tangential and third coefficients take,
/// has two. A RADIAL_K3 lens has one as well.
TEST_F(FormatsCommand, WhatTheResultCannotBeWrittenAsIsSaidBeforeASolve) {
  Problem problem = read(folder_ / "model").value();
  for (Camera& camera : problem.cameras) {
    const double f = camera.parameters[0];
    camera = {CameraModel::full_opencv, {f, f, 900, 600, 0.01, 0, 0.0005, 0, 0.001}, 1800, 1200};
  }
  write(problem, folder_ / "sfm_data.json").value();
  std::filesystem::create_directory(folder_ / "r");
  const Outcome refused = run({"solve", "sfm_data.json", "-o", "r/sfm_data.json"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("once its lenses are refined, openmvg cannot hold this problem"),
            std::string::npos)
      << refused.err;
  EXPECT_NE(refused.err.find("--fix f"), std::string::npos) << refused.err;
  EXPECT_EQ(refused.err.find("iteration"), std::string::npos) << refused.err;
  EXPECT_EQ(run({"solve", "sfm_data.json", "-o", "r/sfm_data.json", "--fix", "f"}).exit_code, 0);
  for (Camera& camera : problem.cameras)
    camera = {CameraModel::radial_k3, {camera.parameters[0], 900, 600, 0.01, 0, 0.001}, 1800, 1200};
  write(problem, folder_ / "sfm_data.json").value();
  const Outcome kept = run({"solve", "sfm_data.json", "-o", "r/sfm_data.json"});
  EXPECT_EQ(kept.exit_code, 0) << kept.err;
  EXPECT_EQ(read(folder_ / "r/sfm_data.json").value().cameras[0].model, CameraModel::radial_k3);
}

TEST_F(FormatsCommand, SaysWhatAConversionDrops) {
  const Outcome kept = run({"convert", "model", "copy", "--json", "o.json"});
  EXPECT_EQ(kept.exit_code, 0);
  EXPECT_EQ(kept.out.find("dropped"), std::string::npos) << kept.out;
  EXPECT_TRUE(json_of(folder_ / "o.json")["dropped"].empty());
  EXPECT_EQ(json_of(folder_ / "o.json")["output"]["format"], "colmap");
  const Outcome dropped = run({"convert", "model", "o.txt", "--json", "o.json"});
  EXPECT_NE(dropped.out.find("dropped     image names are not written"), std::string::npos);
  EXPECT_GT(json_of(folder_ / "o.json")["dropped"].size(), 2u);
}

TEST_F(FormatsCommand, SolvesLikeTheFileItCameFrom) {
  ASSERT_EQ(run({"solve", "s.txt", "-o", "r.txt", "--quiet", "--json", "a.json"}).exit_code, 0);
  ASSERT_EQ(run({"solve", "model", "-o", "refined", "--quiet", "--json", "b.json"}).exit_code, 0);
  const auto a = json_of(folder_ / "a.json"), b = json_of(folder_ / "b.json");
  EXPECT_NEAR(a["final_cost"], b["final_cost"], 1e-9 * a["final_cost"].get<double>());
  EXPECT_EQ(b["input"]["format"], "colmap");
  const Outcome evaluated = run({"evaluate", "refined", "r.txt", "--no-align", "--json", "e.json"});
  ASSERT_EQ(evaluated.exit_code, 0) << evaluated.err;
  // One looks along +z, the other along -z: the same cameras.
  EXPECT_LT(json_of(folder_ / "e.json")["rotation_error_rad"]["max"], 1e-6);
  EXPECT_LT(json_of(folder_ / "e.json")["translation_error"]["max"], 1e-4);
  EXPECT_EQ(run({"info", "refined"}).exit_code, 0);
}

/// Another program may write images and points in another order: names and ids tell them.
TEST_F(FormatsCommand, EvaluatesModelsInAnyOrder) {
  const Problem model = read(folder_ / "model").value();
  Problem other;
  auto metadata = std::make_shared<SceneMetadata>();
  other.cameras = model.cameras;
  for (std::size_t j = model.num_images(); j-- > 0;) {
    other.add_image(model.poses[j], model.image_camera[j]);
    metadata->image_names.push_back(model.metadata->image_names[j]);
  }
  for (std::size_t p = model.num_points(); p-- > 0;) {
    other.add_point(model.points[3 * p], model.points[3 * p + 1], model.points[3 * p + 2]);
    metadata->point_ids.push_back(model.metadata->point_ids[p]);
  }
  other.metadata = metadata;
  write(other, folder_ / "other", {.format = "colmap"}).value();
  ASSERT_EQ(run({"evaluate", "other", "model", "--no-align", "--json", "e.json"}).exit_code, 0);
  EXPECT_EQ(json_of(folder_ / "e.json")["center_error"]["max"], 0);
  EXPECT_EQ(json_of(folder_ / "e.json")["point_error"]["max"], 0);
  metadata->image_names[0] = "another";
  write(other, folder_ / "other", {.format = "colmap"}).value();
  const Outcome others = run({"evaluate", "other", "model", "--no-align", "--json", "e.json"});
  ASSERT_EQ(others.exit_code, 0) << others.err;
  EXPECT_NE(others.out.find("only the estimate has: another"), std::string::npos) << others.out;
  const auto common = json_of(folder_ / "e.json")["common"];
  EXPECT_EQ(common["images"], 7);
  EXPECT_EQ(common["images_only_in_estimate"]["first"][0], "another");
  EXPECT_EQ(json_of(folder_ / "e.json")["center_error"]["max"], 0);
  EXPECT_TRUE(json_of(folder_ / "e.json")["point_error"].is_null()) << "it has no features";
}

TEST_F(FormatsCommand, PerturbsAndComparesModels) {
  ASSERT_EQ(run({"perturb", "model", "start", "--center", "0.01", "--min-depth", "0.1"}).exit_code,
            0);
  const Problem start = read(folder_ / "start").value(), model = read(folder_ / "model").value();
  EXPECT_EQ(start.metadata->image_names, model.metadata->image_names);
  EXPECT_NE(start.poses[0].translation, model.poses[0].translation);
  const Outcome compared =
      run({"compare", "start", "--solvers", "sheaf", "--peers", "/nowhere", "--json", "c.json"});
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_EQ(compared.err.find("as a BAL file states it"), std::string::npos);
  const Outcome own = run({"compare", "start", "--solvers", "sheaf", "--own-lenses"});
  EXPECT_EQ(own.exit_code, 0) << own.err;
  EXPECT_NE(own.err.find("as a BAL file states it"), std::string::npos);
  EXPECT_EQ(json_of(folder_ / "c.json")["runs"].size(), 1u);
}

TEST_F(FormatsCommand, RefusesWithTheRightExitCodes) {
  write_text(folder_ / "model/images.bin", file("model/images.bin").substr(0, 97));
  const Outcome cut = run({"info", "model"});
  EXPECT_EQ(cut.exit_code, 3);
  EXPECT_NE(cut.err.find("images.bin: byte 0: found 8 images"), std::string::npos) << cut.err;
  EXPECT_EQ(run({"solve", "model", "-o", "o"}).exit_code, 3);
  EXPECT_EQ(run({"info", "."}).exit_code, 3);
  EXPECT_EQ(run({"convert", "s.txt", "o", "--format", "obj"}).exit_code, 2);
  EXPECT_EQ(run({"convert", "s.txt", "o.nvm"}).exit_code, 2);  // lenses with distortion
  EXPECT_EQ(run({"convert", "s.txt", "absent/model/"}).exit_code, 6);
  Problem wide = read(folder_ / "s.txt").value();
  for (Camera& camera : wide.cameras)
    camera = {CameraModel::opencv_fisheye, {500, 500, 320, 240, 0, 0, 0, 0}, 640, 480};
  write(wide, folder_ / "wide/").value();
  EXPECT_EQ(run({"info", "wide"}).exit_code, 0);
  EXPECT_EQ(run({"solve", "wide", "-o", "refined/"}).exit_code, 0);
  EXPECT_EQ(run({"solve", "wide", "--trust-region", "dogleg"}).exit_code, 0);
}

}  // namespace
}  // namespace sheaf
