// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "geometry/loss.h"
#include "rows/photometric.h"

namespace sheaf {

/// How the noise of the images spreads into one point, poses and brightness taken as known. With
/// J_k the derivative of pixel k's residual by the point's q unknowns (1 with rays, else 3), w_k
/// its weight and every pixel of every image off by independent noise of the variance sigma^2,
///   cov = sigma^2 H^-1 (sum_p c_p c_p^T) H^-1,   H = sum w_k (J_k J_k^T - E_k),
/// where c_p says how the sum of w_k J_k r_k follows pixel p of an image. A pixel counts in all the
/// samples that are interpolated from it, and one of the reference in all images that are compared
/// with it: residuals are not independent. E_k is what noise alone makes of J_k J_k^T, since slopes
/// are read from noisy images: docs/photometric.md.
class PointSigma {
 public:
  /// sigma: of a pixel, grey levels.
  PointSigma(const PatchScene& scene, double sigma);

  /// Forgets what was added.
  void clear();
  /// A patch of the point that is seen in an image (`is_seen`), with its residuals.
  void add(const PatchState& state, const Sight& sight, const ScaledLoss& loss, bool loss_per_patch,
           const std::vector<double>& residuals);
  /// The `unknowns()` standard deviations of the point that all sights added were of; infinite
  /// where they do not determine it. Nothing may be added afterwards.
  void sigmas(std::uint32_t point, double* out);

  int unknowns() const { return unknowns_; }

  /// The variance of each residual of a patch that is seen, for noise of one grey level.
  void variances(const PatchState& state, const Sight& sight, std::vector<double>& out);

 private:
  using Column = std::array<double, 3>;
  struct Pixel {
    double x, y;            ///< where an image is read
    Column c;               ///< a factor of what is read there
    Column by_x{}, by_y{};  ///< of its slopes, where c is J_k
  };
  void place(const PatchState& state, const Sight& sight);
  void place_in_host(std::uint32_t point);
  void spread();
  void add_outer(const Column& c);
  double noise_of(const Pixel& at, std::size_t i, std::size_t j) const;

  const PatchScene& scene_;
  double sigma_;
  int unknowns_;
  std::vector<Pixel> pixels_;      ///< of the patch at hand, with J_k
  std::vector<Column> reference_;  ///< of the score by each grey level of the reference
  std::vector<Column> window_;     ///< c_p of the pixels around a patch
  std::array<double, 9> H_{}, B_{};
};

}  // namespace sheaf
