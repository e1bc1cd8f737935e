// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "geometry/camera_model.h"
#include "geometry/motion_log.h"
#include "platform/random.h"
#include "sheaf/covariance.h"
#include "sheaf/solve.h"
#include "starts/sights.h"

// What noise makes of an estimate: a scene is measured many times with errors drawn anew, and the
// errors of what is estimated are held against what one such copy says of itself.
namespace sheaf::test {

struct Study {
  Problem truth;  ///< with the pixels and the measured terms that it would give without noise
  Fixed fixed{};
  Loss loss{};
  double pixel = 0.7;   ///< sigma of a coordinate, px
  double outliers = 0;  ///< part of the observations that are anywhere within 50 px
  bool aligned = true;  ///< the scene's place is free: estimates are brought to the truth's centres
  std::uint64_t seed = 1;
  int copies = 400;
};

inline Vector3<double> drawn(const Covariance3& C, Random& random) {
  const Eigen::Matrix3d L =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(C.data()).llt().matrixL();
  Eigen::Vector3d e;
  for (Eigen::Index k = 0; k < 3; ++k) e[k] = random.normal();
  const Eigen::Vector3d out = L * e;
  return {out[0], out[1], out[2]};
}

/// Measured again: everything that noise touches, outliers too, is drawn anew. The start is near
/// the truth, so that what is found is the optimum next to it.
inline Problem measured_again(const Study& study, std::uint64_t copy) {
  Problem p = study.truth;
  Random random(study.seed, copy);
  for (std::size_t i = 0; i < p.num_observations(); ++i) {
    const bool wrong = study.outliers > 0 && random.uniform() < study.outliers;
    for (std::size_t r = 0; r < 2; ++r)
      p.observation_xy[2 * i + r] +=
          wrong ? random.uniform(-50, 50) : study.pixel * random.normal();
  }
  const auto add = [&](std::array<double, 3>& to, const Covariance3& C) {
    const Vector3<double> e = drawn(C, random);
    for (std::size_t k = 0; k < 3; ++k) to[k] += e[k];
  };
  for (CentrePrior& of : p.terms.centres) add(of.position, of.covariance);
  for (PointPrior& of : p.terms.points) add(of.position, of.covariance);
  for (double& x : p.points) x += 1e-3 * random.normal();
  const auto nudge = [&](Pose& pose) {
    for (double& x : pose.translation) x += 1e-3 * random.normal();
  };
  for (Pose& pose : p.poses) nudge(pose);
  for (Pose& pose : p.rigs.rig_from_world) nudge(pose);
  place_images(p);
  return p;
}

/// Centres of what holds a free scene: frames, and images of no rig.
inline Eigen::MatrixXd centres_of(const Problem& p) {
  const std::vector<Pose>& poses = p.rigs.empty() ? p.poses : p.rigs.rig_from_world;
  Eigen::MatrixXd out(3, static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const auto C = camera_centre(matrix_from_quaternion(poses[i].rotation), poses[i]);
    out.col(static_cast<Eigen::Index>(i)) = Eigen::Vector3d(C[0], C[1], C[2]);
  }
  return out;
}

/// By the similarity that brings its centres nearest to the truth's: to first order the
/// S-transformation into the gauge in which the trace over centres is least.
inline void align(Problem& p, const Problem& truth) {
  const Eigen::Matrix4d M = Eigen::umeyama(centres_of(p), centres_of(truth), true);
  const double s = M.col(0).head<3>().norm();
  const Eigen::Matrix3d R = M.topLeftCorner<3, 3>() / s;
  const Eigen::Vector3d a = M.col(3).head<3>();
  for (std::size_t j = 0; j < p.num_points(); ++j) {
    Eigen::Map<Eigen::Vector3d> X(&p.points[3 * j]);
    X = (s * (R * X) + a).eval();
  }
  const Eigen::Quaterniond back(R.transpose());
  const auto move = [&](Pose& pose) {
    const auto& w = pose.rotation;
    const Eigen::Quaterniond q = Eigen::Quaterniond(w[0], w[1], w[2], w[3]) * back;
    pose.rotation = {q.w(), q.x(), q.y(), q.z()};
    const Eigen::Vector3d turned = q * a;
    for (std::size_t k = 0; k < 3; ++k)
      pose.translation[k] = s * pose.translation[k] - turned[static_cast<Eigen::Index>(k)];
  };
  for (Pose& pose : p.rigs.rig_from_world) move(pose);
  for (Pose& sensor : p.rigs.sensor_from_rig)
    for (double& x : sensor.translation) x *= s;
  if (p.rigs.empty())
    for (Pose& pose : p.poses) move(pose);
  place_images(p);
}

/// log(T_estimate T_truth^-1).
inline Eigen::VectorXd pose_error(const Pose& estimate, const Pose& truth) {
  const auto d = log_of(composed<double>({estimate.rotation, estimate.translation},
                                         inverse<double>({truth.rotation, truth.translation})));
  return Eigen::Map<const Eigen::Matrix<double, 6, 1>>(d.data());
}

/// A block of parameters over all copies.
struct Block {
  std::string kind;
  Eigen::MatrixXd errors;     ///< sum e e^T
  Eigen::MatrixXd predicted;  ///< sum of covariances
};

/// Blocks in one order, which is the same for every copy.
class Tally {
 public:
  /// What is held has a covariance of 0 and is left out.
  void add(const std::string& kind, const Eigen::VectorXd& e, const double* covariance) {
    const Eigen::Index n = e.size();
    const Eigen::Map<const Eigen::MatrixXd> C(covariance, n, n);
    std::vector<Eigen::Index> free;
    for (Eigen::Index k = 0; k < n; ++k)
      if (C(k, k) > 0) free.push_back(k);
    if (free.empty()) return;
    if (at_ == blocks_.size()) {
      const auto size = static_cast<Eigen::Index>(free.size());
      const Eigen::MatrixXd zero = Eigen::MatrixXd::Zero(size, size);
      blocks_.push_back({kind, zero, zero});
    }
    Block& block = blocks_[at_++];
    block.errors += e(free) * e(free).transpose();
    block.predicted += C(free, free);
  }
  void next_copy() { at_ = 0, ++copies_; }

