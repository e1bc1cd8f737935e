// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sheaf/camera.h"
#include "sheaf/error.h"
#include "sheaf/terms.h"

namespace sheaf {

/// cam_from_world: X_cam = R X_world + t.
struct Pose {
  std::array<double, 4> rotation{1, 0, 0, 0};  ///< unit quaternion (w, x, y, z)
  std::array<double, 3> translation{0, 0, 0};  ///< t, scene units
};

/// Cameras that are mounted together and move as one. A *frame* is a moment at which a rig took
/// images; an image of frame f and sensor s has the pose
///   cam_from_world = sensor_from_rig[s] o rig_from_world[f].
/// Where an image has a frame, this is its pose, whatever Problem::poses says.
struct Rigs {
  static constexpr std::uint32_t kNone = 0xffffffff;

  std::uint32_t count = 0;                  ///< of rigs
  std::vector<Pose> sensor_from_rig;        ///< one for each sensor
  std::vector<std::uint32_t> sensor_rig;    ///< one for each sensor: its rig
  std::vector<std::uint8_t> is_reference;   ///< one for each sensor: 1 if it is its rig's origin:
                                            ///< sensor_from_rig is the identity and never moves
  std::vector<Pose> rig_from_world;         ///< one for each frame
  std::vector<std::uint32_t> frame_rig;     ///< one for each frame: its rig
  std::vector<std::uint32_t> image_frame;   ///< one for each image, or empty; kNone: of no rig
  std::vector<std::uint32_t> image_sensor;  ///< likewise

  std::size_t num_sensors() const { return sensor_from_rig.size(); }
  std::size_t num_frames() const { return rig_from_world.size(); }
  /// No image is of a rig.
  bool empty() const { return image_frame.empty(); }
};

struct SourceFiles;

/// What a file says of a scene beyond what is solved, kept so that it can be written again; no
/// solver looks at it. Each list is empty (not known), or has one entry for each image, lens,
/// point, observation, rig, frame or sensor of the problem.
struct SceneMetadata {
  std::vector<std::uint32_t> camera_ids;  ///< as the file numbers lenses
  std::vector<std::uint32_t> image_ids;
  std::vector<std::string> image_names;
  std::vector<std::uint64_t> point_ids;
  std::vector<std::array<std::uint8_t, 3>> point_colours;  ///< red, green, blue
  std::vector<double> point_errors_px;  ///< mean |r| of a point's observations, as stated

  /// Number of each observation's feature among those of its image.
  std::vector<std::uint32_t> observation_feature;
  /// All features of the images, observed or not: those of image j begin at feature_begin[j] (one
  /// entry more than images), two coordinates each.
  std::vector<std::uint64_t> feature_begin;
  std::vector<double> feature_xy;

  /// Rotations as the file stated them, where that is neither a unit quaternion nor angle-axis: 4
  /// (quaternion w, x, y, z of another length) or 9 (matrix, row-major) for each image.
  std::vector<double> stated_rotations;

  std::vector<std::uint32_t> rig_ids;     ///< as the file numbers rigs
  std::vector<std::uint32_t> frame_ids;   ///< as the file numbers frames
  std::vector<std::uint32_t> sensor_ids;  ///< of each sensor, the id of its camera in the file
  /// Images of which the file stated another pose than their frame and sensor give.
  std::vector<std::uint32_t> stale_poses;

  std::uint64_t state_hash = 0;               ///< of the state as read: `state_hash(problem)`
  std::shared_ptr<const SourceFiles> source;  ///< what only the file's own format can hold
};

/// A bundle adjustment problem as flat arrays. Observation i is of point `observation_point[i]` in
/// image `observation_image[i]` at pixel `observation_xy[2 i], observation_xy[2 i + 1]`, in any
/// order. Image j has the pose `poses[j]` and the lens `cameras[image_camera[j]]`; several images
/// may share one lens.
struct Problem {
  std::vector<Pose> poses;                  ///< one for each image
  std::vector<std::uint32_t> image_camera;  ///< one for each image: index into cameras
  std::vector<Camera> cameras;              ///< lenses
  std::vector<double> points;               ///< 3 x points: X, Y, Z, scene units
  std::vector<std::uint32_t> observation_image;
  std::vector<std::uint32_t> observation_point;
  std::vector<double> observation_xy;  ///< 2 x observations, pixels
  /// Pixels, one for each observation, above 0: residuals are divided by it, so that losses' scales
  /// and costs count in sigmas. Infinite: it takes no part. Empty: 1 pixel each.
  std::vector<double> observation_sigma;
  Rigs rigs;    ///< which images move as one
  Terms terms;  ///< what is known beside the observations

