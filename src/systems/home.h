// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "systems/camera_stage.h"
#include "systems/camera_state.h"
#include "systems/system.h"

namespace sheaf {

/// What one step leaves to the next beside the state.
struct HomeHistory {
  CameraStage::History stage;
  std::vector<double> own_damping{};  ///< of points under a loss, 8 per group
};

/// A System whose state is a problem's: what the loop does not ask for, but those who built it do.
class Home : public System {
 public:
  /// The held cameras, as the home knows them.
  virtual const CameraState& cameras() const = 0;
  /// Writes the held points, 3 numbers for each; those that nothing sees are not touched.
  virtual void store_points(std::vector<double>& points) const = 0;
  /// With it, the state and what the loop keeps
  /// (solve/trust_region.h), another home of the same problem and options goes on to the same bits.
  virtual HomeHistory history() const = 0;
  /// False where it is of another home.
  virtual bool restore(const HomeHistory& history) = 0;
  /// Begins again at another state with another problem's measurements, as a home that is made of
  /// them would; the arrangement, which holds them, and memory stay. False, and nothing is touched,
  /// where it does not know how. points: 3 numbers for each.
  virtual bool restart(const CameraState&, const std::vector<double>& /*points*/) { return false; }
  /// The root of the mean |r|^2 of the observations at the held state, px, whatever their sigmas;
  /// negative: it does not know.
  virtual double pixel_rms() { return -1; }
  /// Observations behind their camera at the held state, or as many as there may be.
  virtual std::uint64_t count_behind() = 0;
  /// What it holds beside its arrangement.
  virtual std::uint64_t bytes() const = 0;
};

}  // namespace sheaf
