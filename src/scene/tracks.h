// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "platform/random.h"
#include "scene/view.h"

namespace sheaf {

/// Track lengths with a heavy tail that ends: P(length >= 2 + x) = (1 - x / m)^2 / (1 + x / s)^2,
/// x = 0 ... m - 1. It is what the published problems follow closely.
class TrackLengths {
 public:
  /// 2 <= mean, 2 <= longest.
  TrackLengths(double mean, std::uint32_t longest);
  /// Of point i: the points together meet the distribution as evenly as can be.
  std::uint32_t of(std::uint64_t i) const;

 private:
  std::vector<double> tail_;
};

struct Track {
  Vector3<double> X{};
  std::uint32_t seed_view = 0;
  std::vector<std::uint32_t> views;  ///< the seed's first
};

/// Makes the tracks of a layout, each from the point's number alone.
class TrackMaker {
 public:
  TrackMaker(const Layout& layout, const FamilyOptions& options);

  void set_mean(double mean);
  std::uint32_t length_of(std::uint64_t i) const { return lengths_.of(i); }
  /// Makes the track of point i. The images found may be fewer than asked for, never below 2
  /// unless the seed's surroundings see nothing in common.
  void make(std::uint64_t i, Track& track);
  /// Points are numbered by the place in the file of the image that they were found in.
  std::uint32_t seed_of(std::uint64_t i) const;

 private:
  void share_points(std::uint64_t points);
  bool surface(const View& view, Random& random, Vector3<double>& X) const;
  double likeness(const View& view, const Vector3<double>& X, const Vector3<double>& from) const;
  std::uint32_t neighbour(std::uint32_t view, std::uint32_t reach, Random& random) const;
  void gather(std::uint32_t length, std::uint32_t attempt, Random& random, Track& track);

  const Layout& layout_;
  std::uint64_t seed_;
  std::uint32_t longest_;
  TrackLengths lengths_;
  std::vector<std::uint64_t> first_point_;  ///< of each image, by place in the file
  std::vector<std::uint32_t> view_at_;      ///< view by place in the file
  std::vector<std::uint64_t> taken_;        ///< by view: the last gathering that took it
  std::uint64_t gathering_ = 0;
};

}  // namespace sheaf
