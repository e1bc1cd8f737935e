// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "lists/batches.h"
#include "lists/image_batches.h"
#include "scene/camera_frame.h"
#include "sheaf/problem.h"
#include "systems/camera_state.h"

namespace sheaf {

/// A problem whose cameras BAL's formula describes, as the kernels know it: y and z of the cameras
/// turned round, pixels from the principal point, f, k1 and k2 the only parameters. The problem
/// itself is not touched. Exact: only measurements are rounded (by the principal point), and they
/// are not written back.
class BalView {
 public:
  /// Whether BAL's formula describes all cameras and what is to be refined of them.
  static bool serves(const Problem& problem, const Fixed& fixed);
  /// The problem must be one that it serves.
  BalView(const Problem& problem, const Fixed& fixed);

  /// Takes the parameters of another problem of the same models; the same are held.
  void renew(const Problem& problem);
  /// Whether any camera is of another model, so that measurements differ from the problem's.
  bool turns() const { return turns_; }
  /// What is held of each camera's f, k1 and k2: what its model does not have too.
  const std::vector<ParameterSet>& held() const { return held_; }
  /// The poses turned, and f, k1, k2 of each camera.
  void cameras(const Problem& problem, CameraState& out) const;
  /// Measurements as they were arranged, from the problem's to the view's.
  void turn(const Problem& problem, Batches& batches, Threads& threads) const;
  void turn(const Problem& problem, ImageBatches& batches, Threads& threads) const;
  /// One measurement likewise.
  std::array<double, 2> turned(const Problem& problem, std::size_t image,
                               const std::array<double, 2>& xy) const;
  /// Whether this image's camera is turned round.
  bool turns(const Problem& problem, std::size_t image) const;
  /// What was refined, back into the problem's own models.
  void store(const CameraState& cameras, Problem& problem) const;

 private:
  bool turns_ = false;
  std::vector<std::uint8_t> sensor_turns_;  ///< of each sensor of rigs
  std::vector<RadialView> views_;           ///< of each camera
  std::vector<ParameterSet> held_;
};

}  // namespace sheaf
