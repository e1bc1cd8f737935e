// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/covariance.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "covariance/dense_textbook.h"
#include "sheaf/solve.h"
#include "solve/lens_problems.h"
#include "solve/rig_problems.h"

namespace sheaf {
namespace {

using test::Book;
using test::by_the_book;
using test::rig_problem;
using test::Unknown;
using Kind = Unknown::Kind;

bool is_centre(const Unknown& u) {
  return (u.kind == Kind::image || u.kind == Kind::frame) && u.part < 3;
}
bool is_point(const Unknown& u) { return u.kind == Kind::point; }

/// At the optimum.
Problem solved(Problem p, const Fixed& fixed = {}, const Loss& loss = {}) {
  SolveOptions options;
  options.fixed = fixed;
  options.loss = loss;
  options.tolerance = 1e-14;
  options.threads = 1;
  solve(p, options);
  return p;
}

Problem scene(CameraModel model) {
  return rig_problem({.frames = 3, .points = 30, .model = model});
}
Problem unrigged(CameraModel model) {
  Problem p = scene(model);
  p.rigs = {};
  return p;
}
/// GPS on every image, a measured focal length, two measured points, a scale bar.
Problem surveyed(Problem p) {
  for (std::uint32_t i = 0; i < p.num_images(); ++i) {
    const Pose pose = pose_of(p, i);
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    std::array<double, 3> at{};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t r = 0; r < 3; ++r) at[k] -= R[3 * r + k] * pose.translation[r];
    p.terms.centres.push_back({i, at, {4e-4, 1e-4, 0, 1e-4, 4e-4, 0, 0, 0, 9e-4}, {}, {}});
  }
  p.terms.parameters.push_back({0, 0, p.cameras[0].parameters[0], 2, {}});
  for (const std::uint32_t j : {3u, 5u})
    p.terms.points.push_back({j,
                              {p.points[3 * j], p.points[3 * j + 1], p.points[3 * j + 2]},
                              {1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 4e-4}});
  p.terms.distances.push_back({7, 9, 1.3, 0.01, {}});
  return p;
}

/// The largest difference of two covariances, in sigmas.
template <std::size_t kCount>
double off(const std::array<double, kCount>& got, const Eigen::MatrixXd& C) {
  const Eigen::Index n = C.rows();
  const Eigen::VectorXd s = C.diagonal().cwiseSqrt();
  double out = 0;
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      out = std::max(out,
                     std::abs(got[static_cast<std::size_t>(n * i + j)] - C(i, j)) / (s[i] * s[j]));
  return out;
}

/// Every block against the book.
double compare(const Problem& p, const Covariance& c, const Book& book) {
  double out = 0;
  const double variance = c.sigma * c.sigma * c.loss_factor;
  const auto block = [&](Kind kind, std::uint32_t index, Eigen::Index n) {
    const Eigen::Index at = book.first(kind, index);
    return Eigen::MatrixXd(variance * book.C.block(at, at, n, n));
  };
  for (std::uint32_t i = 0; i < p.num_images(); ++i)
    if (book.first(Kind::image, i) >= 0)
      out = std::max(out, off(c.poses[i], block(Kind::image, i, 6)));
  for (std::uint32_t f = 0; f < p.rigs.num_frames(); ++f)
    if (book.first(Kind::frame, f) >= 0)
      out = std::max(out, off(c.frames[f], block(Kind::frame, f, 6)));
  for (std::uint32_t s = 0; s < p.rigs.num_sensors(); ++s)
    if (book.first(Kind::sensor, s) >= 0)
      out = std::max(out, off(c.sensors[s], block(Kind::sensor, s, 6)));
  for (std::uint32_t j = 0; j < p.num_points(); ++j)
    if (book.first(Kind::point, j) >= 0)
      out = std::max(out, off(c.points[j], block(Kind::point, j, 3)));
  for (std::uint32_t k = 0; k < p.cameras.size(); ++k) {
    const std::size_t n = parameter_count(p.cameras[k].model);
    for (std::size_t a = 0; a < book.unknowns.size(); ++a)
      for (std::size_t b = 0; b < book.unknowns.size(); ++b) {
        const Unknown &ua = book.unknowns[a], &ub = book.unknowns[b];
        if (ua.kind != Kind::lens || ub.kind != Kind::lens || ua.index != k || ub.index != k)
          continue;
        const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
        out = std::max(out, std::abs(c.lenses[k][n * ua.part + ub.part] - variance * book.C(i, j)) /
                                (variance * std::sqrt(book.C(i, i) * book.C(j, j))));
      }
  }
  return out;
}

void expect_book(const Problem& start, const Fixed& fixed = {}, Loss loss = {},
                 Gauge gauge = Gauge::automatic) {
  const Problem p = solved(start, fixed, loss);
  CovarianceOptions options;
  options.fixed = fixed;
  options.loss = loss;
  options.gauge = gauge;
  options.threads = 1;
  const Result<Covariance> got = covariance(p, options);
  ASSERT_TRUE(got.ok()) << got.error().what();
  const Book book = by_the_book(p, fixed, loss, gauge == Gauge::free_points ? is_point : is_centre);
  EXPECT_EQ(book.deficit, got.value().deficit);
  EXPECT_EQ(book.unknowns.size(), got.value().unknowns);
  EXPECT_LT(compare(p, got.value(), book), std::max(1e-8, 1e-13 * book.condition))
      << book.condition;
}

TEST(Covariance, IsTheDenseInverseForEveryModel) {
  for (const CameraModel model : test::all_models()) {
    SCOPED_TRACE(to_string(model));
    const Problem p = test::disturbed({test::ordinary(model)}, 5, 40, 4);
    Fixed fixed;
    // The rational lens's two polynomials are next to one another.
    if (model == CameraModel::full_opencv) fixed.parameters = {0b1110'0000'1100};
    expect_book(p, fixed);
  }
}

TEST(Covariance, IsTheDenseInverseOfRigs) {
  expect_book(scene(CameraModel::opencv));
  expect_book(scene(CameraModel::radial));
  Fixed sensors;
  sensors.sensors = true;
  expect_book(scene(CameraModel::opencv), sensors);
}

TEST(Covariance, IsTheDenseInverseWithTerms) {
  expect_book(surveyed(unrigged(CameraModel::opencv)));
  expect_book(surveyed(scene(CameraModel::radial)));
  Problem one = unrigged(CameraModel::opencv);
  one.terms.distances.push_back({7, 9, 1.3, 0.01, {}});
  expect_book(one);  // the scale is fixed, six freedoms are left
}

TEST(Covariance, IsTheDenseInverseOfWhatIsHeld) {
  Fixed poses, points, lenses;
  poses.poses = true, points.points = true, lenses.intrinsics = true;
  expect_book(unrigged(CameraModel::opencv), poses);
  expect_book(unrigged(CameraModel::opencv), points);
  expect_book(unrigged(CameraModel::opencv), lenses);
}

TEST(Covariance, IsTheDenseInverseUnderALossAndSigmas) {
  expect_book(unrigged(CameraModel::opencv), {}, Cauchy{1.0});
  Problem p = unrigged(CameraModel::radial);
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    p.observation_sigma.push_back(0.5 + 0.25 * static_cast<double>(i % 7));
  expect_book(p);
}

TEST(Covariance, IsTheDenseInverseWithTheTraceOverPoints) {
  expect_book(unrigged(CameraModel::opencv), {}, {}, Gauge::free_points);
}

TEST(Covariance, RedundancyNumbersAddUp) {
  const Problem p = solved(unrigged(CameraModel::opencv));
  for (const Gauge gauge : {Gauge::free_centres, Gauge::free_points, Gauge::first_two}) {
    CovarianceOptions options;
    options.gauge = gauge;
    options.observations = true;
    const Covariance c = covariance(p, options).value();
    double sum = 0;
    for (const ObservationReliability& o : c.observations)
      for (const double r : o.redundancy) sum += r;
    EXPECT_NEAR(sum, c.redundancy, 1e-6 * c.redundancy);
  }
}

TEST(Covariance, TheFirstTwoAreExact) {
  const Problem p = solved(unrigged(CameraModel::opencv));
  CovarianceOptions options;
  options.gauge = Gauge::first_two;
  const Covariance c = covariance(p, options).value();
  for (std::size_t k = 0; k < 6; ++k) EXPECT_LT(std::sqrt(std::abs(c.poses[0][7 * k])), 1e-7);
  EXPECT_GT(c.poses[2][0], 1e-8);
}

TEST(Covariance, BitsDoNotDependOnThreads) {
  const Problem p = solved(surveyed(scene(CameraModel::opencv)));
  std::vector<Covariance> all;
  for (const int threads : {1, 2, 5}) {
    CovarianceOptions options;
    options.threads = threads;
    options.observations = true;
    all.push_back(covariance(p, options).value());
    EXPECT_EQ(all.back().poses, all.front().poses);
    EXPECT_EQ(all.back().points, all.front().points);
    EXPECT_EQ(all.back().lenses, all.front().lenses);
  }
}

TEST(Covariance, WhatIsNotDeterminedIsSaid) {
  Problem p = solved(unrigged(CameraModel::opencv));
  const std::uint32_t lone = p.add_point(0.1, 0.2, 0.3);
  p.add_observation(0, lone, 500, 400);
  const std::uint32_t blind = p.add_image(p.poses[0], 0u);
  const Covariance c = covariance(p).value();
  EXPECT_EQ(c.undetermined_points, 1u);
  EXPECT_TRUE(std::isinf(c.points[lone][0]));
  EXPECT_TRUE(std::isinf(c.poses[blind][0]));
  EXPECT_TRUE(std::isfinite(c.poses[0][0]) && std::isfinite(c.points[0][0]));
}

TEST(Covariance, WhatMakesNoSenseIsRefused) {
  const Problem p = unrigged(CameraModel::opencv);
  const auto words = [&](const CovarianceOptions& options) {
    const Result<Covariance> c = covariance(p, options);
    return c.ok() ? std::string() : std::string(c.error().what());
  };
  CovarianceOptions data, sigma, ids, loss;
  data.gauge = Gauge::data;
  sigma.sigma = -1;
  ids.point_ids = {999};
  loss.loss = {LossKind::huber, 0};
  EXPECT_NE(words(data).find("seven freedoms"), std::string::npos);
  EXPECT_NE(words(sigma).find("sigma"), std::string::npos);
  EXPECT_NE(words(ids).find("999"), std::string::npos);
  EXPECT_NE(words(loss).find("scale"), std::string::npos);
}

}  // namespace
}  // namespace sheaf
