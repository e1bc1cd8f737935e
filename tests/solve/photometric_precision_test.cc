// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "geometry/rigid_motion.h"
#include "rows/photometric.h"
#include "sheaf/sheaf.h"
#include "solve/patch_level.h"

namespace sheaf {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Row13 = Eigen::Matrix<double, 1, 13>;  ///< by target, host, inverse depth

/// What the normal equations at a state say of its precision: J by central differences of plain
/// code, points eliminated, seven directions of the gauge left out.
class Precision {
 public:
  Precision(const PhotometricProblem& problem, const PhotometricOptions& options)
      : scene_(scene_of_level(problem, options, make_pattern(options.pattern).value(), 0)),
        state_(state_of(problem, true)),
        poses_(6 * static_cast<Eigen::Index>(problem.poses.size())),
        H_(Eigen::MatrixXd::Zero(poses_, poses_)),
        W_(problem.num_points(), Eigen::VectorXd::Zero(poses_)),
        V_(problem.num_points(), 0) {
    std::size_t rows = 0;
    double square = 0;
    std::vector<double> residuals;
    for (const Sight& sight : all_sights(problem, true)) {
      if (!patch_residuals(scene_, state_, sight, residuals)) continue;
      for (double r : residuals) square += r * r;
      rows += residuals.size();
      add(sight);
    }
    sigma2_ = square / static_cast<double>(rows - static_cast<std::size_t>(poses_) - V_.size() + 7);
    solve();
  }

  double sigma_grey() const { return std::sqrt(sigma2_); }
  /// Smallest eigenvalue that is kept, over the largest that is not.
  double gap() const { return gap_; }

  /// Standard deviations of where a sight's patch is seen.
  std::array<double, 2> of_place(const Sight& sight) const {
    const auto J = differences(sight, [&](const PatchState& at) {
      const PatchPlace place = place_patch(scene_, at, sight);
      return std::vector<double>{place.x, place.y};
    });
    const Eigen::MatrixXd cov = covariance(sight);
    std::array<double, 2> out;
    for (int k = 0; k < 2; ++k)
      out[static_cast<std::size_t>(k)] = std::sqrt(
          sigma2_ * J[static_cast<std::size_t>(k)].dot(J[static_cast<std::size_t>(k)] * cov));
    return out;
  }

  /// Of the rotation between two images, root mean square of its three components, rad.
  double of_rotation(std::size_t i, std::size_t j) const {
    const auto& a = state_.poses[i].rotation;
    const Matrix3<double> R = matrix_from_quaternion(
        multiply(state_.poses[j].rotation, Quaternion<double>{a[0], -a[1], -a[2], -a[3]}));
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, poses_);
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        J(r, 6 * static_cast<Eigen::Index>(i) + 3 + c) = -R[static_cast<std::size_t>(3 * r + c)];
    for (int r = 0; r < 3; ++r) J(r, 6 * static_cast<Eigen::Index>(j) + 3 + r) = 1;
    return std::sqrt(sigma2_ * (J * C_ * J.transpose()).trace() / 3);
  }

 private:
  template <class Function>
  std::vector<Row13> differences(const Sight& sight, const Function& function) const {
    constexpr double h = 1e-6;
    std::vector<Row13> out;
    PatchState moved = state_;
    double& depth = moved.points[3 * std::size_t(sight.point)];
    for (int c = 0; c < 13; ++c) {
      const std::uint32_t image = c < 6 ? sight.image : scene_.host[sight.point];
      std::vector<double> side[2];
      for (int sign : {-1, 1}) {
        Vector3<double> rho{}, phi{};
        if (c < 12) (c % 6 < 3 ? rho : phi)[static_cast<std::size_t>(c % 3)] = sign * h;
        if (c == 12) depth += sign * h;
        const Pose& pose = state_.poses[image];
        const auto to = left_perturbed<double>({pose.rotation, pose.translation}, rho, phi);
        moved.poses[image] = {to.rotation, to.translation};
        side[sign > 0] = function(moved);
        moved.poses[image] = pose;
        depth = state_.points[3 * std::size_t(sight.point)];
      }
      out.resize(side[0].size());
      for (std::size_t k = 0; k < out.size(); ++k) out[k](c) = (side[1][k] - side[0][k]) / (2 * h);
    }
    return out;
  }

  std::array<Eigen::Index, 2> blocks(const Sight& sight) const {
    return {6 * static_cast<Eigen::Index>(sight.image),
            6 * static_cast<Eigen::Index>(scene_.host[sight.point])};
  }

  void add(const Sight& sight) {
    const auto J = differences(sight, [&](const PatchState& at) {
      std::vector<double> r;
      EXPECT_TRUE(patch_residuals(scene_, at, sight, r));
      return r;
    });
    const auto at = blocks(sight);
    for (const Row13& row : J) {
      for (int a = 0; a < 2; ++a) {
        for (int b = 0; b < 2; ++b)
          H_.block<6, 6>(at[a], at[b]) += row.segment<6>(6 * a).transpose() * row.segment<6>(6 * b);
        W_[sight.point].segment<6>(at[a]) += row(12) * row.segment<6>(6 * a).transpose();
      }
      V_[sight.point] += row(12) * row(12);
    }
  }

