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

}  // namespace sheaf
