// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/problem.h"
#include "sheaf/terms.h"

namespace sheaf {

/// The kind says what the coordinates of a survey count in.
enum class WorldKind : std::uint8_t {
  local,      ///< a Cartesian frame whose numbers are small, taken as they are
  projected,  ///< metres far from their origin (UTM, a national grid, ECEF); an origin is taken off
  geodetic,   ///< WGS84 latitude and longitude (degrees), height above the ellipsoid (metres)
};

/// The frame of a survey's coordinates. What is solved is the *local* frame near its origin:
/// projected coordinates less the origin, or east, north and up (metres) there.
struct WorldFrame {
  WorldKind kind = WorldKind::local;
  std::string name;  ///< as the file calls it, such as "EPSG:32633"; may be empty
  /// In the coordinates of the frame; nothing until it is chosen. Of a local frame it is 0.
  std::optional<std::array<double, 3>> origin;
};

/// Coordinates go to the local frame and back; the origin of `frame` must be chosen.
std::array<double, 3> to_local(const WorldFrame& frame, const std::array<double, 3>& world);
std::array<double, 3> to_world(const WorldFrame& frame, const std::array<double, 3>& local);

/// Where the camera (or, with a lever arm, its antenna) of an image was.
struct ImagePosition {
  std::string image;                          ///< name
  std::array<double, 3> at{};                 ///< coordinates of the survey's frame
  Covariance3 covariance = kUnitCovariance3;  ///< of the local frame's axes, its unit squared
  std::array<double, 3> lever_arm{};          ///< in the camera's frame, unit of the local frame
  TermLoss loss{};
  std::uint64_t line = 0;  ///< of the file, from 1; 0: a file without lines
  std::uint32_t file = 0;  ///< of Constraints::paths
};

/// How an image was turned.
struct ImageRotation {
  std::string image;
  std::array<double, 4> rotation{1, 0, 0, 0};  ///< camera from local frame (w, x, y, z)
  Covariance3 covariance = kUnitCovariance3;   ///< rad^2, in the camera's frame
  TermLoss loss{};
  std::uint64_t line = 0;
  std::uint32_t file = 0;
};

/// Where down is in an image.
struct ImageGravity {
  std::string image;
  std::array<double, 3> down{0, 1, 0};  ///< unit vector in the camera's frame
  double sigma_rad = 1;
  TermLoss loss{};
  std::uint64_t line = 0;
  std::uint32_t file = 0;
};

/// Where a point of the survey is in an image.
struct SurveyMark {
  std::string image;
  std::array<double, 2> pixel{};  ///< as the model counts pixels
  double sigma_px = 1;
  std::uint64_t line = 0;
  std::uint32_t file = 0;
  /// `pixel` counts from the middle of the image, in its longer side; `place_survey` multiplies by
  /// the size that the model has of the image.
  bool normalised = false;
};

enum class SurveyRole : std::uint8_t {
  control,  ///< takes part
  check,    ///< is only measured
  tie,      ///< has no coordinates: an end of scale bars
};

struct SurveyPoint {
  std::string id;
  SurveyRole role = SurveyRole::control;
  std::array<double, 3> at{};                ///< coordinates of the survey's frame
  std::array<double, 3> sigma{1, 1, 1};      ///< per axis of the local frame
  std::optional<std::uint64_t> model_point;  ///< id of the model's point that it is
  std::vector<SurveyMark> marks;
  std::uint64_t line = 0;
  std::uint32_t file = 0;
};

/// A known distance between two points of the survey.
struct ScaleBar {
  std::string first, second;       ///< ids
  double distance = 0, sigma = 1;  ///< unit of the local frame
  TermLoss loss{};
  std::uint64_t line = 0;
  std::uint32_t file = 0;
};

/// A parameter of the lens of an image: measured, kept between bounds, or both.
struct LensValue {
  std::string image;
  std::string parameter;        ///< as the camera's model calls it: "fx", "k1"
  std::optional<double> value;  ///< in the parameter's unit
  double sigma = 1;             ///< of the value
  TermLoss loss{};
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  std::uint64_t line = 0;
  std::uint32_t file = 0;
};

/// Constraints are what a survey knows of a scene, by names.
struct Constraints {
  std::vector<std::string> paths;  ///< of the files, for messages
  WorldFrame frame;
  std::vector<ImagePosition> positions;
  std::vector<ImageRotation> rotations;
  std::vector<ImageGravity> gravities;
  std::vector<SurveyPoint> points;
  std::vector<ScaleBar> scale_bars;
  std::vector<LensValue> lenses;
  std::vector<std::string> notes;  ///< sentences about what of the file is not used
};

/// Reads survey.json, a gcp_list.txt or geo.txt of OpenDroneMap, a ground_control_points.json of
/// OpenSfM, a CSV of positions with accuracies, a database of COLMAP (its pose_priors), or the GPS
/// tags of a JPEG or of those in a folder; the content tells which (docs/constraints.md). Errors:
/// unreadable_input with file, line, what was found, what was expected.
Result<Constraints> read_constraints(const std::filesystem::path& path);
/// Several as one: their frames are of one kind and name, and no image has two positions, no point
/// two entries. Errors: likewise, naming both files.
Result<Constraints> read_constraints(const std::vector<std::filesystem::path>& paths);
/// The function reads the kinds that are text, from a text at hand.
Result<Constraints> parse_constraints(const std::string& text, const std::string& name);

/// A position or control point that the motion of the model leaves far from its coordinates.
struct SurveyOutlier {
  std::string name;     ///< "position of a.jpg", "control point 7"
  double distance = 0;  ///< unit of the local frame
  double sigmas = 0;    ///< sqrt(e^T C^-1 e)
};

/// A Survey says what became of constraints in a problem.
struct Survey {
  static constexpr std::uint32_t kNone = 0xffffffff;

