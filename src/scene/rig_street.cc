// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/rig_street.h"

#include <cmath>
#include <numbers>

#include "platform/portable_math.h"
#include "platform/random.h"

namespace sheaf {
namespace {

constexpr double kLeastRadius = 24;  // no wall reaches the middle of a bend
constexpr double kLobes = 0.1;
constexpr double kStretch = 6;  // of wall at one distance
constexpr std::uint64_t kWalls = std::uint64_t{9} << 40;

}  // namespace

RigStreet::RigStreet(double length, std::uint64_t seed) : length_(length), seed_(seed) {
  radius_ = length / (2 * std::numbers::pi);
  closed_ = radius_ >= kLeastRadius;
  if (!closed_) radius_ = kLeastRadius;
}

RigStreet::Place RigStreet::at(double s) const {
  const double angle = s / radius_;
  const SineCosine at = portable_sine_cosine(angle), lobe = portable_sine_cosine(3 * angle);
  const double r = radius_ * (1 + kLobes * lobe.cosine);
  const double outwards = -3 * kLobes * radius_ * lobe.sine;
  const double x = outwards * at.cosine - r * at.sine, y = outwards * at.sine + r * at.cosine;
  const double length = std::sqrt(x * x + y * y);
  Place place;
  place.position = {r * at.cosine, r * at.sine, 0};
  place.ahead = {x / length, y / length, 0};
  place.left = {-y / length, x / length, 0};
  return place;
}

/// Distance from the middle, 5 to 8 units, the same for all that look at one stretch.
double RigStreet::wall(double s, bool left) const {
  double along = s;
  if (closed_) along -= length_ * std::floor(along / length_);
  const auto stretch = static_cast<std::uint64_t>(std::floor(along / kStretch) + (1 << 20));
  return 5 + 3 * Random(seed_, kWalls + 2 * stretch + (left ? 1 : 0)).uniform();
}

RigStreet::Spot RigStreet::spot(double s, Random& random) const {
  const Place place = at(s);
  const double what = random.uniform(), height = random.uniform(), aside = random.uniform(),
               relief = random.uniform(-0.2, 0.2);
  const bool on_left = random.below(2) == 0;
  const double wall_at = wall(s, on_left), side = on_left ? 1 : -1;
  Spot out;
  double across = wall_at + relief, up = 7 * height;
  if (what < 0.45) {
    for (std::size_t k = 0; k < 3; ++k) out.normal[k] = -side * place.left[k];
  } else if (what < 0.65) {
    across = aside * wall_at;
    up = 0;
    out.normal = {0, 0, 1};
  } else {
    across = 2 + aside * (wall_at - 2);
    up = 3 * height;
  }
  for (std::size_t k = 0; k < 3; ++k) out.X[k] = place.position[k] + side * across * place.left[k];
  out.X[2] += up;
  return out;
}

}  // namespace sheaf
