// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>

#include "page/page_scene.h"
#include "page/scene_pack.h"
#include "platform/base64.h"
#include "scene/subset.h"
#include "sheaf/scene.h"
#include "sheaf/solve.h"

namespace sheaf {
namespace {

Scene lens_scene(CameraModel model) {
  LensSceneOptions options;
  options.model = model;
  options.lenses = 2;
  options.scene.images = 8;
  options.scene.points = 300;
  return generate(options).value();
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST(ReportScene, NumbersAreThoseOfEvaluate) {
  for (const CameraModel model :
       {CameraModel::bal, CameraModel::opencv, CameraModel::opencv_fisheye, CameraModel::eucm}) {
    const Scene made = model == CameraModel::bal
                           ? generate(SceneOptions{.images = 8, .points = 300}).value()
                           : lens_scene(model);
    const PageScene scene = page_scene(&made.start, made.truth).value();
    const Evaluation after = evaluate(made.truth);
    EXPECT_NEAR(scene.after.rms, after.rms_px, 1e-6 * after.rms_px + 1e-9);
    Problem start = made.start;
    start.observation_xy = made.truth.observation_xy;
    EXPECT_NEAR(scene.before.rms, evaluate(start).rms_px, 1e-5 * evaluate(start).rms_px);
    EXPECT_EQ(scene.before.counted, made.truth.num_observations());
  }
}

TEST(ReportScene, NoiseIsThatOfTheMeasurements) {
  Scene made = generate(SceneOptions{.images = 10, .points = 2000, .pixel_noise_px = 0.7}).value();
  solve(made.start);
  const PageScene scene = page_scene(nullptr, made.start).value();
  // Some of the noise goes into the unknowns.
  EXPECT_GT(scene.sigma, 0.45);
  EXPECT_LT(scene.sigma, 0.75);
  EXPECT_FALSE(scene.has_start);
}

TEST(ReportScene, NothingIsKnownOfPointsThatCannotBeTold) {
  const Scene made = lens_scene(CameraModel::simple_radial);
  Problem after = made.start;
  std::vector<bool> keep(after.num_observations(), true);
  for (std::size_t i = 0; i < keep.size(); ++i) keep[i] = after.observation_point[i] % 7 != 0;
  keep_observations(after, keep, 1);
  ASSERT_LT(after.num_points(), made.start.num_points());
  // Fewer points, without ids or features: which are the same cannot be told, images can.
  const Result<PageScene> scene = page_scene(&made.start, after);
  ASSERT_TRUE(scene.ok()) << scene.error().what();
  EXPECT_EQ(scene.value().before.counted, 0u);
  EXPECT_EQ(scene.value().start_image, std::vector<std::uint8_t>(after.num_images(), 1));
  EXPECT_TRUE(report_page(&made.start, after).ok());
}

TEST(ReportScene, NamesAreAsShortAsTellsThemApart) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(short_names({"a/b/1.jpg", "a/b/2.jpg"}), (Names{"1", "2"}));
  EXPECT_EQ(short_names({"a/1.jpg", "b/1.jpg"}), (Names{"a/1", "b/1"}));
  EXPECT_EQ(short_names({"1.jpg", "2.png"}), (Names{"1.jpg", "2.png"}));
  EXPECT_EQ(short_names({"only.jpg"}), (Names{"only.jpg"}));
  EXPECT_EQ(short_names({".jpg", "b.jpg"}), (Names{".jpg", "b.jpg"}));
}

TEST(ReportPage, SameInputGivesTheSameBytes) {
  const Scene made = lens_scene(CameraModel::opencv);
  Problem result = made.start;
  solve(result);
  const std::string one = report_page(&made.start, result, {.threads = 1}).value();
  EXPECT_EQ(one, report_page(&made.start, result, {.threads = 1}).value());
  EXPECT_EQ(one, report_page(&made.start, result, {.threads = 3}).value());
  EXPECT_EQ(count(one, "{{"), 0u);
  for (const char* id : {"residuals", "lenses", "images", "structure"})
    EXPECT_EQ(count(one, std::string("<section id=\"") + id), 1u) << id;
  EXPECT_EQ(count(one, "id=\"run\""), 0u) << "nothing is known of a run";
  EXPECT_EQ(count(one, "http"),
            count(one, "http-equiv") + count(one, "http://www.w3.org/2000/svg"));
}

TEST(ReportPage, HostileNamesStayText) {
  Scene made = lens_scene(CameraModel::opencv);
  auto names = std::make_shared<SceneMetadata>();
  for (std::size_t i = 0; i < made.start.num_images(); ++i)
    names->image_names.push_back("</script><script>alert(" + std::to_string(i) +
                                 ")\"'\\{{DATA}}\n\xff");
  made.start.metadata = names;
  const std::string page = report_page(nullptr, made.start, {.title = "<b>{{SCRIPT}}</b>"}).value();
  EXPECT_EQ(count(page, "<script>alert"), 0u);
  EXPECT_EQ(count(page, "</script>"), 3u);
  EXPECT_EQ(count(page, "<b>{{SCRIPT}}"), 0u);
  EXPECT_GT(count(page, "&lt;b&gt;{{SCRIPT}}&lt;/b&gt;"), 0u)
      << "what is filled in is not looked at again";
}

TEST(ReportPage, LittleIsEnough) {
  Problem empty;
  EXPECT_TRUE(report_page(nullptr, empty).ok());
  Problem poses;
  poses.add_image(Pose(), Camera());
  EXPECT_TRUE(report_page(nullptr, poses).ok());
  poses.add_point(0, 0, -3);
  poses.add_observation(0, 0, 0, 0);
  EXPECT_TRUE(report_page(&poses, poses).ok());
  poses.points[2] = 0;  // in the camera's centre: no pixel
  EXPECT_TRUE(report_page(&poses, poses).ok());
  // Without noise there is nothing to chart.
  const Problem perfect = lens_scene(CameraModel::pinhole).truth;
  EXPECT_EQ(count(report_page(nullptr, perfect).value(), "id=\"residuals\""), 0u);
}

TEST(ReportPage, RefusesWhatItCannotRead) {
  const Scene made = lens_scene(CameraModel::opencv);
  const auto wrong = [&](const std::string& summary) {
    return report_page(nullptr, made.start, {.summary = summary, .summary_name = "s.json"});
  };
  for (const char* summary : {"{", "[]", "{\"version\": \"1\"}", "3"}) {
    const Result<std::string> page = wrong(summary);
    ASSERT_FALSE(page.ok()) << summary;
    EXPECT_EQ(page.error().code(), ErrorCode::unreadable_input);
    EXPECT_NE(std::string(page.error().what()).find("s.json"), std::string::npos);
  }
  // Members of other kinds than a solve writes are as if they were not there.
  EXPECT_TRUE(
      wrong("{\"termination\": {\"code\": 3}, \"iterations\": [1, {}, null], \"options\": 4, "
            "\"survey\": {\"residuals\": {\"control\": [7]}}, \"time\": []}")
          .ok());
  Problem other = made.start;
  other.poses.pop_back();
  other.image_camera.pop_back();
  EXPECT_FALSE(report_page(&other, made.start).ok());
}

TEST(ReportPage, LimitsThinWhatIsShown) {
  const Scene made = generate(SceneOptions{.images = 8, .points = 2000}).value();
  const PageScene scene = page_scene(&made.start, made.truth).value();
  const SceneView view = scene_view(scene, {0, 0, 0});
  const ScenePack all = pack_scene(scene, view, {}).value();
  EXPECT_EQ(all.points + view.far, 2000u);
  const ScenePack few = pack_scene(scene, view, {}, {.points = 500, .observations = 400}).value();
  EXPECT_EQ(few.points, 500u);
  EXPECT_LE(few.observations, 400u);
  EXPECT_GT(few.observations, 300u);
  EXPECT_LT(few.data.size(), all.data.size() / 2);
}

TEST(ReportPage, Base64) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo\xff"), "Zm9v/w==");
}

}  // namespace
}  // namespace sheaf
