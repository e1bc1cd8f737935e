// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/pose_terms.h"

#include <algorithm>
#include <array>

#include "geometry/motion_log.h"
#include "scene/terms.h"

namespace sheaf {
namespace {

std::vector<TermPlace> poses(const TermPlaces& places, const std::vector<std::uint32_t>& images) {
  std::vector<TermPlace> out;
  for (const std::uint32_t i : images) places.add_pose(i, out);
  return out;
}

/// v turned as BAL's view turns the camera's frame.
Vector3<double> in_frame(const Vector3<double>& v, bool turned) {
  return turned ? Vector3<double>{v[0], -v[1], -v[2]} : v;
}

/// U (p - position), p = R^T (l - t). With T' = exp([rho, phi]^) T it moves by
/// -R^T (rho + phi x l).
class CentreTerm : public Term {
 public:
  CentreTerm(const CentrePrior& prior, bool turned, const TermPlaces& places)
      : Term(Part::centres, 3, poses(places, {prior.image}), prior.loss),
        image_(prior.image),
        lever_(in_frame(prior.lever_arm, turned)),
        position_(prior.position),
        U_(*whitening(prior.covariance)) {}

  void evaluate(const CameraState& at, double* r, double* J) const override {
    const RigidMotion<double>& pose = at.poses[image_];
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    Vector3<double> e;
    for (std::size_t k = 0; k < 3; ++k) {
      e[k] = -position_[k];
      for (std::size_t i = 0; i < 3; ++i) e[k] += R[3 * i + k] * (lever_[i] - pose.translation[i]);
    }
    const Vector3<double> whitened = multiply(U_, e);
    std::copy(whitened.begin(), whitened.end(), r);
    if (J == nullptr) return;
    for (std::size_t row = 0; row < 3; ++row) {
      Vector3<double> a{};  // -row of U R^T
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) a[i] -= U_[3 * row + k] * R[3 * i + k];
      const Vector3<double> turn = cross(lever_, a);  // a . (phi x l) = phi . (l x a)
      std::copy(a.begin(), a.end(), J + 6 * row);
      std::copy(turn.begin(), turn.end(), J + 6 * row + 3);
    }
  }

 private:
  std::uint32_t image_;
  Vector3<double> lever_;
  std::array<double, 3> position_;
  std::array<double, 9> U_;
};

/// U log(R R_0^-1).
class RotationTerm : public Term {
 public:
  RotationTerm(const RotationPrior& prior, bool turned, const TermPlaces& places)
      : Term(Part::rotations, 3, poses(places, {prior.image}), prior.loss),
        image_(prior.image),
        turned_(turned),
        prior_(prior),
        U_(*whitening(prior.covariance)) {}

  void evaluate(const CameraState& at, double* r, double* J) const override {
    const Quaternion<double>& q = prior_.rotation;
    Quaternion<double> of = at.poses[image_].rotation;
    if (turned_) of = {of[1], -of[0], of[3], -of[2]};  // half a turn about x, back
    const Vector3<double> phi =
        angle_axis_from_quaternion(multiply(of, Quaternion<double>{q[0], -q[1], -q[2], -q[3]}));
    const Vector3<double> whitened = multiply(U_, phi);
    std::copy(whitened.begin(), whitened.end(), r);
    if (J == nullptr) return;
    std::fill_n(J, 18, 0.0);
    const auto by_step = inverse_left_jacobian({0, 0, 0, phi[0], phi[1], phi[2]});
    for (std::size_t row = 0; row < 3; ++row)
      for (std::size_t k = 0; k < 3; ++k) {
        double sum = 0;
        for (std::size_t i = 0; i < 3; ++i) sum += U_[3 * row + i] * by_step[6 * (3 + i) + 3 + k];
        J[6 * row + 3 + k] = turned_ && k > 0 ? -sum : sum;
      }
  }

 private:
  std::uint32_t image_;
  bool turned_;
  RotationPrior prior_;
  std::array<double, 9> U_;
};

/// (R down) x measured / sigma.
class GravityTerm : public Term {
 public:
  GravityTerm(const GravityPrior& prior, bool turned, const TermPlaces& places)
      : Term(Part::gravities, 3, poses(places, {prior.image}), prior.loss),
        prior_(prior),
        measured_(in_frame(prior.measured, turned)) {}

  void evaluate(const CameraState& at, double* r, double* J) const override {
    const Matrix3<double> R = matrix_from_quaternion(at.poses[prior_.image].rotation);
    const Vector3<double> down = multiply(R, prior_.down);
    const Vector3<double> e = cross(down, measured_);
    for (std::size_t k = 0; k < 3; ++k) r[k] = e[k] / prior_.sigma_rad;
    if (J == nullptr) return;
    std::fill_n(J, 18, 0.0);
    for (std::size_t k = 0; k < 3; ++k) {
      Vector3<double> phi{};
      phi[k] = 1;
      const Vector3<double> moved = cross(cross(phi, down), measured_);
      for (std::size_t row = 0; row < 3; ++row) J[6 * row + 3 + k] = moved[row] / prior_.sigma_rad;
    }
  }

