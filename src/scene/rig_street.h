// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "geometry/rotation.h"

namespace sheaf {

class Random;

/// A street that winds in a loop of three lobes between walls, z up, the ground at z = 0. All
/// numbers come out of correctly rounded operations: the same bits on every machine.
class RigStreet {
 public:
  /// Of at least `length` units; drives too short for a loop see a part of a larger one.
  RigStreet(double length, std::uint64_t seed);

  /// Whether the end of the drive is its beginning.
  bool closed() const { return closed_; }

  struct Place {
    Vector3<double> position{};  ///< on the ground, in the middle
    Vector3<double> ahead{}, left{};
  };
  /// s: about the way along the street, scene units.
  Place at(double s) const;

  struct Spot {
    Vector3<double> X{};
    Vector3<double> normal{};  ///< of the surface, towards the street; 0: seen from all sides
  };
  /// A place on a wall, on the ground, or on something that stands before the walls.
  Spot spot(double s, Random& random) const;

 private:
  double wall(double s, bool left) const;

  double length_;
  double radius_;
  bool closed_;
  std::uint64_t seed_;
};

}  // namespace sheaf
