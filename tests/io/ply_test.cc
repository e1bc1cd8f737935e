// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/ply.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <sstream>
#include <vector>

#include "io/bytes.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

struct Vertex {
  std::array<float, 3> position;
  std::array<unsigned char, 3> colour;
};

struct Edge {
  std::array<std::int32_t, 2> vertices;
  std::array<unsigned char, 3> colour;
};

struct Ply {
  std::vector<Vertex> vertices;
  std::vector<Edge> edges;
};

/// Reads what the header declares and no byte more.
Ply read_ply(const std::string& bytes) {
  std::map<std::string, std::size_t> count;
  std::map<std::string, std::string> properties;
  std::istringstream header(bytes);
  std::string line, element;
  std::getline(header, line);
  EXPECT_EQ(line, "ply");
  std::getline(header, line);
  EXPECT_EQ(line, "format binary_little_endian 1.0");
  while (std::getline(header, line) && line != "end_header") {
    std::istringstream words(line);
    std::string kind, type, name;
    words >> kind;
    if (kind == "element") words >> element >> count[element];
    if (kind == "property") words >> type >> name, properties[element] += type + " " + name + ";";
  }
  const std::string colour = "uchar red;uchar green;uchar blue;";
  EXPECT_EQ(properties["vertex"], "float x;float y;float z;" + colour);
  EXPECT_EQ(properties["edge"], "int vertex1;int vertex2;" + colour);
  const auto begin = static_cast<std::size_t>(header.tellg());
  EXPECT_EQ(bytes.size() - begin, 15 * count["vertex"] + 11 * count["edge"]);

  Ply ply{std::vector<Vertex>(count["vertex"]), std::vector<Edge>(count["edge"])};
  const char* p = bytes.data() + begin;
  for (Vertex& v : ply.vertices) {
    std::memcpy(v.position.data(), p, 12);
    std::memcpy(v.colour.data(), p + 12, 3);
    p += 15;
  }
  for (Edge& e : ply.edges) {
    std::memcpy(e.vertices.data(), p, 8);
    std::memcpy(e.colour.data(), p + 8, 3);
    p += 11;
  }
  return ply;
}

/// Two cameras, 2 apart, turned by a quarter about y; f = 500, observed to 100 x 50 pixels.
Problem scene(double shift) {
  const double h = std::sqrt(0.5);
  Problem p;
  const std::uint32_t first =
      p.add_image({{h, 0, h, 0}, {0, 0, -5}}, Camera{CameraModel::bal, {500, 0, 0}});
  p.add_image({{h, 0, h, 0}, {0, 2, -5}}, p.image_camera[first]);
  for (int i = 0; i < 20; ++i) p.add_point(3 * std::cos(i) + shift, 0.5 * i, 3 * std::sin(i));
  for (std::uint32_t i = 0; i < 20; ++i)
    p.add_observation(i % 2, i, i < 2 ? -100 : 7, i < 2 ? 50 : 3);
  return p;
}

/// The frustum whose five vertices begin at `first`: R^T looks along -z of the camera.
void expect_frustum(const Ply& ply, std::size_t first, std::array<double, 3> centre) {
  const auto& c = ply.vertices[first].position;
  std::array<double, 3> middle{};
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(c[k], centre[k], 1e-6);
    for (std::size_t corner = 1; corner < 5; ++corner)
      middle[k] += ply.vertices[first + corner].position[k] / 4.0;
  }
  // R turns +x of the world into -z of the camera, so the camera looks along +x.
  const double depth = middle[0] - c[0];
  EXPECT_GT(depth, 0.01);
  EXPECT_NEAR(middle[1], c[1], 1e-5);
  EXPECT_NEAR(middle[2], c[2], 1e-5);
  // 100 and 50 pixels at f = 500: the corners lie 0.2 and 0.1 of the depth aside.
  for (std::size_t corner = 1; corner < 5; ++corner) {
    const auto& v = ply.vertices[first + corner].position;
    EXPECT_NEAR(std::abs(v[1] - c[1]), 0.1 * depth, 1e-5);
    EXPECT_NEAR(std::abs(v[2] - c[2]), 0.2 * depth, 1e-5);
  }
}

