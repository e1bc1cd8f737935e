// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "report/alignment.h"
#include "report/matching.h"
#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Of non-negative values; all 0 for none.
struct ErrorStatistics {
  double mean = 0, median = 0, rms = 0, max = 0;
};
ErrorStatistics statistics_of_errors(std::vector<double> values);

/// How an estimate is brought to its reference before they are compared.
enum class AlignBy {
  nothing,        ///< as the files have it
  least_squares,  ///< the Sim(3) that brings the camera centres together best
  robust,         ///< likewise, not led astray by some that are far off
};

/// What an estimate was aligned by. Where the camera centres do not determine a rotation well
/// (fewer than three, or almost on a line), the points take their place.
struct StateAlignment {
  bool aligned = false;  ///< false also where neither centres nor points determine it
  Similarity similarity;
  bool by_points = false;
  std::size_t places = 0;   ///< centres or points
  std::size_t inliers = 0;  ///< of them, with `robust`; all of them otherwise
};

/// Of frames (rotation and centre of rig_from_world) and of sensors that are no references
/// (rotation and translation of sensor_from_rig, the latter times the alignment's scale), in
/// radians and scene units of the reference. Empty where not both problems have frames of several
/// images, or where these do not group the images alike. Frames and sensors are told by their
/// images.
struct RigErrorLists {
  std::vector<double> frame_rotation_rad, frame_center;         ///< one for each frame with images
  std::vector<double> sensor_rotation_rad, sensor_translation;  ///< likewise for each sensor
};

/// Each error: a rotation's angle in radians, |t - t_reference|, distances of camera centres and
/// points. Scene units are the reference's. Lists are in the order of `matching`.
struct ErrorLists {
  Matching matching;
  StateAlignment alignment;
  std::vector<double> rotation_rad, translation, center;  ///< one for each common image
  std::vector<double> point;                              ///< one for each common point
  RigErrorLists rigs;
};

/// Of what the two have in common, by `match_models`; its errors.
Result<ErrorLists> list_errors(const Problem& estimate, const Problem& reference, AlignBy align);

/// How far an estimate is from a reference.
struct StateErrors {
  bool aligned = false;
  double scale = 1;  ///< of the Sim(3)
  ErrorStatistics rotation_error_rad;
  ErrorStatistics translation_error;
  ErrorStatistics center_error;
  ErrorStatistics point_error;
  bool has_points = true;  ///< whether it is known which points are the same
  bool has_rigs = false;   ///< whether there is something to compare in the next four
  ErrorStatistics frame_rotation_error_rad;
  ErrorStatistics frame_center_error;
  ErrorStatistics sensor_rotation_error_rad;
  ErrorStatistics sensor_translation_error;
};
StateErrors summarise(const ErrorLists& lists);

/// The two together, by least squares or raw.
Result<StateErrors> compare_states(const Problem& estimate, const Problem& reference, bool align);

}  // namespace sheaf