  Constraints constraints;
  WorldFrame frame;                            ///< with its origin
  std::vector<std::uint32_t> position_image;   ///< of each position, or kNone: not used
  std::vector<std::uint32_t> point;            ///< of each point in the problem, or kNone
  bool moved = false;                          ///< a motion was applied: to all of the problem
  bool rigid = false;                          ///< and it left the scale as it was
  double scale = 1;                            ///< of that motion, X -> scale R X + translation
  std::array<double, 4> rotation{1, 0, 0, 0};  ///< w, x, y, z
  std::array<double, 3> translation{};
  std::uint64_t ties = 0;               ///< positions and control points that it was found by
  std::vector<SurveyOutlier> outliers;  ///< after the motion, worst first
  double threshold_sigmas = 0;          ///< beyond which these are
  std::vector<std::string> words;       ///< sentences about what was done
  std::vector<std::string> unused;      ///< FILE:LINE: what is not used and why

  /// The problem had these before points and terms were added.
  std::uint64_t own_points = 0, own_observations = 0;
  bool own_sigmas = false;
  std::shared_ptr<const SceneMetadata> metadata;
};

/// Moves a problem into the local frame of the constraints (a robust Sim(3); a rigid motion where
/// `fixed` holds sensors; none where it holds poses or points, or where fewer than three positions
/// and control points are used, but that the origin is taken off a model that is in place by the
/// survey's own projected coordinates), triangulates control points that the model lacks, and adds
/// terms and marks. The problem has no metadata until `finish_survey`. Errors: usage or
/// unreadable_input, and the problem is then as it was.
Result<Survey> place_survey(Problem& problem, const Constraints& constraints,
                            const Fixed& fixed = {});

/// Ties are what the motion into a survey's frame is found by.
enum class SurveyTies : std::uint8_t { all, positions, control };

struct SurveyMotionOptions {
  SurveyTies by = SurveyTies::all;
  bool rigid = false;  ///< the scale stays as it is
};

/// The motion alone is found, as by `place_survey`, and must be determined; nothing is adjusted.
/// What it is not found by is only measured. Errors: likewise.
Result<Survey> move_to_survey(Problem& problem, const Constraints& constraints,
                              const SurveyMotionOptions& options = {});

/// |residual / sigma| beyond which a blunder is named: of a normal error once in a thousand.
inline constexpr double kBlunderSigmas = 3.29;

struct MarkResidual {
  std::string image;
  std::array<double, 2> residual_px{};  ///< reprojection less mark
  double sigma_px = 1;
};

/// The residual is what was adjusted (a check point: triangulated) less what was stated.
struct SurveyResidual {
  std::string name;                  ///< image, or id of the point
  std::array<double, 3> residual{};  ///< along the local frame's axes, its unit
  std::array<double, 3> sigma{};     ///< as stated, likewise
  std::array<double, 3> adjusted{};  ///< coordinates of the survey's frame
  std::vector<MarkResidual> marks;   ///< of points
  double worst_sigmas = 0;           ///< largest |residual / sigma| of axes and marks
  bool blunder = false;              ///< worst_sigmas is above kBlunderSigmas
};

struct DistanceResidual {
  std::string first, second;
  double residual = 0, sigma = 1;  ///< unit of the local frame
  bool blunder = false;
};

/// Lists are worst first.
struct SurveyReport {
  std::vector<SurveyResidual> positions, control, check;
  std::vector<DistanceResidual> distances;
  /// Root mean squares along each axis; 0 of empty lists.
  std::array<double, 3> positions_rmse{}, control_rmse{}, check_rmse{};
};

/// Measures positions, points and distances in the adjusted problem, and takes out again what
/// `place_survey` has added.
SurveyReport finish_survey(Problem& problem, const Survey& survey);

/// One line of CSV for each residual: kind, name, axes, sigmas, adjusted coordinates.
std::string residuals_csv(const SurveyReport& report);

}  // namespace sheaf
