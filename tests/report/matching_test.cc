// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/matching.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "report/errors.h"
#include "report/model_alignment.h"
#include "scene/similarity.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

/// Images img0.jpg, img1.jpg, ..., points 100, 101, ...; each observation a feature of its image.
Problem named_scene() {
  SceneOptions options;
  options.images = 12;
  options.points = 200;
  Problem out = generate(options).value().start;
  auto metadata = std::make_shared<SceneMetadata>();
  for (std::size_t j = 0; j < out.num_images(); ++j)
    metadata->image_names.push_back("img" + std::to_string(j) + ".jpg");
  for (std::size_t p = 0; p < out.num_points(); ++p) metadata->point_ids.push_back(100 + p);
  std::vector<std::uint32_t> next(out.num_images(), 0);
  for (const std::uint32_t image : out.observation_image)
    metadata->observation_feature.push_back(next[image]++);
  out.metadata = metadata;
  return out;
}

/// Without the last images, and without the points that none of the others sees.
Problem without_last(const Problem& all, std::size_t gone) {
  Problem out;
  out.cameras = all.cameras;
  auto metadata = std::make_shared<SceneMetadata>();
  for (std::size_t j = 0; j + gone < all.num_images(); ++j) {
    out.add_image(all.poses[j], all.image_camera[j]);
    metadata->image_names.push_back(all.metadata->image_names[j]);
  }
  std::vector<std::uint32_t> number(all.num_points(), UINT32_MAX);
  for (std::size_t i = 0; i < all.num_observations(); ++i) {
    const std::uint32_t p = all.observation_point[i];
    if (all.observation_image[i] >= out.num_images()) continue;
    if (number[p] == UINT32_MAX) {
      number[p] = out.add_point(all.points[3 * p], all.points[3 * p + 1], all.points[3 * p + 2]);
      metadata->point_ids.push_back(all.metadata->point_ids[p]);
    }
    out.add_observation(all.observation_image[i], number[p], all.observation_xy[2 * i],
                        all.observation_xy[2 * i + 1]);
    metadata->observation_feature.push_back(all.metadata->observation_feature[i]);
  }
  out.metadata = metadata;
  return out;
}

void rename(Problem& problem, std::size_t image, const std::string& name) {
  auto metadata = std::make_shared<SceneMetadata>(*problem.metadata);
  metadata->image_names[image] = name;
  problem.metadata = metadata;
}

TEST(Matching, OfAModelWithItselfIsComplete) {
  const Problem model = named_scene();
  const Matching matching = match_models(model, model).value();
  EXPECT_EQ(matching.by, Matching::By::names);
  EXPECT_TRUE(matching.complete());
  EXPECT_TRUE(matching.in_order);
  EXPECT_EQ(matching.images.size(), 12u);
  EXPECT_EQ(matching.points.size(), 200u);
}

TEST(Matching, ComparesWhatTwoModelsHaveInCommon) {
  const Problem all = named_scene(), part = without_last(all, 2);
  for (const bool swapped : {false, true}) {
    const ErrorLists lists = swapped ? list_errors(all, part, AlignBy::nothing).value()
                                     : list_errors(part, all, AlignBy::nothing).value();
    const Matching& matching = lists.matching;
    EXPECT_FALSE(matching.complete());
    ASSERT_EQ(matching.images.size(), 10u);
    const auto& others = swapped ? matching.only_in_estimate : matching.only_in_reference;
    EXPECT_EQ(others, (std::vector<std::size_t>{10, 11}));
    EXPECT_EQ(matching.points.size(), part.num_points());
    EXPECT_EQ(lists.center.size(), 10u);
    EXPECT_EQ(lists.point.size(), part.num_points());
    for (const double error : lists.center) EXPECT_EQ(error, 0);
    for (const double error : lists.point) EXPECT_EQ(error, 0);
  }
}

