// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "sheaf/loss.h"

namespace sheaf {

/// A symmetric 3x3 covariance, row-major, in squared units of what it is the covariance of. It must
/// be positive definite.
using Covariance3 = std::array<double, 9>;
inline constexpr Covariance3 kUnitCovariance3{1, 0, 0, 0, 1, 0, 0, 0, 1};

/// The loss of a term. Its scale counts in sigmas, as the term's residuals do, and is never
/// estimated.
struct TermLoss {
  LossKind kind = LossKind::none;
  double scale = 1;
};

/// Where a camera was has been measured, such as by GPS: cost 1/2 rho(e^T C^-1 e) with
/// e = R^T (lever_arm - t) - position. Without a lever arm that is the camera's centre.
struct CentrePrior {
  std::uint32_t image = 0;
  std::array<double, 3> position{};           ///< world, scene units
  Covariance3 covariance = kUnitCovariance3;  ///< scene units squared
  TermLoss loss{};
  std::array<double, 3> lever_arm{};  ///< where the antenna is in the camera's frame, scene units
};

/// The rotation of an image was measured: cost 1/2 rho(e^T C^-1 e), e = log(R rotation^-1),
/// radians.
struct RotationPrior {
  std::uint32_t image = 0;
  std::array<double, 4> rotation{1, 0, 0, 0};  ///< cam_from_world, unit quaternion (w, x, y, z)
  Covariance3 covariance = kUnitCovariance3;   ///< rad^2, in the camera's frame
  TermLoss loss{};
};

/// The direction of gravity was measured in a camera's frame: cost 1/2 rho(|e / sigma|^2),
/// e = (R down) x measured with unit vectors, the sine of the angle between them.
struct GravityPrior {
  std::uint32_t image = 0;
  std::array<double, 3> measured{0, 1, 0};  ///< unit vector, camera's frame
  std::array<double, 3> down{0, 0, -1};     ///< unit vector, world
  double sigma_rad = 1;
  TermLoss loss{};
};

/// The motion between two images was measured: cost 1/2 rho(|S d|^2) with
/// d = log(T_second T_first^-1 second_from_first^-1), (rho, phi).
struct RelativePosePrior {
  std::uint32_t first = 0, second = 0;         ///< images
  std::array<double, 4> rotation{1, 0, 0, 0};  ///< of second_from_first, unit quaternion
  std::array<double, 3> translation{};         ///< scene units
  std::array<double, 36> square_root{};        ///< S, row-major: S^T S is the inverse covariance
  TermLoss loss{};
};

/// A parameter of a lens was measured: cost 1/2 rho(((parameter - value) / sigma)^2).
struct ParameterPrior {
  std::uint32_t camera = 0;
  std::uint32_t parameter = 0;  ///< as the camera's model numbers them
  double value = 0, sigma = 1;  ///< in the parameter's unit
  TermLoss loss{};
};

/// A parameter of a lens stays within an interval that it starts in; an end may be infinite. It
/// costs nothing: where a parameter is at its bound and pushed outward, it is held for the step.
struct ParameterBound {
  std::uint32_t camera = 0;
  std::uint32_t parameter = 0;                              ///< as the camera's model numbers them
  double lower = -std::numeric_limits<double>::infinity();  ///< in the parameter's unit
  double upper = std::numeric_limits<double>::infinity();
};

/// A point was measured: cost 1/2 e^T C^-1 e, e = point - position. It has no loss: it is a part of
/// the point's own 3x3 system, which is eliminated.
struct PointPrior {
  std::uint32_t point = 0;
  std::array<double, 3> position{};           ///< world, scene units
  Covariance3 covariance = kUnitCovariance3;  ///< scene units squared
};

/// The distance between two points was measured: cost 1/2 rho(((|a - b| - distance) / sigma)^2).
/// Both points are kept, as Terms::kept_points says.
struct DistancePrior {
  std::uint32_t first = 0, second = 0;  ///< points
  double distance = 0, sigma = 1;       ///< scene units
  TermLoss loss{};
};

/// A Gaussian over several blocks at once, such as marginalisation leaves: cost
/// 1/2 |S (d - mean)|^2 with d the blocks' differences from a state, stacked: of a pose (rho, phi),
/// the six numbers of log(pose state^-1), of a camera its parameters, of a kept point X, Y, Z.
struct GaussianPrior {
  struct Block {
    enum class Kind : std::uint8_t { pose, camera, point } kind = Kind::pose;
    std::uint32_t index = 0;  ///< of the image, the camera or the kept point
    /// The state: of a pose its quaternion (w, x, y, z) and translation, of a camera its
    /// parameters, of a point X, Y, Z.
    std::vector<double> state;
  };
  std::vector<Block> blocks;
  std::vector<double> square_root;  ///< S: rows x columns, row-major; columns: the blocks' together
  std::vector<double> mean;         ///< one for each column; empty: 0
  TermLoss loss{};
};

/// What a problem knows beside observations: rows without a point (terms), rows on a point alone,
/// and the few points that are not eliminated because terms tie them. Costs count in sigmas.
struct Terms {
  std::vector<CentrePrior> centres;
  std::vector<RotationPrior> rotations;
  std::vector<GravityPrior> gravities;
  std::vector<RelativePosePrior> relative_poses;
  std::vector<ParameterPrior> parameters;
  std::vector<PointPrior> points;
  std::vector<DistancePrior> distances;
  std::vector<GaussianPrior> gaussians;
  std::vector<ParameterBound> bounds;  ///< one of a parameter
  /// Points that are columns of the camera system beside the images: hundreds, not thousands. Those
  /// that `distances` and `gaussians` name are kept whether they stand here or not.
  std::vector<std::uint32_t> kept_points;

  bool empty() const {
    return centres.empty() && rotations.empty() && gravities.empty() && relative_poses.empty() &&
           parameters.empty() && points.empty() && distances.empty() && gaussians.empty() &&
           bounds.empty() && kept_points.empty();
  }
};

/// A parameter that ended at one of its bounds.
struct BoundReached {
  std::uint32_t camera = 0, parameter = 0;
  std::string name;  ///< of the parameter
  double value = 0;
  bool upper = false;
};

/// What each kind of terms costs: 1/2 sum rho, in sigmas squared.
struct TermCosts {
  double centres = 0, rotations = 0, gravities = 0, relative_poses = 0, parameters = 0, points = 0,
         distances = 0, gaussians = 0;
  double total() const {
    return centres + rotations + gravities + relative_poses + parameters + points + distances +
           gaussians;
  }
};

}  // namespace sheaf
