// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/covariance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
    // So are xi and alpha in a narrow view.
    if (model == CameraModel::double_sphere) fixed.parameters = {0b1'1100};
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

/// What is told of single images, of two at once and by single solves, against the book.
TEST(Covariance, IsTheDenseInverseAcrossImages) {
  Problem one = unrigged(CameraModel::opencv);
  one.terms.distances.push_back({7, 9, 1.3, 0.01, {}});
  for (const Problem& start : {unrigged(CameraModel::opencv), one}) {
    const Problem p = solved(start);
    const Book book = by_the_book(p, {}, {}, is_centre);
    for (const CovarianceSolver solver :
         {CovarianceSolver::factor, CovarianceSolver::conjugate_gradients}) {
      CovarianceOptions options;
      options.solver = solver;
      options.image_ids = {4, 1};
      options.point_ids = {2, 7};
      options.image_pairs = {{1, 4}, {2, 5}};
      options.threads = 2;
      const Covariance c = covariance(p, options).value();
      EXPECT_EQ(c.solver, solver);
      const double variance = c.sigma * c.sigma;
      const auto block = [&](Kind kind, std::uint32_t a, std::uint32_t b, Eigen::Index n) {
        return Eigen::MatrixXd(variance *
                               book.C.block(book.first(kind, a), book.first(kind, b), n, n));
      };
      ASSERT_EQ(c.poses.size(), 2u);
      EXPECT_LT(off(c.poses[0], block(Kind::image, 4, 4, 6)), 1e-7);
      EXPECT_LT(off(c.poses[1], block(Kind::image, 1, 1, 6)), 1e-7);
      ASSERT_EQ(c.points.size(), 2u);
      EXPECT_LT(off(c.points[0], block(Kind::point, 2, 2, 3)), 1e-7);
      EXPECT_LT(off(c.points[1], block(Kind::point, 7, 7, 3)), 1e-7);
      for (std::size_t k = 0; k < 2; ++k) {
        const auto [a, b] = options.image_pairs[k];
        const Eigen::MatrixXd C = block(Kind::image, a, b, 6), Ca = block(Kind::image, a, a, 6),
                              Cb = block(Kind::image, b, b, 6);
        for (Eigen::Index i = 0; i < 6; ++i)
          for (Eigen::Index j = 0; j < 6; ++j)
            EXPECT_NEAR(c.pairs[k][static_cast<std::size_t>(6 * i + j)], C(i, j),
                        1e-7 * std::sqrt(Ca(i, i) * Cb(j, j)));
      }
      // The distance of two images by differences of the centres that steps of their poses move.
      const auto distance = [&](const Problem& q) {
        std::array<Vector3<double>, 2> at{};
        for (std::size_t e = 0; e < 2; ++e) {
          const Pose& pose = q.poses[options.image_pairs[0][e]];
          const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
          for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t r = 0; r < 3; ++r) at[e][k] -= R[3 * r + k] * pose.translation[r];
        }
        return std::hypot(at[0][0] - at[1][0], at[0][1] - at[1][1], at[0][2] - at[1][2]);
      };
      Eigen::VectorXd by = Eigen::VectorXd::Zero(book.C.rows());
      for (Eigen::Index u = 0; u < by.size(); ++u) {
        const Unknown& unknown = book.unknowns[static_cast<std::size_t>(u)];
        if (unknown.kind != Kind::image) continue;
        Problem more = p, less = p;
        test::move(more, unknown, 1e-6), test::move(less, unknown, -1e-6);
        by[u] = (distance(more) - distance(less)) / 2e-6;
      }
      EXPECT_NEAR(c.distances[0].value, distance(p), 1e-12);
      EXPECT_NEAR(c.distances[0].sigma, std::sqrt(variance * by.dot(book.C * by)),
                  1e-6 * c.distances[0].sigma);
    }
  }
}

/// A lens and the mean motion of its images, of rigs too: by the book.
TEST(Covariance, IsTheDenseInverseOfLensesWithTheirImages) {
  const Problem p = solved(unrigged(CameraModel::opencv));
  const Book book = by_the_book(p, {}, {}, is_centre);
  CovarianceOptions options;
  options.lens_motions = true;
  const Covariance c = covariance(p, options).value();
  for (std::uint32_t k = 0; k < p.cameras.size(); ++k) {
    const std::size_t n = parameter_count(p.cameras[k].model), all = n + 6;
    const auto images =
        static_cast<double>(std::count(p.image_camera.begin(), p.image_camera.end(), k));
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(all), book.C.rows());
    for (Eigen::Index u = 0; u < book.C.rows(); ++u) {
      const Unknown& of = book.unknowns[static_cast<std::size_t>(u)];
      if (of.kind == Kind::lens && of.index == k) A(of.part, u) = 1;
      if (of.kind == Kind::image && p.image_camera[of.index] == k)
        A(static_cast<Eigen::Index>(n) + of.part, u) = 1 / images;
    }
    const Eigen::MatrixXd C = c.sigma * c.sigma * A * book.C * A.transpose();
    const Eigen::VectorXd s = C.diagonal().cwiseSqrt();
    ASSERT_EQ(c.lens_motions[k].size(), all * all);
    for (Eigen::Index i = 0; i < C.rows(); ++i)
      for (Eigen::Index j = 0; j < C.rows(); ++j)
        EXPECT_NEAR(
            c.lens_motions[k][all * static_cast<std::size_t>(i) + static_cast<std::size_t>(j)],
            C(i, j), 1e-7 * s[i] * s[j]);
  }
}

TEST(Covariance, ASmallLimitLeavesWhatIsNamed) {
  const Problem p = solved(scene(CameraModel::opencv));
  CovarianceOptions options;
  options.memory_limit_bytes = 1;
  EXPECT_EQ(covariance(p, options).error().code(), ErrorCode::memory_limit);
  options.image_ids = {0, 3};
  options.points = false;
  const Covariance few = covariance(p, options).value();
  EXPECT_EQ(few.solver, CovarianceSolver::conjugate_gradients);
  options.memory_limit_bytes = 0;
  const Covariance all = covariance(p, options).value();
  EXPECT_EQ(all.solver, CovarianceSolver::factor);
  for (std::size_t k = 0; k < 2; ++k)
    for (std::size_t i = 0; i < 36; ++i)
      EXPECT_NEAR(few.poses[k][i], all.poses[k][i],
                  1e-7 * std::sqrt(all.poses[k][7 * (i / 6)] * all.poses[k][7 * (i % 6)]));
  const std::uint32_t frame = p.rigs.image_frame[0];
  EXPECT_NEAR(few.frames[frame][0], all.frames[frame][0], 1e-7 * all.frames[frame][0]);
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
  CovarianceOptions options;
  options.image_pairs = {{0, blind}, {0, 1}};
  const Covariance c = covariance(p, options).value();
  EXPECT_EQ(c.undetermined_points, 1u);
  EXPECT_TRUE(std::isinf(c.distances[0].sigma) && std::isnan(c.pairs[0][0]));
  EXPECT_TRUE(c.distances[1].sigma > 0 && std::isfinite(c.distances[1].sigma));
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
  CovarianceOptions data, sigma, ids, loss, images, unnamed, traced;
  images.image_ids = {999};
  unnamed.solver = traced.solver = CovarianceSolver::conjugate_gradients;
  traced.image_ids = {0}, traced.points = false, traced.gauge = Gauge::free_points;
  EXPECT_NE(words(images).find("image 999"), std::string::npos);
  EXPECT_NE(words(unnamed).find("must be named"), std::string::npos);
  EXPECT_NE(words(traced).find("free-points"), std::string::npos);
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
