// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/pattern.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "chart/number_text.h"
#include "inspect/network_view.h"
#include "inspect/pattern_figure.h"
#include "sheaf/scene.h"

namespace sheaf {
namespace {

Problem some_scene(std::uint64_t images, std::uint64_t points, bool shared_lens = false) {
  SceneOptions options;
  options.images = images;
  options.points = points;
  Problem problem = generate(options).value().start;
  if (shared_lens) {
    problem.cameras.resize(2);
    for (std::uint32_t j = 0; j < images; ++j) problem.image_camera[j] = j % 2;
  }
  return problem;
}

// Common points by comparing sets, for all pairs.
std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> links_by_sets(const Problem& p) {
  std::vector<std::set<std::uint32_t>> seen(p.num_images());
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    seen[p.observation_image[i]].insert(p.observation_point[i]);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> out;
  for (std::uint32_t a = 0; a < p.num_images(); ++a)
    for (std::uint32_t b = a + 1; b < p.num_images(); ++b)
      for (const std::uint32_t point : seen[a])
        if (seen[b].count(point)) ++out[{a, b}];
  return out;
}

TEST(Covisibility, LinksAreThoseOfTheSets) {
  Problem problem = some_scene(25, 300);
  // A point seen twice in one image counts once.
  problem.add_observation(problem.observation_image[5], problem.observation_point[5], 1, 2);
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> found;
  for_each_link(problem, tracks_of(problem),
                [&](std::uint32_t a, std::uint32_t b, std::uint32_t points) {
                  EXPECT_TRUE(found.emplace(std::pair(a, b), points).second);
                });
  EXPECT_EQ(found, links_by_sets(problem));
}

TEST(Covisibility, LinksOfManyImagesAreThoseOfTheSetsToo) {
  constexpr std::uint32_t kImages = 1100;  // more than have a table of all pairs
  Problem problem;
  problem.cameras.resize(1);
  problem.poses.resize(kImages);
  problem.image_camera.assign(kImages, 0);
  for (std::uint32_t p = 0; p < 700; ++p) {
    problem.add_point(0, 0, 1);
    // A few images far apart, one of them twice, and of some points a track that is long.
    for (std::uint32_t k = 0; k < (p % 100 == 0 ? 60u : 4u); ++k)
      problem.add_observation((7 * p + (k * k + 1) * 131 * (p % 3 + 1)) % kImages, p, k, 2);
    problem.add_observation(7 * p % kImages, p, 1, 2);
    problem.add_observation(7 * p % kImages, p, 3, 2);
  }
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> found;
  std::pair<std::uint32_t, std::uint32_t> last{0, 0};
  for_each_link(problem, tracks_of(problem),
                [&](std::uint32_t a, std::uint32_t b, std::uint32_t points) {
                  EXPECT_LT(last, std::pair(a, b));
                  last = {a, b};
                  found[{a, b}] = points;
                });
  EXPECT_GT(found.size(), 3000u);
  EXPECT_EQ(found, links_by_sets(problem));
}

// The matrix entry by entry, from the columns that each observation's derivatives are of.
std::vector<std::vector<bool>> dense_jacobian(const Problem& p, const Tracks& tracks) {
  const bool own = p.cameras.size() == p.num_images();
  const std::size_t images = p.num_images(), camera_side = 6 * images + 3 * p.cameras.size();
  std::vector<std::vector<bool>> J;
  for (const std::uint64_t i : tracks.order) {
    std::vector<bool> row(camera_side + p.points.size(), false);
    const std::size_t image = p.observation_image[i];
    for (std::size_t k = 0; k < 6; ++k) row[(own ? 9 : 6) * image + k] = true;
    for (std::size_t k = 0; k < 3; ++k) {
      row[own ? 9 * image + 6 + k : 6 * images + 3 * p.image_camera[image] + k] = true;
      row[camera_side + 3 * p.observation_point[i] + k] = true;
    }
    J.push_back(row);
    J.push_back(row);
  }
  return J;
}

class Patterns : public testing::TestWithParam<bool> {};

// One pixel for each entry: every density is 0 or 1, and is that of the matrix written out.
TEST_P(Patterns, AreThoseOfTheMatricesWrittenOut) {
  const Problem problem = some_scene(4, 12, GetParam());
  const Tracks tracks = tracks_of(problem);
  const auto J = dense_jacobian(problem, tracks);
  const int rows = static_cast<int>(J.size()), columns = static_cast<int>(J[0].size());
  const int camera_side = columns - static_cast<int>(problem.points.size());
  const PatternGrid jacobian = jacobian_pattern(problem, tracks, rows, columns, camera_side);
  std::uint64_t count = 0;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      count += J[y][x];
      ASSERT_NEAR(jacobian.density(y, x), J[y][x], 1e-9) << y << ' ' << x;
    }
  EXPECT_EQ(jacobian.nonzeros(), count);