  void solve() {
    Eigen::MatrixXd S = H_;
    for (std::size_t i = 0; i < V_.size(); ++i)
      if (V_[i] > 0) S -= W_[i] * W_[i].transpose() / V_[i];
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(S);
    Eigen::VectorXd inverse = eigen.eigenvalues();
    gap_ = inverse(7) / std::abs(inverse(6));
    for (Eigen::Index k = 0; k < poses_; ++k) inverse(k) = k < 7 ? 0 : 1 / inverse(k);
    C_ = eigen.eigenvectors() * inverse.asDiagonal() * eigen.eigenvectors().transpose();
  }

  /// Of target, host and inverse depth, in units of sigma^2.
  Eigen::MatrixXd covariance(const Sight& sight) const {
    const auto at = blocks(sight);
    const double v = V_[sight.point];
    const Eigen::VectorXd y = W_[sight.point] / v;
    Eigen::MatrixXd out(13, 13);
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) out.block<6, 6>(6 * a, 6 * b) = C_.block<6, 6>(at[a], at[b]);
      const Vector6 with = -C_.block(at[a], 0, 6, poses_) * y;
      out.block<6, 1>(6 * a, 12) = with;
      out.block<1, 6>(12, 6 * a) = with.transpose();
    }
    out(12, 12) = 1 / v + y.dot(C_ * y);
    return out;
  }

  PatchScene scene_;
  PatchState state_;
  Eigen::Index poses_;
  Eigen::MatrixXd H_, C_;
  std::vector<Eigen::VectorXd> W_;
  std::vector<double> V_;
  double sigma2_ = 0, gap_ = 0;
};

/// Root mean square of errors in units of what is predicted for each.
struct Score {
  double sum = 0;
  std::size_t count = 0;
  void add(double error, double sigma) { sum += error * error / (sigma * sigma), ++count; }
  double value() const { return std::sqrt(sum / static_cast<double>(count)); }
};

// Places and rotations between images are free of gauge, so that errors need no alignment. The
// noise of a host's patch is in all of its point's residuals, which the Hessian takes for
// independent: errors are somewhat larger than it says.
TEST(PhotometricPrecision, EightBitNoiseDoesWhatTheHessianPredicts) {
  PhotometricSceneOptions o;
  o.images = 5, o.points = 2000, o.width = 256, o.height = 192;
  o.relief = 0.01, o.eight_bit = true, o.noise_grey = 2;
  PhotometricScene scene = generate(o).value();
  PhotometricOptions options;
  options.affine_brightness = false;
  options.loss = {};
  options.tolerance = 1e-10, options.motion_px = 1e-4;
  options.rounds = 1;
  ASSERT_TRUE(refine_photometric(scene.start, options).value().solve.usable());

  const Precision precision(scene.start, options);
  EXPECT_GT(precision.gap(), 1e3);
  // Two pixels' noise, one of them read between pixels.
  EXPECT_NEAR(precision.sigma_grey(), 2 * std::sqrt(1.75), 0.35);
  const PatchScene finest = scene_of_level(scene.start, options, make_pattern("4x4").value(), 0);
  const PatchState found = state_of(scene.start, true), truth = state_of(scene.truth, true);
  Score places, rotations;
  for (const Sight& sight : all_sights(scene.truth, true)) {
    if (sight.point % 7 != 0) continue;
    if (!is_seen(finest, found, sight) || !is_seen(finest, truth, sight)) continue;
    const PatchPlace is = place_patch(finest, found, sight);
    const PatchPlace should = place_patch(finest, truth, sight);
    const auto sigma = precision.of_place(sight);
    places.add(is.x - should.x, sigma[0]);
    places.add(is.y - should.y, sigma[1]);
  }
  for (std::size_t i = 0; i < o.images; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const auto between = [&](const PhotometricProblem& p) {
        const auto& a = p.poses[i].rotation;
        return multiply(p.poses[j].rotation, Quaternion<double>{a[0], -a[1], -a[2], -a[3]});
      };
      const auto is = between(scene.start), should = between(scene.truth);
      const auto off = angle_axis_from_quaternion(
          multiply(is, Quaternion<double>{should[0], -should[1], -should[2], -should[3]}));
      for (double angle : off) rotations.add(angle, precision.of_rotation(i, j));
    }
  EXPECT_GT(places.count, 1000u);
  EXPECT_LT(places.value(), 3);
  EXPECT_GT(places.value(), 0.5) << "predictions that are far too large hold for anything";
  EXPECT_LT(rotations.value(), 3);
  RecordProperty("places", std::to_string(places.value()));
  RecordProperty("rotations", std::to_string(rotations.value()));
}

}  // namespace
}  // namespace sheaf