  /// Rotations as a BAL file stated them (3 per image, angle-axis, radians), or empty. They are
  /// what a writer puts out for each pose whose quaternion is still the one they convert to, so
  /// that a rotation that was not touched comes back bit for bit.
  std::vector<double> bal_angle_axis;

  /// Ids, names, colours and features that came with the file; may be null. Copies share it.
  std::shared_ptr<const SceneMetadata> metadata;

  std::size_t num_images() const { return poses.size(); }
  std::size_t num_points() const { return points.size() / 3; }
  std::size_t num_observations() const { return observation_image.size(); }

  /// Adds an image with a lens of its own (or the lens `camera`) and returns its index.
  std::uint32_t add_image(const Pose& pose, const Camera& camera);
  std::uint32_t add_image(const Pose& pose, std::uint32_t camera);
  std::uint32_t add_point(double x, double y, double z);
  void add_observation(std::uint32_t image, std::uint32_t point, double x_px, double y_px);
};

/// What the solver may not change. What is held does not move by a bit.
struct Fixed {
  bool points = false;
  bool poses = false;
  bool intrinsics = false;               ///< all parameters of all cameras
  bool f = false;                        ///< focal lengths of all cameras
  bool k1 = false;                       ///< first radial coefficient of all cameras
  bool k2 = false;                       ///< second radial coefficient of all cameras
  bool sensors = false;                  ///< sensor_from_rig of all rigs
  std::vector<std::uint32_t> pose_ids;   ///< single poses, by image index; of an image of a rig its
                                         ///< frame and its sensor
  std::vector<std::uint32_t> frame_ids;  ///< single frames of rigs, by index
  std::vector<std::uint32_t> sensor_ids;  ///< single sensors of rigs, by index
  std::vector<std::uint32_t> camera_ids;  ///< single lenses, all their parameters, by camera index
  std::vector<std::uint32_t> k1_ids, k2_ids;  ///< single lenses' first or second coefficient
  /// One set for each camera, or empty: the principal points. What stands above is held besides.
  std::vector<ParameterSet> parameters;
};

/// All that `fixed` holds of each camera.
std::vector<ParameterSet> held_parameters(const Problem& problem, const Fixed& fixed);

/// cam_from_world of an image: of an image of a rig by its frame and sensor, else as it stands.
Pose pose_of(const Problem& problem, std::size_t image);

/// Writes what frames and sensors say into the poses of the images of rigs.
void place_images(Problem& problem);

/// Checks sizes, index ranges, finite numbers and unit quaternions (to 1e-6); of the metadata the
/// sizes. The message names the first offending entry.
Result<void> validate(const Problem& problem);

/// Cost 1/2 sum |r|^2 of the plain (not robust) problem by straightforward scalar code, with
/// compensated summation. Independent of the solver's own evaluation.
struct Evaluation {
  double cost = 0;                    ///< 1/2 sum |r / sigma|^2 of the observations; sigma 1: px^2
  double rms_px = 0;                  ///< sqrt(sum |r|^2 / observations): per observation
  std::vector<std::uint64_t> behind;  ///< observations whose point lies behind the camera, or
                                      ///< beyond what a wide lens's formula is meant for
  std::vector<std::uint64_t>
      not_finite;  ///< observations whose residual is not finite; not in cost
};
Evaluation evaluate(const Problem& problem);

/// What a problem's terms cost, by straightforward scalar code, likewise independent.
TermCosts evaluate_terms(const Problem& problem);

/// 64 bits that differ, but for chance, between any two states, lenses or measurements.
std::uint64_t state_hash(const Problem& problem);

}  // namespace sheaf