 private:
  GravityPrior prior_;
  Vector3<double> measured_;
};

/// S log(T_b T_a^-1 Z^-1). A step of b moves the motion by itself, one of a by -Ad(T_b T_a^-1).
class RelativePoseTerm : public Term {
 public:
  RelativePoseTerm(const RelativePosePrior& prior, const std::array<bool, 2>& turned,
                   const TermPlaces& places)
      : Term(Part::relative_poses, 6, poses(places, {prior.first, prior.second}), prior.loss),
        prior_(prior),
        turned_(turned) {}

  void evaluate(const CameraState& at, double* r, double* J) const override {
    const RigidMotion<double> a = pose(at, prior_.first, turned_[0]);
    const RigidMotion<double> b = pose(at, prior_.second, turned_[1]);
    const RigidMotion<double> b_from_a = composed(b, inverse(a));
    const RigidMotion<double> measured{prior_.rotation, prior_.translation};
    const std::array<double, 6> d = log_of(composed(b_from_a, inverse(measured)));
    const std::array<double, 36>& S = prior_.square_root;
    for (std::size_t row = 0; row < 6; ++row) {
      r[row] = 0;
      for (std::size_t k = 0; k < 6; ++k) r[row] += S[6 * row + k] * d[k];
    }
    if (J == nullptr) return;
    const auto by_step = inverse_left_jacobian(d);
    const auto adjoint = adjoint_of(b_from_a);
    for (std::size_t row = 0; row < 6; ++row) {
      std::array<double, 6> of_b{}, of_a{};
      for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t k = 0; k < 6; ++k) of_b[k] += S[6 * row + i] * by_step[6 * i + k];
      for (std::size_t i = 0; i < 6; ++i)
        for (std::size_t k = 0; k < 6; ++k) of_a[k] -= of_b[i] * adjoint[6 * i + k];
      for (std::size_t k = 0; k < 6; ++k) {
        const bool turns = k % 3 != 0;  // y and z
        J[12 * row + k] = turned_[0] && turns ? -of_a[k] : of_a[k];
        J[12 * row + 6 + k] = turned_[1] && turns ? -of_b[k] : of_b[k];
      }
    }
  }

 private:
  /// As the problem has it.
  static RigidMotion<double> pose(const CameraState& at, std::uint32_t image, bool turned) {
    RigidMotion<double> out = at.poses[image];
    if (!turned) return out;
    const auto [w, x, y, z] = out.rotation;
    out.rotation = {x, -w, z, -y};
    out.translation = in_frame(out.translation, true);
    return out;
  }

  RelativePosePrior prior_;
  std::array<bool, 2> turned_;
};

class ParameterTerm : public Term {
 public:
  ParameterTerm(const ParameterPrior& prior, std::vector<TermPlace> place)
      : Term(Part::parameters, 1, std::move(place), prior.loss), prior_(prior) {}

  void evaluate(const CameraState& at, double* r, double* J) const override {
    r[0] = (at.sets[prior_.camera][prior_.parameter] - prior_.value) / prior_.sigma;
    if (J != nullptr) J[0] = 1 / prior_.sigma;
  }

 private:
  ParameterPrior prior_;
};

}  // namespace

void add_pose_terms(const Problem& problem, const TermPlaces& places, const BalView* view,
                    std::vector<std::unique_ptr<Term>>& out) {
  const auto turned = [&](std::uint32_t image) {
    return view != nullptr && view->turns(problem, image);
  };
  const Terms& terms = problem.terms;
  for (const CentrePrior& of : terms.centres)
    out.push_back(std::make_unique<CentreTerm>(of, turned(of.image), places));
  for (const RotationPrior& of : terms.rotations)
    out.push_back(std::make_unique<RotationTerm>(of, turned(of.image), places));
  for (const GravityPrior& of : terms.gravities)
    out.push_back(std::make_unique<GravityTerm>(of, turned(of.image), places));
  for (const RelativePosePrior& of : terms.relative_poses)
    out.push_back(std::make_unique<RelativePoseTerm>(
        of, std::array<bool, 2>{turned(of.first), turned(of.second)}, places));
  for (const ParameterPrior& of : terms.parameters) {
    std::vector<TermPlace> all;
    places.add_lens(of.camera, of.parameter + std::size_t(1), all);
    out.push_back(std::make_unique<ParameterTerm>(of, std::vector<TermPlace>{all[of.parameter]}));
  }
}

}  // namespace sheaf
