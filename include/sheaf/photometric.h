// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "sheaf/camera_solver_kind.h"
#include "sheaf/error.h"
#include "sheaf/loss.h"
#include "sheaf/problem.h"
#include "sheaf/stop.h"

namespace sheaf {

struct Iteration;

/// Grey levels row by row from the top left; pixel (0, 0) has its centre at (0, 0).
struct GreyImage {
  int width = 0, height = 0;
  std::vector<float> pixels;  ///< width x height, 0 to 255 for 8-bit images
};

/// u = fx X / Z + cx, v = fy Y / Z + cy, for a point (X, Y, Z) in the camera's frame; looks along
/// +z, v downwards.
struct Pinhole {
  double fx = 1, fy = 1, cx = 0, cy = 0;  ///< pixels
};

/// What an image makes of a common grey level L: a L + b.
struct Brightness {
  double a = 1;
  double b = 0;  ///< grey levels
};

/// Where a patch has its pixels, around its middle.
struct Pattern {
  std::string name;  ///< "4x4", ...
  std::vector<std::int8_t> dx, dy;
  std::size_t size() const { return dx.size(); }
};

/// "4x4" (-2 to 1 both ways, as the course has it), "3x3", "5x5", "7x7", "9x9", "6x6", "8x8", "8"
/// (the eight of DSO), "cross" (five). Pixels are listed column by column. Errors:
/// ErrorCode::usage, naming those that are known.
Result<Pattern> make_pattern(const std::string& name);
std::vector<std::string> pattern_names();

/// Images, their poses, and points whose grey patches are known: stored with the points, seen in a
/// host image, or both.
struct PhotometricProblem {
  Pinhole camera;                 ///< of all images
  std::vector<GreyImage> images;  ///< one for each pose
  std::vector<Pose> poses;        ///< cam_from_world, +z forward
  std::vector<double> points;     ///< 3 x points: X, Y, Z, scene units
  /// Grey levels of the `patch` pixels of each point: what points as xyz are compared with ...
  Pattern patch;
  std::vector<float> patches;  ///< patch.size() x points, or empty
  /// ... and the image that a point's patch is taken from, and where: what points on rays need. The
  /// point lies on that pixel's ray.
  std::vector<std::uint32_t> host;     ///< one for each point, or empty
  std::vector<double> host_xy;         ///< 2 x points, pixels
  std::vector<Brightness> brightness;  ///< one for each image, or empty: all (1, 0)
  /// Patches that may count, those of a point in ascending order of images: what is known to be
  /// hidden is left out. Empty: every point in every image but its host.
  std::vector<std::uint32_t> sight_point, sight_image;
  /// Positions of points in images that were measured by other means, in any order, or none: what a
  /// refinement can be anchored to (PhotometricOptions::anchor_px).
  std::vector<std::uint32_t> measured_point, measured_image;
  std::vector<double> measured_xy;  ///< 2 for each, pixels

