// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// A synthetic scene. The same options give the same bytes on every machine.
struct SceneOptions {
  std::uint64_t images = 16;
  std::uint64_t points = 4000;
  double mean_track = 4;              ///< observations per point, on average (at least 2)
  double pixel_noise_px = 0.5;        ///< standard deviation of the measurements
  double rotation_noise_rad = 0.005;  ///< of the start
  double center_noise = 0.02;  ///< of the start, scene units (the cameras stand about 1 apart)
  double point_noise = 0.05;   ///< of the start, scene units
  double focal_noise = 0.01;   ///< of the start, relative
  std::uint64_t seed = 1;
};

struct Scene {
  Problem start;  ///< disturbed: what a solver is given
  Problem truth;  ///< what made the measurements (before pixel noise)
};

/// Errors: ErrorCode::usage when the counts cannot be met.
Result<Scene> generate(const SceneOptions& options);

/// A synthetic scene through lenses of any model. Up to 120 degrees of view the images stand around
/// the scene and look at it; wider ones stand in its middle and look up, with points all the way to
/// the edge of the view, behind the image plane too. docs/scenes.md says more.
struct LensSceneOptions {
  CameraModel model = CameraModel::opencv;
  std::uint64_t lenses = 0;      ///< images take them in turn; 0: each has its own
  double field_of_view_deg = 0;  ///< full angle; 0: 65 for perspective models, 200 for the others
  SceneOptions scene{};
};

/// Images are named. Errors: ErrorCode::usage when the counts or the field of view cannot be met.
Result<Scene> generate(const LensSceneOptions& options);

/// How the cameras of a rig are mounted.
enum class RigKind : std::uint8_t {
  stereo,  ///< in a row, half a unit apart, looking ahead
  around,  ///< in a circle of radius 0.3, looking outwards
};

/// A synthetic scene of a rig that is driven along a street, one unit from frame to frame, between
/// walls 5 to 8 units away; from some 150 frames on the street is a loop. docs/scenes.md says more.
struct RigSceneOptions {
  RigKind kind = RigKind::stereo;
  std::uint64_t sensors =
      0;  ///< of the rig; 0: 2 (stereo) or 6 (around). The first is the reference
  std::uint64_t frames = 200;
  CameraModel model = CameraModel::opencv;  ///< any but BAL
  bool one_lens = false;                    ///< for all images; else each sensor has its own
  double field_of_view_deg = 0;  ///< full angle; 0: 80 (stereo), 100 (around), 160 for wide models
  double sensor_rotation_noise_rad = 0;  ///< of the start's sensor_from_rig, each component
  double sensor_translation_noise = 0;   ///< likewise of its translation, scene units
  double missing = 0;                    ///< part of the frames that lack the image of one sensor
  std::uint64_t single_images = 0;       ///< of no rig, mixed in; they share a lens of their own
  SceneOptions scene{};  ///< `images` is not looked at; the noises of poses are those of frames
};

/// Images of rigs have frames and sensors, and all are named. Errors: ErrorCode::usage when the
/// counts or the field of view cannot be met.
Result<Scene> generate(const RigSceneOptions& options);

/// The two kinds of scenes that the published collections of bundle adjustment come from.
enum class SceneFamily : std::uint8_t {
  street,      ///< a car's images along streets, in order, with loops driven again
  collection,  ///< photographs of strangers: popular spots (hubs), in no order
};

/// A synthetic scene that is hard in the way real ones are: docs/scenes.md says how it is made and
/// how it compares. The same options give the same bytes on every machine.
struct FamilyOptions {
  SceneFamily family = SceneFamily::collection;
  std::uint64_t images = 200;
  std::uint64_t points = 40000;
  std::uint64_t observations = 180000;  ///< met within 1% where the images can see that much
  double focal_px = 0;                  ///< median focal length; 0: 400 (street), 1500 (collection)
  double pixel_noise_px = 0.5;          ///< standard deviation of the measurements
  double outliers = 0.002;  ///< fraction of the measurements that are wrong by 4 px and more
  double drift = 1;         ///< size of the start's errors; 0 starts at the truth
  std::uint64_t seed = 1;
};

/// The sizes and family of a published problem, by its name and number of images: "ladybug-1723".
/// Errors: ErrorCode::usage, naming those that are known.
Result<FamilyOptions> scene_like(const std::string& name);
std::vector<std::string> scene_names();

