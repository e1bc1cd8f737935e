// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/loss.h"
#include "sheaf/problem.h"
#include "sheaf/stop.h"

namespace sheaf {

/// The gauge stands for place, turn and size of a scene where measurements do not fix them.
/// Covariances mean nothing without it (docs/covariance.md).
enum class Gauge : std::uint8_t {
  automatic,     ///< data where these fix everything, else free_centres
  data,          ///< nothing is added: refused where something is left free
  free_centres,  ///< inner constraints: the trace over camera centres and frames is least
  free_points,   ///< inner constraints: the trace over points is least
  first_two,     ///< the first image's pose and the second one's distance from it are exact
};

/// How entries of the inverse are found.
enum class CovarianceSolver : std::uint8_t {
  automatic,  ///< factor; where that exceeds the memory limit and only a few images and points are
              ///< named: conjugate_gradients
  factor,     ///< all that the factor's pattern holds, at once
  conjugate_gradients,  ///< a solve for each parameter that is asked for; images must be named
};

struct CovarianceOptions {
  Gauge gauge = Gauge::automatic;
  Fixed fixed{};  ///< as in the solve: what is held has no covariance
  /// The loss is as at the end of the solve, with its scale (an automatic one's: the last round's).
  Loss loss{};
  /// Standard deviation of a residual in its own unit: px, or sigmas where there are sigmas or
  /// terms. 0: from the residuals.
  double sigma = 0;
  bool conditional = false;  ///< of points with cameras held, and of nothing else
  /// Points to tell of, by index, where not all are wanted.
  std::vector<std::uint32_t> point_ids;
  /// Images to tell of, by index, where not all are wanted.
  std::vector<std::uint32_t> image_ids;
  /// Pairs of images whose common covariance is told: one solve for each of their parameters.
  std::vector<std::array<std::uint32_t, 2>> image_pairs;
  /// Lenses together with the mean motion of their images, for projection_uncertainty.
  bool lens_motions = false;
  bool points = true;                    ///< tell of points at all
  bool observations = false;             ///< redundancy numbers of observations
  int threads = 0;                       ///< 0: as many as the machine offers
  std::uint64_t memory_limit_bytes = 0;  ///< 0: none; else refuse what is forecast to exceed it
  CovarianceSolver solver = CovarianceSolver::automatic;
  StopToken stop;  ///< asked between parts of the work, at least every tenth of a second or about
  double time_limit_s = std::numeric_limits<double>::infinity();  ///< of the call, s
};

/// How the work ended.
enum class CovarianceEnding : std::uint8_t {
  whole,
  stopped,     ///< by the stop token: nothing is told
  time_limit,  ///< likewise
};

/// Row-major; of what is held or not determined every number is 0 or not finite, as said.
using Covariance6 = std::array<double, 36>;

/// A parameter or a pair of parameters that the measurements do not determine, or hardly.
struct WeakDirection {
  std::string words;  ///< "k2 and k3 of camera 1 cannot be told apart (correlation 0.99995)"
  std::uint32_t camera = 0;
  std::vector<std::uint32_t> parameters;  ///< one, or two that go together
  double sigma = 0;        ///< of one: in its unit; infinite where nothing determines it
  double correlation = 0;  ///< of two
};

struct ObservationReliability {
  std::array<double, 2> redundancy{};  ///< r = 1 - (A C A^T P)_ii, in [0, 1]
  /// v / (sigma sqrt(r)): normal with sigma 1 where there is no blunder (Baarda's w-test).
  std::array<double, 2> standardised{};
};

/// Between the centres of two images, scene units. Without a known scale it is relative to what the
/// gauge holds.
struct Distance {
  double value = 0, sigma = 0;
};

struct Covariance {
  Gauge gauge = Gauge::data;          ///< that was used
  int deficit = 0;                    ///< how many of the seven freedoms of a scene the data leaves
  std::vector<std::string> freedoms;  ///< the names of those that are left wholly
  double sigma = 1;                   ///< of a residual, in its unit
  bool sigma_estimated = false;
  /// By how much a loss spreads the estimate: sigma^2 times this times the inverse of J^T W J.
  double loss_factor = 1;
  std::uint64_t rows = 0, unknowns = 0;
  double redundancy = 0;  ///< rows - unknowns + deficit