  const std::vector<Block>& blocks() const { return blocks_; }
  int copies() const { return copies_; }

 private:
  std::vector<Block> blocks_;
  std::size_t at_ = 0;
  int copies_ = 0;
};

inline void add_copy(const Problem& p, const Problem& truth, const Covariance& c, Tally& to) {
  for (std::size_t i = 0; i < p.num_images(); ++i)
    to.add("pose", pose_error(p.poses[i], truth.poses[i]), c.poses[i].data());
  for (std::size_t f = 0; f < p.rigs.num_frames(); ++f)
    to.add("frame", pose_error(p.rigs.rig_from_world[f], truth.rigs.rig_from_world[f]),
           c.frames[f].data());
  for (std::size_t s = 0; s < p.rigs.num_sensors(); ++s)
    to.add("sensor", pose_error(p.rigs.sensor_from_rig[s], truth.rigs.sensor_from_rig[s]),
           c.sensors[s].data());
  for (std::size_t k = 0; k < p.cameras.size(); ++k) {
    Eigen::VectorXd e(parameter_count(p.cameras[k].model));
    for (Eigen::Index i = 0; i < e.size(); ++i)
      e[i] = p.cameras[k].parameters[static_cast<std::size_t>(i)] -
             truth.cameras[k].parameters[static_cast<std::size_t>(i)];
    to.add("lens", e, c.lenses[k].data());
  }
  for (std::size_t j = 0; j < p.num_points(); ++j)
    to.add("point",
           Eigen::Map<const Eigen::Vector3d>(&p.points[3 * j]) -
               Eigen::Map<const Eigen::Vector3d>(&truth.points[3 * j]),
           c.points[j].data());
  to.next_copy();
}

/// sqrt(mean(empirical^2 / predicted^2)) over a kind's parameters, and the worst of them.
struct Ratios {
  double mean = 0, least = 1e300, most = 0;
  int parameters = 0;
};

inline Ratios ratios(const Tally& tally, const std::string& kind) {
  Ratios out;
  double sum = 0;
  for (const Block& block : tally.blocks())
    for (Eigen::Index k = 0; block.kind == kind && k < block.errors.rows(); ++k) {
      const double square = block.errors(k, k) / block.predicted(k, k);
      sum += square;
      out.least = std::min(out.least, std::sqrt(square));
      out.most = std::max(out.most, std::sqrt(square));
      ++out.parameters;
    }
  out.mean = std::sqrt(sum / out.parameters);
  return out;
}

/// Sum of e^T C^-1 e over the copies, C the mean of those that copies say, as a normal deviate: by
/// Wilson and Hilferty's cube root of a chi-square of copies x rows degrees of freedom.
inline double chi_square_deviate(const Block& block, int copies) {
  const double n = copies * static_cast<double>(block.errors.rows());
  const double sum = copies * block.predicted.ldlt().solve(block.errors).trace();
  return (std::cbrt(sum / n) - (1 - 2 / (9 * n))) / std::sqrt(2 / (9 * n));
}

}  // namespace sheaf::test
