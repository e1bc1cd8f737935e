// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/loss.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// A point's position in an image, measured by other means, pixels.
struct Measurement {
  std::uint32_t point, image;
  double x, y;
};

/// Measured positions that are rows of a photometric problem too. With e the distance between
/// projection and measurement in standard deviations, twice the cost of one is
///   sigma_grey^2 rho(|e|^2):
/// so much as that many pixels' worth of grey levels, each off by one standard deviation.
struct Anchor {
  std::vector<Measurement> measurements;
  double sigma_px = 1;    ///< of both coordinates
  double sigma_grey = 1;  ///< of a pixel
  ScaledLoss loss{};      ///< scale in standard deviations
};

/// The two rows of a measurement and what it costs.
struct AnchorRow {
  double residual[2], camera[2][6], point[2][3];  ///< camera: rho, phi of the block
  double cost, square;                            ///< twice: with the loss, and without
};

/// Of a point at P = R d + s t as a block's view (kViewRecord) has it; `on_ray`: s is its only
/// unknown, else it has s = 1 and the three of d. The cost of one behind its camera is infinite,
/// and its rows are zero.
AnchorRow anchor_row(const Anchor& anchor, const Pinhole& camera, const double* view,
                     const double* d, double s, bool on_ray, const double* measured);

}  // namespace sheaf