  /// Each image has one, or each of image_ids in order: of a step (rho, phi) of cam_from_world,
  /// T' = exp([rho, phi]^) T, in scene units and radians. An image of a rig has what its frame and
  /// its sensor make of it. It is zero where an image is held.
  std::vector<Covariance6> poses;
  std::vector<std::array<double, 9>> centres;  ///< of camera centres, world, scene units squared
  std::vector<Covariance6> frames;             ///< of rig_from_world, likewise; zero: trivial
  std::vector<Covariance6> sensors;            ///< of sensor_from_rig
  /// Each lens has n x n with n its model's parameters; rows of held ones are zero. It is empty
  /// where it was not asked for.
  std::vector<std::vector<double>> lenses;
  /// Each lens has (n + 6) x (n + 6): its parameters, then the mean (rho, phi) of the images that
  /// see something through it; it is empty where it was not asked for.
  std::vector<std::vector<double>> lens_motions;
  /// Each of image_pairs has (rho, phi) of the first (rows) by those of the second; not numbers
  /// where one of them is not determined.
  std::vector<Covariance6> pairs;
  std::vector<Distance> distances;  ///< of each of image_pairs
  /// Each point has one, or each of point_ids in order; not finite where it is not determined.
  std::vector<std::array<double, 9>> points;
  std::vector<ObservationReliability> observations;

  std::vector<WeakDirection> weak;  ///< by how far they are beyond the limits
  std::vector<std::string> words;   ///< sentences: gauge, sigma, what is not determined
  std::uint64_t undetermined_points = 0;
  CovarianceSolver solver = CovarianceSolver::factor;  ///< that was used
  double seconds = 0;
  /// Unless it is `whole`, everything but `seconds` is as in a Covariance of nothing.
  CovarianceEnding ending = CovarianceEnding::whole;
};

/// Covariances of all that is free, at the state of the problem, which should be an optimum.
/// Errors: usage for a problem that `validate` refuses, options that contradict it, a gauge that
/// does not suit; a time limit that is not above 0; memory_limit. A call that is stopped or out of
/// time is no error: see Covariance::ending.
Result<Covariance> covariance(const Problem& problem, const CovarianceOptions& options = {});

/// Where on an image a lens's uncertainty is told of.
struct ProjectionGrid {
  std::uint32_t columns = 60, rows = 40;  ///< from edge to edge of the image, at least 2 each
  double distance = 0;  ///< of the places that are seen, scene units; 0: infinitely far away
};

/// How far the pixel of a place that rests in the world moves as the lens and the images' poses,
/// which go together, vary.
struct ProjectionUncertainty {
  ProjectionGrid grid;
  std::vector<std::array<double, 2>> pixels;  ///< row by row
  /// xx, xy and yy of each, px^2. Not a number where the lens sees no direction there.
  std::vector<std::array<double, 3>> covariance;
  /// The square root of the larger eigenvalue, px.
  double worst_direction(std::size_t node) const;
};

/// The pixel of P in the camera's frame moves by J_lens dl + J_P (rho + phi x P), with dl the step
/// of the lens and (rho, phi) the mean step of its images: with a board of points held the
/// uncertainty that mrcal 2 states of a camera at the reference, where boards move by the inverse.
/// lens_motion: (n + 6) x (n + 6), of Covariance::lens_motions.
/// Errors: usage for a camera without an image size, a grid of fewer than two rows or columns, a
/// matrix of another size.
Result<ProjectionUncertainty> projection_uncertainty(const Camera& camera,
                                                     const std::vector<double>& lens_motion,
                                                     const ProjectionGrid& grid = {});

}  // namespace sheaf
