// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/photometric_system.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <utility>
#include <vector>

#include "eliminate/kernel_table.h"
#include "solve/patch_anchor.h"
#include "solve/patch_level.h"

namespace sheaf {
namespace {

constexpr double kDamping = 1e-6;

/// A small scene, its system and the same normal equations by central differences of plain code.
struct Small {
  PhotometricOptions options;
  PhotometricProblem problem;
  PatchScene scene;
  PatchState state;
  std::vector<Sight> sights;
  std::vector<Measurement> measurements;
  double sigma_grey = 1;

  Small(bool rays, bool anchored, double start_px) {
    PhotometricSceneOptions o;
    o.images = 3, o.points = 40, o.width = 96, o.height = 80, o.start_px = start_px;
    o.measured_px = 0.5;
    problem = generate(o).value().start;
    problem.brightness = {{1, 0}, {0.95, 4}, {1.05, -3}};
    options.parametrisation = rays ? Parametrisation::inverse_depth : Parametrisation::xyz;
    if (anchored) options.anchor_px = 0.4, sigma_grey = 3;
    scene = scene_of_level(problem, options, make_pattern("4x4").value(), 0);
    state = state_of(problem, rays);
    for (const Sight& sight : all_sights(problem, rays))
      if (is_seen(scene, state, sight)) sights.push_back(sight);
    measurements = measurements_of(problem, options);
  }

  Trial step(bool exact) const {
    PhotometricRules rules;
    rules.first_brightness_held = scene.has_rays();
    rules.exact_rows = exact;
    Threads threads(2);
    PhotometricSystem system(scene, state, sights, rules, *available_kernels().front(), threads,
                             anchor_of_level(measurements, scene, state, options, 0, sigma_grey));
    EXPECT_TRUE(system.propose({.damping = kDamping}).solved);
    return system.trial();
  }

  Eigen::VectorXd residuals(const PatchState& at) const {
    std::vector<double> all, patch;
    for (const Sight& sight : sights) {
      EXPECT_TRUE(patch_residuals(scene, at, sight, patch));
      all.insert(all.end(), patch.begin(), patch.end());
    }
    for (const Measurement& of : measurements) {
      const PatchPlace place = place_patch(scene, at, {of.point, of.image});
      all.push_back(sigma_grey * (place.x - of.x) / options.anchor_px);
      all.push_back(sigma_grey * (place.y - of.y) / options.anchor_px);
    }
    for (const Brightness& of : at.brightness) {
      all.push_back(of.a - 1);
      all.push_back(of.b / 100);
    }
    return Eigen::Map<Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size()));
  }

  /// Unknown k is moved by `by`; false: there is no such unknown.
  bool move(std::size_t k, double by, PatchState& at) const {
    const std::size_t images = at.poses.size(), held = scene.has_rays() ? 1 : 0;
    const std::size_t each = scene.has_rays() ? 1 : 3;
    if (k < 6 * images) {
      Vector3<double> rho{}, phi{};
      (k % 6 < 3 ? rho : phi)[k % 3] = by;
      Pose& pose = at.poses[k / 6];
      const auto to = left_perturbed<double>({pose.rotation, pose.translation}, rho, phi);
      pose = {to.rotation, to.translation};
      return true;
    }
    k -= 6 * images;
    if (k < 2 * (images - held)) {
      Brightness& of = at.brightness[held + k / 2];
      (k % 2 == 0 ? of.a : of.b) += by;
      return true;
    }
    k -= 2 * (images - held);
    if (k >= each * (at.points.size() / 3)) return false;
    at.points[3 * (k / each) + k % each] += by;
    return true;
  }

  /// What a hardly damped Gauss-Newton step promises.
  double promised_decrease() const {
    constexpr double h = 1e-6;
    std::vector<Eigen::VectorXd> columns;
    for (std::size_t k = 0;; ++k) {
      PatchState plus = state, minus = state;
      if (!move(k, h, plus)) break;
      move(k, -h, minus);
      columns.push_back((residuals(plus) - residuals(minus)) / (2 * h));
    }
    const Eigen::VectorXd r = residuals(state);
    Eigen::MatrixXd J(r.size(), static_cast<Eigen::Index>(columns.size()));
    for (std::size_t k = 0; k < columns.size(); ++k)
      J.col(static_cast<Eigen::Index>(k)) = columns[k];
    Eigen::MatrixXd H = J.transpose() * J;
    const Eigen::VectorXd g = -J.transpose() * r;
    const Eigen::MatrixXd plain = H;
    H.diagonal() *= 1 + kDamping;
    const Eigen::VectorXd x = H.ldlt().solve(g);
    return g.dot(x) - 0.5 * x.dot(plain * x);
  }
};

// Xyz points have patches that move as a whole: their shared rows are exact.
TEST(PhotometricSystem, StepsOfXyzPointsAreGaussNewtons) {
  for (bool anchored : {false, true}) {
    const Small small(false, anchored, 0.5);
    const double promised = small.promised_decrease();
    EXPECT_NEAR(small.step(false).predicted_decrease, promised, 1e-4 * promised) << anchored;
  }
}

TEST(PhotometricSystem, ExactRowsGiveGaussNewtonsStep) {
  for (bool anchored : {false, true}) {
    const Small small(true, anchored, 0.5);
    const double promised = small.promised_decrease();
    const double exact = small.step(true).predicted_decrease;
    const double shared = small.step(false).predicted_decrease;
    EXPECT_NEAR(exact, promised, 1e-4 * promised) << anchored;
    // What sharing the middle's derivatives gives away, and that it is not the same code.
    EXPECT_NEAR(shared, promised, 0.05 * promised) << anchored;
    EXPECT_GT(std::abs(shared - promised), 10 * std::abs(exact - promised)) << anchored;
  }
}

}  // namespace
}  // namespace sheaf