  const PatternGrid hessian = hessian_pattern(problem, tracks, columns, camera_side);
  count = 0;
  for (int a = 0; a < columns; ++a)
    for (int b = 0; b < columns; ++b) {
      bool any = false;
      for (int y = 0; y < rows && !any; ++y) any = J[y][a] && J[y][b];
      // An image that sees nothing, or a lens that is nobody's, still has its diagonal block.
      if (a < camera_side && b < camera_side && !any) continue;
      count += any;
      ASSERT_NEAR(hessian.density(a, b), any, 1e-9) << a << ' ' << b;
    }
  EXPECT_EQ(hessian.nonzeros(), count);
}

INSTANTIATE_TEST_SUITE_P(Lenses, Patterns, testing::Bool());

TEST(Pattern, DensitiesKeepTheCountWhenManyEntriesShareAPixel) {
  const Problem problem = some_scene(20, 700);
  const Tracks tracks = tracks_of(problem);
  const PatternGrid grid = jacobian_pattern(problem, tracks, 50, 90, 30);
  double sum = 0;
  for (int y = 0; y < 50; ++y)
    for (int x = 0; x < 90; ++x) {
      const auto& band = grid.columns().bands[x < 30 ? 0 : 1];
      const double entries = 2.0 * static_cast<double>(problem.num_observations()) / 50 *
                             static_cast<double>(band.end - band.begin) / band.pixels;
      EXPECT_GE(grid.density(y, x), 0);
      EXPECT_LE(grid.density(y, x), 1 + 1e-9);
      sum += grid.density(y, x) * entries;
    }
  EXPECT_NEAR(sum, static_cast<double>(grid.nonzeros()), 1e-6 * sum);
}

TEST(Pattern, ReducedPixelsHoldTheStrongestPair) {
  const Problem problem = some_scene(40, 2000);
  const auto links = links_by_sets(problem);
  std::vector<Link> strongest;
  const ReducedPattern reduced = reduced_pattern(problem, tracks_of(problem), 10, 25, strongest);
  ASSERT_EQ(reduced.size, 10);
  EXPECT_EQ(reduced.links, links.size());
  std::vector<std::uint32_t> expected(100, 0);
  std::vector<std::uint32_t> all;
  for (const auto& [pair, points] : links) {
    const auto [a, b] = pair;
    for (std::uint32_t* cell : {&expected[a / 4 * 10 + b / 4], &expected[b / 4 * 10 + a / 4]})
      *cell = std::max(*cell, points);
    all.push_back(points);
  }
  std::sort(all.begin(), all.end());
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 10; ++x)
      if (x != y) {
        EXPECT_EQ(reduced.largest[10 * y + x], expected[10 * y + x]);
      }
  ASSERT_EQ(strongest.size(), 25u);
  for (std::size_t k = 0; k < 25; ++k) EXPECT_EQ(strongest[k].points, all[all.size() - 25 + k]);
  EXPECT_EQ(reduced.strongest, all.back());
}

TEST(PatternFigureTest, CountsAndPixelsAreThere) {
  const Problem problem = some_scene(30, 500);
  const PatternFigure figure = draw_patterns(problem, "a title").value();
  const std::uint64_t n = problem.num_observations();
  EXPECT_EQ(figure.counts.jacobian_rows, 2 * n);
  EXPECT_EQ(figure.counts.jacobian_columns, 9 * 30 + 3 * 500u);
  EXPECT_EQ(figure.counts.jacobian_nonzeros, 24 * n);
  EXPECT_EQ(figure.counts.hessian_nonzeros, 81 * 30 + 9 * 500 + 54 * n);
  EXPECT_EQ(figure.counts.reduced_columns, 270u);
  EXPECT_EQ(figure.counts.links, links_by_sets(problem).size());
  const auto count = [&](const std::string& part) {
    std::size_t found = 0;
    for (std::size_t k = figure.svg.find(part); k != std::string::npos;
         k = figure.svg.find(part, k + 1))
      ++found;
    return found;
  };
  EXPECT_EQ(count("<image "), 5u) << "three matrices and two bars";
  EXPECT_EQ(count("<circle "), 30u) << "a camera each";
  EXPECT_EQ(count("<title>a title</title>"), 1u);
  EXPECT_EQ(count(">Jacobian " + grouped(std::int64_t(2 * n)) + " × " + grouped(270 + 1500)), 1u);
  std::size_t drawn = 0;
  for (std::size_t k = figure.svg.find("<path d=\""); k != std::string::npos;
       k = figure.svg.find("<path d=\"", k + 1)) {
    const std::string path = figure.svg.substr(k, figure.svg.find("/>", k) - k);
    if (path.ends_with("class=\"link\""))
      drawn += std::size_t(std::count(path.begin(), path.end(), 'M'));
  }
  EXPECT_EQ(drawn, figure.counts.links);
  EXPECT_FALSE(draw_patterns(Problem(), "").ok());
}

TEST(NetworkViewTest, AStrayCameraDoesNotShrinkTheRest) {
  Problem problem = some_scene(60, 200);
  const NetworkView before = widest_view(problem);
  problem.poses[7].translation = {1e9, 1e9, 1e9};
  const NetworkView after = widest_view(problem);
  EXPECT_EQ(before.beyond, 0u);
  EXPECT_EQ(after.beyond, 1u);
  for (const NetworkView* view : {&before, &after}) {
    double low = 1, high = 0;
    for (const auto& place : view->places) {
      low = std::min(low, place[0]);
      high = std::max(high, place[0]);
      EXPECT_TRUE(place[0] >= 0 && place[0] <= 1 && place[1] >= 0 && place[1] <= 1);
    }
    EXPECT_GT(high - low, 0.5);
  }
}

}  // namespace
}  // namespace sheaf
