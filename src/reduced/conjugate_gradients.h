// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>

#include "lists/columns.h"
#include "platform/buffer.h"
#include "reduced/camera_solver.h"
#include "reduced/recycled_modes.h"
#include "reduced/steihaug_path.h"

namespace sheaf {

/// y = S x over images: nine numbers per image, before damping. Fixed columns are zero in x and
/// ignored in y; images that share a lens each hold its numbers.
class ImageOperator {
 public:
  virtual ~ImageOperator() = default;
  /// Both 16 doubles per image, nine of them used.
  virtual void apply(const double* x, double* y) = 0;
};
constexpr std::size_t kImageVector = kBlockVector;

/// Preconditioned conjugate gradients on (P^T S P + D) x = b with P the numbering of columns.
/// Stops when an iteration's part of the decrease Q = -1/2 x.(b + r) of the quadratic model falls
/// below `forcing` of the mean part so far (Nash and Sofer 1990), or the residual is at rounding;
/// with a radius, also where a step would leave it or finds no curvature: there the last step goes
/// on to the boundary (Steihaug 1983). What one run shows of the system's small eigenvalues
/// preconditions the next.
class ConjugateGradients {
 public:
  explicit ConjugateGradients(const Columns& columns);

  template <class Preconditioner>
  CameraSolution run(ImageOperator& S, const Preconditioner& M, const CameraSystem& system,
                     Buffer<double>& x) {
    const double* b = system.vectors->rhs.data();
    start(b, x);
    if (system.dogleg) path_.begin(r_);
    modes_.begin();
    precondition(M);
    copy(z_, p_);
    double rz = dot(r_, z_);
    const double rz_start = rz;
    double model = 0;
    if (!(rz > 0)) return {rz == 0, 0, r_.data()};
    for (int iteration = 1; iteration <= kMaxIterations; ++iteration) {
      if (system.cancelled != nullptr && (*system.cancelled)())
        return {false, iteration - 1, nullptr};
      apply(S, system.damping);
      const double curvature = dot(p_, q_);
      const double alpha = rz / curvature, most = longest_step(system, x);
      const bool cut = std::isfinite(most) && (most <= alpha || !(curvature > 0));
      if (!cut && !(curvature > 0)) {
        modes_.clear();
        return {iteration > 1, iteration, r_.data()};
      }
      modes_.add(z_.data(), rz, alpha);
      axpy(cut ? most : alpha, p_, x);
      axpy(cut ? -most : -alpha, q_, r_);
      if (system.dogleg) path_.add(x, r_, length(system, x));
      if (cut) return {true, iteration, r_.data(), true};
      const double before = model;
      model += 0.5 * alpha * rz;
      precondition(M);
      const double rz_next = dot(r_, z_);
      const bool small =
          iteration >= kMinIterations && iteration * (model - before) < system.forcing * model;
      if (small || rz_next <= 1e-28 * rz_start) {
        modes_.end(rz_next);
        return {true, iteration, r_.data()};
      }
      scale_add(rz_next / rz, z_, p_);
      rz = rz_next;
    }
    return {true, kMaxIterations, r_.data()};
  }

  /// x where the path of the last run meets the radius of `system`.
  CameraSolution shorten(const CameraSystem& system, Buffer<double>& x);

  RecycledModes::History history() const { return modes_.history(); }
  bool restore(const RecycledModes::History& history) { return modes_.restore(history); }

  std::uint64_t bytes() const;

 private:
  static constexpr int kMaxIterations = 500;
  /// The first few parts of the decrease can be small by chance: stopping at two of them cost
  /// trafalgar-like scenes a trust region step, six cost all scenes iterations.
  static constexpr int kMinIterations = 4;

  /// z = H r
  template <class Preconditioner>
  void precondition(const Preconditioner& M) {
    M.solve(r_.data(), z_.data());
    modes_.correct(r_.data(), z_.data());
  }
  void start(const double* b, Buffer<double>& x);
  void apply(ImageOperator& S, const double* damping);
  SteihaugPath::Metric metric(const CameraSystem& system) const;
  double length(const CameraSystem& system, const Buffer<double>& x) const;
  /// How far along p the radius lets x go.
  double longest_step(const CameraSystem& system, const Buffer<double>& x) const;
  static void copy(const Buffer<double>& from, Buffer<double>& to);
  static double dot(const Buffer<double>& a, const Buffer<double>& b);
  static void axpy(double alpha, const Buffer<double>& x, Buffer<double>& y);
  /// p <- z + beta p
  static void scale_add(double beta, const Buffer<double>& z, Buffer<double>& p);

  const Columns& columns_;
  SteihaugPath path_;    ///< for a dogleg
  RecycledModes modes_;  ///< from run to run
  Buffer<double> r_, z_, p_, q_, image_x_, image_y_;
};

}  // namespace sheaf
