// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/loss.h"
#include "sheaf/problem.h"

namespace sheaf {

/// What stands for the place, the turn and the size of a scene where measurements do not fix them.
/// Covariances mean nothing without it (docs/covariance.md).
enum class Gauge : std::uint8_t {
  automatic,     ///< data where these fix everything, else free_centres
  data,          ///< nothing is added: refused where something is left free
  free_centres,  ///< inner constraints: the trace over camera centres and frames is least
  free_points,   ///< inner constraints: the trace over points is least
  first_two,     ///< the first image's pose and the second one's distance from it are exact
};

struct CovarianceOptions {
  Gauge gauge = Gauge::automatic;
  Fixed fixed{};  ///< as in the solve: what is held has no covariance
  /// As at the end of the solve, with its scale (of an automatic one: the last round's).
  Loss loss{};
  /// Standard deviation of a residual in its own unit: px, or sigmas where there are sigmas or
  /// terms. 0: from the residuals.
  double sigma = 0;
  bool conditional = false;  ///< of points with cameras held, and of nothing else
  /// Points to tell of, by index, where not all are wanted.
  std::vector<std::uint32_t> point_ids;
  bool points = true;                    ///< tell of points at all
  bool observations = false;             ///< redundancy numbers of observations
  int threads = 0;                       ///< 0: as many as the machine offers
  std::uint64_t memory_limit_bytes = 0;  ///< 0: none; else refuse what is forecast to exceed it
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

  /// Of a step (rho, phi) of cam_from_world, T' = exp([rho, phi]^) T: scene units and radians. Of
  /// an image of a rig what its frame and its sensor make of it. Zero where an image is held.
  std::vector<Covariance6> poses;
  std::vector<std::array<double, 9>> centres;  ///< of camera centres, world, scene units squared
  std::vector<Covariance6> frames;             ///< of rig_from_world, likewise; zero: trivial
  std::vector<Covariance6> sensors;            ///< of sensor_from_rig
  /// Of each lens n x n with n its model's parameters; rows of held ones are zero.
  std::vector<std::vector<double>> lenses;
  /// Of each point, or of point_ids in their order; not finite where a point is not determined.
  std::vector<std::array<double, 9>> points;
  std::vector<ObservationReliability> observations;

  std::vector<WeakDirection> weak;  ///< by how far they are beyond the limits
  std::vector<std::string> words;   ///< sentences: gauge, sigma, what is not determined
  std::uint64_t undetermined_points = 0;
  double seconds = 0;
};

/// Covariances of all that is free, at the state of the problem, which should be an optimum.
/// Errors: usage for a problem that `validate` refuses, options that contradict it, a gauge that
/// does not suit; memory_limit.
Result<Covariance> covariance(const Problem& problem, const CovarianceOptions& options = {});

}  // namespace sheaf