TEST(Matching, PointsAreTheSameWhereTheSameFeaturesSeeThem) {
  const Problem all = named_scene();
  Problem part = without_last(all, 1);
  // The features of the first observation's point are others now: it is not known to be the same.
  auto metadata = std::make_shared<SceneMetadata>(*part.metadata);
  metadata->observation_feature[0] = 4000;
  part.metadata = metadata;
  const Matching one_less = match_models(part, all).value();
  EXPECT_EQ(one_less.points.size(), part.num_points() - 1);
  EXPECT_EQ(one_less.points_only_in_estimate, 1u);
  for (std::uint64_t& id : metadata->point_ids) id += 100000;
  part.metadata = metadata;
  const ErrorLists lists = list_errors(part, all, AlignBy::least_squares).value();
  EXPECT_FALSE(lists.matching.has_points);
  EXPECT_FALSE(summarise(lists).has_points);
  EXPECT_TRUE(lists.point.empty());
  EXPECT_TRUE(lists.alignment.aligned);
}

TEST(Matching, RefusesWhatCannotBeTold) {
  const Problem all = named_scene();
  Problem twice = all;
  rename(twice, 3, "img5.jpg");
  const auto repeated = match_models(twice, all);
  ASSERT_FALSE(repeated.ok());
  EXPECT_NE(std::string(repeated.error().what()).find("img5.jpg"), std::string::npos);
  const auto few = match_models(without_last(all, 10), all);
  ASSERT_FALSE(few.ok());
  EXPECT_NE(std::string(few.error().what()).find("2 images in common"), std::string::npos);
  Problem nameless = without_last(all, 1);
  nameless.metadata = nullptr;
  EXPECT_FALSE(match_models(nameless, all).ok());
}

const Similarity kMove{0.4, normalized(Quaternion<double>{1, 0.3, -0.2, 0.5}), {100, 20, -5}};

TEST(AlignModels, FindsTheSimilarityFromCommonImages) {
  const Problem reference = named_scene();
  Problem model = without_last(reference, 3);
  move(model, kMove);
  for (const bool robust : {false, true}) {
    const ModelAlignment found = align_models(model, reference, {.robust = robust}).value();
    EXPECT_NEAR(found.similarity.scale, 2.5, 1e-9);
    EXPECT_EQ(found.distances.size(), 9u);
    Problem back = model;
    move(back, found.similarity);
    const ErrorLists lists = list_errors(back, reference, AlignBy::nothing).value();
    for (const double error : lists.center) EXPECT_LT(error, 1e-8);
    for (const double error : lists.point) EXPECT_LT(error, 1e-8);
  }
}

TEST(AlignModels, NamesTheImageThatIsFarOffAndDoesNotFollowIt) {
  const Problem reference = named_scene();
  Problem model = reference;
  model.poses[4].translation[0] += 40;
  const ModelAlignment robust = align_models(model, reference).value();
  EXPECT_NEAR(robust.similarity.scale, 1, 1e-6);
  EXPECT_EQ(worst_first(robust)[0], 4u);
  EXPECT_LT(robust.inliers, 12u);
  const ModelAlignment plain = align_models(model, reference, {.robust = false}).value();
  EXPECT_GT(std::abs(plain.similarity.scale - 1), 1e-3);
}

TEST(AlignModels, ARigidMotionKeepsTheScale) {
  const Problem reference = named_scene();
  Problem model = reference;
  move(model, kMove);
  for (const bool robust : {false, true}) {
    const ModelAlignment found =
        align_models(model, reference, {.robust = robust, .scale = AlignScale::one}).value();
    EXPECT_EQ(found.similarity.scale, 1);
    EXPECT_NEAR(std::abs(found.similarity.rotation[0]), std::abs(kMove.rotation[0]), 0.01);
  }
}

TEST(AlignModels, SaysWhatIsNotDetermined) {
  const Problem reference = named_scene();
  Problem line = reference, heap = reference;
  for (std::size_t j = 0; j < line.num_images(); ++j) {
    line.poses[j] = {{1, 0, 0, 0}, {-static_cast<double>(j), 0, 0}};
    heap.poses[j] = {{1, 0, 0, 0}, {-5, 0, 0}};
  }
  const auto says = [&](const Problem& model, const std::string& words) {
    const auto result = align_models(model, reference);
    ASSERT_FALSE(result.ok());
    EXPECT_NE(std::string(result.error().what()).find(words), std::string::npos)
        << result.error().what();
  };
  says(line, "in a line");
  says(heap, "in one place in the model");
  Problem two = reference;
  two.metadata = nullptr;
  two.poses.resize(2);
  two.image_camera.resize(2);
  EXPECT_FALSE(align_models(two, two).ok());
}

}  // namespace
}  // namespace sheaf