/// Takes a scene in a file's order: counts, observations point by point (images ascending),
/// images, points. It returns false from `more` when what follows is in vain.
class SceneSink {
 public:
  virtual ~SceneSink() = default;
  virtual void counts(std::uint64_t images, std::uint64_t points, std::uint64_t observations) = 0;
  virtual void observation(std::uint32_t image, std::uint32_t point, double x_px, double y_px) = 0;
  /// cam_from_world as angle-axis (radians) and translation; f (px), k1, k2.
  virtual void image(const std::array<double, 3>& angle_axis,
                     const std::array<double, 3>& translation,
                     const std::array<double, 3>& intrinsics) = 0;
  virtual void point(const std::array<double, 3>& xyz) = 0;
  virtual bool more() const { return true; }
};

enum class SceneState : std::uint8_t {
  start,  ///< disturbed: what a solver is given
  truth,  ///< what made the measurements, with its exact pixels
};

struct StreamedScene {
  std::uint64_t observations = 0;
  double rms_px = 0;         ///< of the state that was streamed
  std::uint64_t behind = 0;  ///< observations whose point lies behind its camera
};

/// Makes the scene without ever holding it: memory grows with the images (about 700 bytes each) and
/// is at most 120 MB for the points, so that millions of images can be written. Errors:
/// ErrorCode::usage when the counts cannot be met.
Result<StreamedScene> stream(const FamilyOptions& options, SceneState state, SceneSink& sink);

/// Both states in memory.
Result<Scene> generate(const FamilyOptions& options);

/// A protocol says what sigmas of a NoiseOptions move, in order. w: angle-axis, C: camera centre.
enum class NoiseProtocol : std::uint8_t {
  sheaf,   ///< R <- exp(phi) R and C <- C + d, then t <- t + e: a turn leaves the centre in place
  ceres,   ///< the BAL example of Ceres Solver: w <- w + phi with C held, then t <- t + e
  rootba,  ///< rootba: C <- C + d, then R <- exp(phi) R with t held
};

/// Standard deviations of independent normal errors, in units of the file; 0 draws nothing. Each
/// kind has a stream of its own, so that none of them changes what the others draw, and scaling a
/// sigma scales its errors. The same options give the same bytes on every machine.
struct NoiseOptions {
  NoiseProtocol protocol = NoiseProtocol::sheaf;
  double rotation_rad = 0;                      ///< each component of phi
  double translation = 0;                       ///< each component of t, scene units
  double center = 0;                            ///< each component of C, scene units
  double point = 0;                             ///< each coordinate, scene units
  double sensor_rotation_rad = 0;               ///< each component of phi, of a rig's sensors
  double sensor_translation = 0;                ///< each component of t, of a rig's sensors
  std::array<double, 3> intrinsics{};           ///< of f (px), k1, k2
  std::array<double, 3> intrinsics_relative{};  ///< likewise, as parts of the parameter's size
  double pixel_px = 0;                          ///< each component of a measurement
  double outliers = 0;      ///< fraction of the measurements that are moved by outlier_px
  double outlier_px = 50;   ///< how far, in a random direction
  double normalize_to = 0;  ///< first `normalize` to this size; 0: leave the scene as it is
  double least_depth = 0;   ///< at last leave out what is nearer to its camera, or behind it;
                            ///< 0: keep all. Points that are left with one observation go too
  std::uint64_t seed = 1;
};

/// The function returns what a protocol was published with: sigmas, normalisation, filter and seed.
NoiseOptions published_noise(NoiseProtocol protocol);

/// X -> scale (X - center).
struct Normalization {
  std::array<double, 3> center{0, 0, 0};
  double scale = 1;
};

struct NoiseRecord {
  Normalization normalization;
  std::vector<std::uint64_t> outliers;     ///< observations that were moved, ascending
  std::uint64_t dropped_observations = 0;  ///< by least_depth
  std::uint64_t dropped_points = 0;
};

/// Disturbs a problem as NoiseOptions say: normalisation, images, lenses, points, pixels, outliers,
/// depth filter. Images of a rig move with their frame, which takes the noise of its first image;
/// sensors (but references) turn about their centres by R <- exp(phi) R, then t <- t + e. Frames of
/// one image, taken by the reference, are as images of no rig. Outliers are the observations of
/// least rank in a random order: those of a smaller fraction are among those of a larger one, and
/// move alike. Errors: ErrorCode::usage for options that are negative or not finite, not of the
/// protocol, or of sensors that there are not; the problem is then as it was.
Result<NoiseRecord> perturb(Problem& problem, const NoiseOptions& options);

/// Moves the scene so that the median of each coordinate of the points is 0, and scales it so that
/// the median of |X| + |Y| + |Z| is `size`: the normalisation that Ceres' BAL example and rootba
/// share (with 100). Projections stay as they are. Errors: ErrorCode::usage when half the points
/// are one.
Result<Normalization> normalize(Problem& problem, double size = 100);

}  // namespace sheaf