TEST(Ply, HoldsPointsAndFrusta) {
  const test::Folder folder;
  const Problem problem = scene(0);
  ASSERT_TRUE(write(problem, folder / "scene.ply").ok());
  const Ply ply = read_ply(test::slurp(folder / "scene.ply"));
  ASSERT_EQ(ply.vertices.size(), 20u + 2 * 5);
  ASSERT_EQ(ply.edges.size(), 2u * 8);
  for (std::size_t i = 0; i < 20; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(ply.vertices[i].position[k], static_cast<float>(problem.points[3 * i + k]));
  // C = -R^T t with R = [0 0 1; 0 1 0; -1 0 0].
  expect_frustum(ply, 20, {-5, 0, 0});
  expect_frustum(ply, 25, {-5, -2, 0});
  for (std::size_t i = 0; i < 16; ++i)
    for (std::int32_t vertex : ply.edges[i].vertices) {
      EXPECT_GE(vertex, i < 8 ? 20 : 25);
      EXPECT_LT(vertex, i < 8 ? 25 : 30);
    }
  // Points are coloured by height, which is y here: the lowest unlike the highest.
  EXPECT_NE(ply.vertices[0].colour, ply.vertices[19].colour);
  EXPECT_EQ(folder.files(), 1u);
}

TEST(Ply, BeforeIsGreyAndAfterIsColoured) {
  const test::Folder folder;
  ASSERT_TRUE(write_ply(scene(1), scene(0), folder / "both.ply").ok());
  const Ply ply = read_ply(test::slurp(folder / "both.ply"));
  ASSERT_EQ(ply.vertices.size(), 2u * (20 + 10));
  ASSERT_EQ(ply.edges.size(), 2u * 16);
  const auto grey = [](const std::array<unsigned char, 3>& c) {
    return c[0] == c[1] && c[1] == c[2];
  };
  for (std::size_t i = 0; i < ply.vertices.size(); ++i)
    EXPECT_EQ(grey(ply.vertices[i].colour), i < 20 || (i >= 40 && i < 50)) << i;
  for (std::size_t i = 0; i < ply.edges.size(); ++i) {
    EXPECT_EQ(grey(ply.edges[i].colour), i < 16);
    for (std::int32_t vertex : ply.edges[i].vertices) {
      EXPECT_GE(vertex, i < 16 ? 40 : 50);
      EXPECT_LT(vertex, i < 16 ? 50 : 60);
    }
  }
  EXPECT_EQ(ply.vertices[0].position[0], ply.vertices[20].position[0] + 1);
  expect_frustum(ply, 40, {-5, 0, 0});
  expect_frustum(ply, 50, {-5, 0, 0});
}

TEST(Ply, IsCompressedByName) {
  const test::Folder folder;
  ASSERT_TRUE(write(scene(0), folder / "plain.ply").ok());
  ASSERT_TRUE(write(scene(0), folder / "packed.ply.gz").ok());
  const std::string plain = test::slurp(folder / "plain.ply");
  std::string unpacked(plain.size() + 1, '\0');
  gzFile file = gzopen((folder / "packed.ply.gz").c_str(), "rb");
  ASSERT_NE(file, nullptr);
  EXPECT_EQ(gzread(file, unpacked.data(), static_cast<unsigned>(unpacked.size())),
            static_cast<int>(plain.size()));
  gzclose(file);
  unpacked.pop_back();
  EXPECT_EQ(unpacked, plain);
}

TEST(Ply, SurvivesAbsurdNumbers) {
  const test::Folder folder;
  Problem problem;
  ASSERT_TRUE(write(problem, folder / "empty.ply").ok());
  EXPECT_TRUE(read_ply(test::slurp(folder / "empty.ply")).vertices.empty());
  const double most = std::numeric_limits<double>::max();
  for (int i = 0; i < 50; ++i) {
    problem.add_image({{0.6, 0, 0.8, 0}, {i % 2 ? most : -most, most, most}},
                      Camera{CameraModel::bal, {i % 3 ? 0.0 : most, 0, 0}});
    problem.add_point(i % 2 ? most : -most, i % 3 ? most : 0, -most);
    problem.add_observation(static_cast<std::uint32_t>(i), 0, most, -most);
  }
  ASSERT_TRUE(write_ply(problem, problem, folder / "absurd.ply").ok());
  for (const Vertex& v : read_ply(test::slurp(folder / "absurd.ply")).vertices)
    for (float x : v.position) EXPECT_FALSE(std::isinf(x));
}

TEST(Ply, RealScenesHaveFrustaOfSensibleSize) {
  const std::filesystem::path data = test::bal_data();
  const std::filesystem::path path = data / "dubrovnik-16-22106-pre.txt";
  if (data.empty() || !std::filesystem::exists(path))
    GTEST_SKIP() << "no real scenes: set SHEAF_DATA";
  const test::Folder folder;
  const Problem problem = read(path).value();
  ASSERT_TRUE(write(problem, folder / "scene.ply").ok());
  const Ply ply = read_ply(test::slurp(folder / "scene.ply"));
  ASSERT_EQ(ply.vertices.size(), problem.num_points() + 5 * 16);
  for (std::size_t i = 0; i < 16; ++i) {
    // Any of the image's own points projects near its frustum's axis: the frustum looks at them.
    const auto& c = ply.vertices[problem.num_points() + 5 * i].position;
    const auto& corner = ply.vertices[problem.num_points() + 5 * i + 1].position;
    const auto& opposite = ply.vertices[problem.num_points() + 5 * i + 3].position;
    std::size_t seen = 0, towards = 0;
    for (std::size_t o = 0; o < problem.num_observations(); ++o) {
      if (problem.observation_image[o] != i) continue;
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k)
        dot += ((corner[k] + opposite[k]) / 2 - c[k]) *
               (problem.points[3 * problem.observation_point[o] + k] - c[k]);
      ++seen;
      towards += dot > 0;
    }
    EXPECT_GT(towards, seen * 9 / 10) << "image " << i << " sees " << seen;
  }
}

}  // namespace
}  // namespace sheaf
