// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What marginalise() leaves against the textbook's dense Schur complement in long double, against
// the whole problem's optimum and covariances, and against itself in two goes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "geometry/camera_model.h"
#include "geometry/loss.h"
#include "platform/random.h"
#include "sheaf/sheaf.h"
#include "solve/rig_problems.h"
#include "solve/scenes.h"
#include "solve/textbook.h"

namespace sheaf {
namespace {

using Block = GaussianPrior::Block;
using Real = long double;

/// 6 images along an arc without rigs, each point seen by most of them.
Problem window(bool shared_lens = true, std::uint64_t seed = 1) {
  test::RigScene scene;
  scene.frames = 6, scene.sensors = 1, scene.points = 40, scene.seed = seed;
  scene.model = CameraModel::simple_radial;
  Problem p = test::rig_problem(scene);
  p.rigs = {};
  if (shared_lens) return p;
  const Camera lens = p.cameras[0];
  p.cameras.assign(p.num_images(), lens);
  for (std::uint32_t i = 0; i < p.num_images(); ++i) p.image_camera[i] = i;
  return p;
}

/// J^T W J and J^T W r of some observations, by the textbook's places.
struct Dense {
  std::vector<Real> H, g;
  std::size_t n;

  explicit Dense(std::size_t columns) : H(columns * columns), g(columns), n(columns) {}
  void add(const std::vector<std::pair<int, double>>& row, double r) {
    for (const auto& [a, va] : row) {
      if (a < 0) continue;
      g[a] += Real(va) * r;
      for (const auto& [b, vb] : row)
        if (b >= 0) H[a * n + b] += Real(va) * vb;
    }
  }
  /// Takes a column out.
  void eliminate(std::size_t k) {
    const Real pivot = H[k * n + k];
    if (pivot == 0) return;
    for (std::size_t r = 0; r < n; ++r) {
      if (r == k) continue;
      const Real f = H[r * n + k] / pivot;
      for (std::size_t c = 0; c < n; ++c) H[r * n + c] -= f * H[k * n + c];
      g[r] -= f * g[k];
    }
    for (std::size_t c = 0; c < n; ++c) H[k * n + c] = H[c * n + k] = 0;
    g[k] = 0;
  }
};

/// The rows of the observations of these points or in this image.
Dense leaving_normal(const Problem& p, const Places& at, std::uint32_t image,
                     const std::vector<std::uint32_t>& points, const ScaledLoss& loss) {
  Dense out(static_cast<std::size_t>(at.count));
  for (std::size_t i = 0; i < p.num_observations(); ++i) {
    const std::uint32_t j = p.observation_image[i], q = p.observation_point[i];
    if (j != image && std::find(points.begin(), points.end(), q) == points.end()) continue;
    const std::uint32_t lens = p.image_camera[j];
    const Matrix3<double> R = matrix_from_quaternion(p.poses[j].rotation);
    const double* X = &p.points[3 * q];
    Vector3<double> P = multiply(R, Vector3<double>{X[0], X[1], X[2]});
    for (int k = 0; k < 3; ++k) P[k] += p.poses[j].translation[k];
    const LensJacobian<double> of = project_with_jacobian(p.cameras[lens], P);
    const double r[2] = {of.pixel[0] - p.observation_xy[2 * i],
                         of.pixel[1] - p.observation_xy[2 * i + 1]};
    const double w = std::sqrt(evaluate_loss(loss, r[0] * r[0] + r[1] * r[1]).first);
    for (int row = 0; row < 2; ++row) {
      std::vector<std::pair<int, double>> entries;
      const Vector3<double> a = of.point[row], turn = cross(P, a);
      for (int c = 0; c < 3; ++c) {
        entries.emplace_back(at.pose[6 * j + c], w * a[c]);
        entries.emplace_back(at.pose[6 * j + 3 + c], w * turn[c]);
        entries.emplace_back(at.point[3 * q + c],
                             w * (a[0] * R[c] + a[1] * R[3 + c] + a[2] * R[6 + c]));
      }
      for (std::size_t c = 0; c < parameter_count(p.cameras[lens].model); ++c)
        entries.emplace_back(at.lens[kMaxCameraParameters * lens + c], w * of.parameters[row][c]);
      out.add(entries, w * r[row]);
    }
  }
  return out;
}

/// Places of a prior's columns in the textbook's vector.
std::vector<int> places_of(const GaussianPrior& prior, const Places& at) {
  std::vector<int> out;
  for (const Block& block : prior.blocks) {
    const std::size_t width = block.kind == Block::Kind::pose ? 6 : block.state.size();
    for (std::size_t k = 0; k < width; ++k)
      out.push_back(block.kind == Block::Kind::pose ? at.pose[6 * block.index + k]
                    : block.kind == Block::Kind::camera
                        ? at.lens[kMaxCameraParameters * block.index + k]
                        : at.point[3 * block.index + k]);
  }
  return out;
}

/// S^T S and its gradient at d = 0, -S^T S mean, by the textbook's places.
Dense normal_of(const GaussianPrior& prior, const Places& at) {
  const std::vector<int> places = places_of(prior, at);
  Dense out(static_cast<std::size_t>(at.count));
  for (std::size_t row = 0; row < prior.square_root.size() / places.size(); ++row) {
    std::vector<std::pair<int, double>> entries;
    Real r = 0;
    for (std::size_t k = 0; k < places.size(); ++k) {
      const double s = prior.square_root[row * places.size() + k];
      entries.emplace_back(places[k], s);
      r -= Real(s) * prior.mean[k];
    }
    out.add(entries, static_cast<double>(r));
  }
  return out;
}

/// Entries relative to the diagonal's.
void expect_same(const Dense& found, const Dense& expected, double tolerance) {
  Real worst = 0, worst_g = 0;
  const auto scale = [&](std::size_t i) { return std::sqrt(expected.H[i * expected.n + i]); };
  Real g_scale = 0;
  for (std::size_t i = 0; i < expected.n; ++i)
    if (scale(i) > 0) g_scale = std::max(g_scale, std::abs(expected.g[i]) / scale(i));
  for (std::size_t i = 0; i < expected.n; ++i) {
    if (expected.H[i * expected.n + i] == 0) {
      EXPECT_EQ(found.H[i * found.n + i], 0) << i;
      continue;
    }
    worst_g = std::max(worst_g, std::abs(found.g[i] - expected.g[i]) / scale(i) / g_scale);
    for (std::size_t k = 0; k < expected.n; ++k)
      if (expected.H[k * expected.n + k] > 0)
        worst =
            std::max(worst, std::abs(found.H[i * found.n + k] - expected.H[i * expected.n + k]) /
                                (scale(i) * scale(k)));
  }
  EXPECT_LT(static_cast<double>(worst), tolerance);
  EXPECT_LT(static_cast<double>(worst_g), tolerance);
}

const std::vector<std::uint32_t> kLeavingPoints{0, 3, 4, 5, 11, 17, 22, 30, 31, 39};

TEST(Marginalise, IsTheSchurComplementOfTheTextbook) {
  for (const bool shared : {true, false})
    for (const bool held_lens : {true, false})
      for (const LossKind loss : {LossKind::none, LossKind::cauchy}) {
        const Problem p = window(shared);
        Fixed fixed;
        fixed.intrinsics = held_lens;
        fixed.pose_ids = {5};
        const Places at(p, fixed);
        Dense expected = leaving_normal(p, at, 1, kLeavingPoints, {loss, 2});
        for (const std::uint32_t j : kLeavingPoints)
          for (int k = 0; k < 3; ++k) expected.eliminate(at.point[3 * j + k]);
        for (int k = 0; k < 6; ++k) expected.eliminate(at.pose[6 + k]);
        if (!shared && !held_lens)
          for (std::size_t k = 0; k < kMaxCameraParameters; ++k)
            if (const int c = at.lens[kMaxCameraParameters + k]; c >= 0) expected.eliminate(c);
        const GaussianPrior prior = marginalise(p, {1}, kLeavingPoints, {fixed, {loss, 2}}).value();
        expect_same(normal_of(prior, at), expected, 1e-9);
        // Points that image 1 saw and that stay are blocks.
        EXPECT_TRUE(std::any_of(prior.blocks.begin(), prior.blocks.end(), [](const Block& block) {
          return block.kind == Block::Kind::point;
        }));
      }
}

/// Everything but three images, and all points that these alone do not determine.
std::vector<std::uint32_t> all_points(const Problem& p) {
  std::vector<std::uint32_t> out;
  for (std::uint32_t j = 0; j < p.num_points(); ++j) out.push_back(j);
  return out;
}

TEST(Marginalise, LeavesOptimumAndCovariancesOfTheWholeProblem) {
  Problem whole = window();
  SolveOptions options;
  options.tolerance = 1e-15;
  options.fixed.pose_ids = {5};
  options.fixed.intrinsics = true;
  // What scale there is.
  whole.terms.distances.push_back({6, 7, 2.0, 0.01, {}});
  solve(whole, options);
  Problem window = whole;
  const Slide to = slide(window, {0, 2}, kLeavingPoints, {options.fixed, {}}).value();
  ASSERT_EQ(window.num_images(), 4u);
  ASSERT_EQ(window.num_points(), whole.num_points() - kLeavingPoints.size());
  ASSERT_EQ(window.terms.gaussians.size(), 1u);
  ASSERT_EQ(window.terms.distances.size(), 1u);  // of points that stay
  EXPECT_EQ(to.image[0], Slide::kGone);
  EXPECT_EQ(to.image[5], 3u);
  SolveOptions of_window = options;
  of_window.fixed.pose_ids = {to.image[5]};
  CovarianceOptions told;
  told.fixed = options.fixed, told.sigma = 1;
  const Covariance expected = covariance(whole, told).value();
  told.fixed = of_window.fixed;
  const Covariance found = covariance(window, told).value();
  for (std::size_t i = 0; i < 6; ++i) {
    if (to.image[i] == Slide::kGone) continue;
    for (std::size_t k = 0; k < 36; ++k)
      EXPECT_NEAR(found.poses[to.image[i]][k], expected.poses[i][k],
                  1e-7 * std::sqrt(expected.poses[i][7 * (k / 6)] * expected.poses[i][7 * (k % 6)]))
          << i << " " << k;
  }
  Problem moved = window;
  for (double& x : moved.points) x += 1e-3;
  solve(moved, of_window);
  for (std::size_t i = 0; i < moved.num_images(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(moved.poses[i].translation[k], window.poses[i].translation[k], 2e-6) << i;
}

TEST(Marginalise, ComesToTheSameInTwoGoes) {
  const Problem start = window(false);
  Fixed fixed;
  fixed.f = fixed.k1 = true;
  Problem once = start, twice = start;
  const std::vector<std::uint32_t> points = all_points(start);
  std::vector<std::uint32_t> first{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}, second;
  for (std::uint32_t j = 12; j < 30; ++j) second.push_back(j);
  std::vector<std::uint32_t> both = first;
  both.insert(both.end(), second.begin(), second.end());
  slide(once, {0, 1}, both, {fixed, {}}).value();
  const Slide to = slide(twice, {0}, first, {fixed, {}}).value();
  for (std::uint32_t& j : second) j = to.point[j];
  slide(twice, {to.image[1]}, second, {fixed, {}}).value();
  ASSERT_EQ(once.terms.gaussians.size(), 1u);
  ASSERT_EQ(twice.terms.gaussians.size(), 1u);
  const Places at(once, fixed);
  expect_same(normal_of(twice.terms.gaussians[0], at), normal_of(once.terms.gaussians[0], at),
              1e-9);
  EXPECT_NEAR(evaluate(once).cost, evaluate(twice).cost, 1e-12 * evaluate(once).cost);
}

/// S times the motion of the whole scene by a small similarity, at the states that the prior names.
double along_gauge(const GaussianPrior& prior, const Vector3<double>& shift,
                   const Vector3<double>& turn, double scale) {
  std::vector<double> d;
  for (const Block& block : prior.blocks) {
    const std::vector<double>& s = block.state;
    if (block.kind == Block::Kind::point) {
      const Vector3<double> X{s[0], s[1], s[2]}, turned = cross(turn, X);
      for (std::size_t k = 0; k < 3; ++k) d.push_back(shift[k] + turned[k] + scale * X[k]);
      continue;
    }
    // X' = X + m(X): cam_from_world' takes -R m(.) back, and scales the translation.
    const Matrix3<double> R = matrix_from_quaternion(Quaternion<double>{s[0], s[1], s[2], s[3]});
    const Vector3<double> t{s[4], s[5], s[6]}, phi = multiply(R, turn), moved = multiply(R, shift);
    const Vector3<double> lever = cross(phi, t);
    for (std::size_t k = 0; k < 3; ++k) d.push_back(-moved[k] + lever[k] + scale * t[k]);
    for (std::size_t k = 0; k < 3; ++k) d.push_back(-phi[k]);
  }
  double sum = 0, whole = 0;
  for (std::size_t row = 0; row < prior.square_root.size() / d.size(); ++row) {
    double along = 0;
    for (std::size_t k = 0; k < d.size(); ++k) {
      along += prior.square_root[row * d.size() + k] * d[k];
      whole += std::pow(prior.square_root[row * d.size() + k] * d[k], 2);
    }
    sum += along * along;
  }
  return std::sqrt(sum / whole);
}

TEST(Marginalise, LearnsNothingOfPlaceTurnAndSizeThoughStatesMove) {
  Problem p = window();
  Fixed fixed;
  fixed.intrinsics = true;
  const std::vector<std::uint32_t> first{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  slide(p, {0}, first, {fixed, {}}).value();
  const GaussianPrior before = p.terms.gaussians.at(0);
  // The state goes on, as it does when a window is solved.
  Random random(3);
  for (Pose& pose : p.poses) pose = test::moved(pose, 5e-3, random);
  for (double& x : p.points) x += 0.02 * random.normal();
  slide(p, {0}, first, {fixed, {}}).value();
  const GaussianPrior& after = p.terms.gaussians.at(0);
  for (const Block& block : after.blocks)
    for (const Block& old : before.blocks) {
      if (block.kind != Block::Kind::pose || old.kind != block.kind) continue;
      if (old.index == block.index + 1) {
        EXPECT_EQ(block.state, old.state);
      }
    }
  for (const GaussianPrior* prior : {&before, &after})
    for (std::size_t k = 0; k < 3; ++k) {
      Vector3<double> unit{};
      unit[k] = 1;
      EXPECT_LT(along_gauge(*prior, unit, {}, 0), 1e-9);
      EXPECT_LT(along_gauge(*prior, {}, unit, 0), 1e-9);
      EXPECT_LT(along_gauge(*prior, {}, {}, 1), 1e-9);
    }
  // Without the first estimates the second would have.
  p.terms.gaussians[0].blocks[0].state[6] += 0.1;
  EXPECT_GT(along_gauge(p.terms.gaussians[0], {}, {}, 1), 1e-6);
}

TEST(Marginalise, RefusesWhatItCannotDo) {
  const Problem p = window();
  EXPECT_EQ(marginalise(p, {9}, {}).error().code(), ErrorCode::usage);
  EXPECT_STREQ(marginalise(p, {}, {40}).error().what(),
               "point 40 is to leave, expected one below 40");
  EXPECT_EQ(marginalise(p, {0}, {}, {{}, Huber{}}).error().code(), ErrorCode::usage);
  EXPECT_EQ(marginalise(test::rig_problem({}), {0}, {}).error().code(), ErrorCode::usage);
  Problem broken = p;
  broken.points.pop_back();
  EXPECT_EQ(marginalise(broken, {0}, {}).error().code(), ErrorCode::usage);
  EXPECT_TRUE(marginalise(p, {}, {}).value().blocks.empty());
  Problem empty = p;
  EXPECT_TRUE(slide(empty, {}, {}).ok());
  EXPECT_TRUE(empty.terms.gaussians.empty());
}

}  // namespace
}  // namespace sheaf
