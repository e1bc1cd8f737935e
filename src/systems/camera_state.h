// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "geometry/rigid_motion.h"
#include "lists/block_map.h"
#include "lists/columns.h"
#include "lists/lens_tracks.h"
#include "platform/buffer.h"
#include "sheaf/problem.h"
#include "systems/active_bounds.h"

namespace sheaf {

/// The camera side of a state: a pose for each image and, beside them, sets of parameters: one for
/// each lens, or each image's brightness.
struct CameraState {
  using Parameters = std::array<double, kMaxCameraParameters>;
  std::vector<RigidMotion<double>> poses;
  std::vector<Parameters> sets;
  /// sensor_from_rig and rig_from_world: where an image has both, they give its pose.
  std::vector<RigidMotion<double>> sensors{}, frames{};
  std::vector<std::array<double, 3>> kept{};  ///< points that are not eliminated
};

/// Nothing is in it any more, and its memory is kept.
void clear(CameraState& state);
/// The poses and lenses of a problem; allocates nothing where `out` had as many.
void camera_state(const Problem& problem, CameraState& out);
CameraState camera_state(const Problem& problem);
/// The mean camera centre, and the power of two that brings the cameras' mean distance from it next
/// to 1: neither the place of the scene nor its unit matters about it. Summed in the images' order.
struct SceneFrame {
  std::array<double, 3> origin{};
  double unit = 1;
};
SceneFrame scene_frame(const CameraState& state);
/// -R^T t.
std::array<double, 3> centre_of(const RigidMotion<double>& pose);

/// Writes poses and lenses back.
void store(const CameraState& state, Problem& problem);

/// Which solved columns step which part of a camera state.
class CameraColumns {
 public:
  /// A free parameter. Its changes count relative to |relative_to|, a parameter of the same set, or
  /// to `unit` where there is none.
  struct Parameter {
    static constexpr std::int8_t kNone = -1;
    std::uint32_t set;
    std::uint8_t index;
    std::int8_t relative_to = kNone;
    double unit = 1;
    std::int32_t column;
    double lower = -std::numeric_limits<double>::infinity();
    double upper = std::numeric_limits<double>::infinity();
  };

  CameraColumns() = default;  ///< of nothing
  /// BAL lenses: f, k1, k2 are the first three parameters of an image's lens.
  static CameraColumns of_bal(const Columns& columns,
                              const std::vector<std::uint32_t>& image_camera);
  /// Lenses of any model.
  static CameraColumns of_lenses(const Columns& columns, const LensTracks& tracks);
  /// The same, where solved blocks are frames and sensors; `rigs` says which images are of which.
  CameraColumns through(const BlockMap& map, const Rigs& rigs) const;
  /// Kept points: columns 0 to 2 of these blocks.
  void add_kept(const Columns& columns, std::size_t first_block, std::size_t count);
  /// Bounds of parameters; those of parameters that are held say nothing.
  void keep_within(const std::vector<ParameterBound>& bounds);
  /// Brightness a and b of each image: columns 6 and 7 of its block. b counts in grey levels of
  /// 255.
  static CameraColumns of_brightness(const Columns& columns);

  /// to = from, stepped by x. Returns the largest relative change of any one block: radians for
  /// rotations, relative to its length for translations, parameters as said above.
  double step(const CameraState& from, const Buffer<double>& x, CameraState& to) const;

  /// How far the columns of bounded parameters may step.
  std::vector<StepBound> step_bounds(const CameraState& from) const;

  const std::vector<Parameter>& parameters() const { return parameters_; }

 private:
  CameraColumns(const Columns& columns, std::size_t images);
  void add(Parameter parameter);

  using PoseColumns = std::vector<std::array<std::int32_t, 6>>;  ///< all six are fixed, or none
  struct Mounted {
    std::uint32_t image, frame, sensor;
  };

  double step_poses(const PoseColumns& columns, const std::vector<RigidMotion<double>>& from,
                    const Buffer<double>& x, std::vector<RigidMotion<double>>& to) const;

  PoseColumns poses_;                              ///< of each image
  PoseColumns sensors_, frames_;                   ///< of rigs
  std::vector<Mounted> mounted_;                   ///< images whose frame or sensor steps
  std::vector<std::array<std::int32_t, 3>> kept_;  ///< of each kept point
  std::vector<Parameter> parameters_;
};

}  // namespace sheaf