  std::size_t num_measurements() const { return measured_point.size(); }
  std::size_t num_points() const { return points.size() / 3; }
  bool has_hosts() const { return !host.empty(); }
};

/// Checks sizes, index ranges, finite numbers and unit quaternions. The message names the first
/// offending entry.
Result<void> validate(const PhotometricProblem& problem);

/// How far poses are moved for an experiment.
struct PoseNoise {
  double rotation_rad = 0;  ///< every image is turned by this, about an axis of its own,
  double center = 0;  ///< and its centre moved by this, scene units, in a direction of its own
  std::uint64_t seed = 1;
};

/// Disturbs the poses; points on rays keep their place and depth in their host. The same options
/// give the same bytes on every machine. Errors: ErrorCode::usage for what is negative or not
/// finite.
Result<void> disturb(PhotometricProblem& problem, const PoseNoise& noise);

/// How an image is read between its pixels.
enum class Interpolation {
  bicubic,         ///< Catmull-Rom, exact derivative
  bilinear,        ///< with the bilinear interpolation of central differences as slope
  bilinear_exact,  ///< with its own slope
};

enum class Warp {
  automatic,      ///< inverse_depth where points have a host, else translation
  translation,    ///< all pixels of a patch move with its middle
  inverse_depth,  ///< each pixel is projected by itself, at the depth of the patch's middle
};

enum class Parametrisation {
  automatic,      ///< inverse_depth where points have a host, else xyz
  xyz,            ///< three numbers a point, in the world; stored patches
  inverse_depth,  ///< one number a point, along its host's ray
};

/// A patch that leaves its image, or goes behind it.
enum class Leaving {
  truncated,  ///< costs as much as it did at the start of the round, and no less than the mean
  free,       ///< costs nothing, and any patch may come in at any time (compatibility)
};

/// How the pixels of a patch that is warped by inverse depth enter a step. The cost is the same.
enum class PatchRows {
  shared,  ///< with the derivatives of the patch's middle: two rows a patch
  exact,   ///< each with its own: six rows a patch, by plain code, several times slower
};

struct PhotometricOptions {
  int max_iterations = 100;  ///< trust region steps tried, rejected ones included, over all levels
  double tolerance = 1e-6;   ///< stop when the relative cost decrease stays below this twice ...
  double motion_px = 0.01;   ///< ... and the median patch moves less than this
  Interpolation interpolation = Interpolation::bicubic;
  Warp warp = Warp::automatic;
  Parametrisation parametrisation = Parametrisation::automatic;
  std::string pattern = "4x4";  ///< where patches are taken from hosts
  bool affine_brightness = true;
  double prior_a = 1;    ///< weak priors a = 1, b = 0: standard deviations, weighed against pixels
  double prior_b = 100;  ///< of one grey level's
  Loss loss = Huber{};   ///< scale in grey levels; automatic: from the median residual
  bool loss_per_patch = false;  ///< of a patch's residuals as one vector, not of each pixel's
  int rounds = 3;  ///< at most, on each level: what is seen is decided again at each one's start
  double min_zncc = -1;  ///< patches that correlate less at a round's start are left out
  Leaving leaving = Leaving::truncated;
  int levels = 1;  ///< of the pyramid
  bool fix_poses = false, fix_points = false;
  PatchRows rows = PatchRows::shared;
  /// Automatic: dense while the factor costs about as much as the pixels, then sparse.
  CameraSolverKind solver = CameraSolverKind::automatic;
  /// Standard deviation of the problem's measured positions, pixels of the full image. They cost
  ///   sigma^2 / 2 sum rho(|u - measured|^2 / anchor_px^2)
  /// beside the patches, sigma being a pixel's standard deviation in grey levels, estimated anew at
  /// each round's start (1.4826 x the median |r|, at least 1). Infinite: they cost nothing.
  double anchor_px = std::numeric_limits<double>::infinity();
  Loss anchor_loss{};          ///< of measured positions; its scale is in standard deviations
  double initial_damping = 0;  ///< 0: the default rule
  int threads = 0;             ///< 0: all; the result does not depend on it
  double time_limit_s = std::numeric_limits<double>::infinity();
  std::uint64_t memory_limit_bytes = 0;  ///< 0: none; else refuse what is forecast to exceed it
  std::function<bool(const Iteration&)> on_iteration{};  ///< return false to stop
  StopToken stop{};
  /// As SolveOptions has them.
  std::string checkpoint{};
  double checkpoint_every_s = 60;
  std::string resume{};
};

/// A patch in an image that shows it.
struct PatchSight {
  std::uint32_t point = 0, image = 0;
  double x = 0, y = 0;  ///< of its middle in the image, pixels
  double rms_grey = 0;  ///< of its residuals, as the refinement reads them
};

/// What the images say of a state, patch by patch and point by point.
struct PhotometricDetails {
  std::vector<PatchSight> seen;  ///< patches that count at this state: by point, then by image
  double sigma_grey = 0;         ///< noise of a pixel of the images, from the median residual
  /// Standard deviations that this noise leaves the points, poses and brightness taken as known:
  /// one number a point (of its inverse depth, 1 / scene units) or three (of X, Y, Z). Infinite
  /// where the patches do not determine the point.
  std::vector<double> sigma;
  bool of_inverse_depth = false;
};

/// A scene whose truth is known: waves of grey on a smooth height field, seen by cameras above it.
/// Every pixel is the texture at the point where its ray meets the surface, so that images have no
/// error but what is asked for. The same options give the same bytes on every machine.
struct PhotometricSceneOptions {
  std::uint32_t images = 6;
  std::uint32_t points = 2000;
  int width = 320, height = 240;
  double wavelength_px = 12;  ///< of the finest wave, where a camera sees it from straight above
  double relief = 0.04;       ///< height of the surface's waves, in depths of the cameras
  bool eight_bit = false;     ///< round to whole grey levels within 0 to 255
  double noise_grey = 0;      ///< standard deviation of a pixel's noise
  double brightness = 0;      ///< size of the images' own a - 1; b is 40 times as large
  double vignette = 0;        ///< how much darker an image's corner is
  bool occluder = false;      ///< a square that hides part of the surface and has no points
  double outliers = 0;        ///< fraction of points that start at a depth that is wrong by half
  double start_px = 1;        ///< median distance of patches from their place at the start
  double measured_px = -1;    ///< noise of points' measured positions; below 0: none are measured
  std::uint64_t seed = 1;
};

struct PhotometricScene {
  PhotometricProblem start;  ///< disturbed poses and depths, brightness (1, 0)
  PhotometricProblem truth;
};

/// Errors: ErrorCode::usage for options that make no scene.
Result<PhotometricScene> generate(const PhotometricSceneOptions& options);

}  // namespace sheaf
