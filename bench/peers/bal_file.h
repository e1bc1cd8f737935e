// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// The peers read and write BAL files on their own, so that a mistake in the engine's reader cannot
// hide in a comparison.
#pragma once

#include <string>
#include <vector>

namespace peer {

/// BAL camera: angle-axis (3), translation (3), f (px), k1, k2.
constexpr int camera_size = 9;

struct BalFile {
  struct Observation {
    int camera, point;
    double u, v;  ///< px
  };
  std::vector<Observation> observations;
  std::vector<double> cameras;  ///< 9 each
  std::vector<double> points;   ///< 3 each

  int camera_count() const { return static_cast<int>(cameras.size()) / camera_size; }
  int point_count() const { return static_cast<int>(points.size()) / 3; }
};

/// False with a message on stderr when the file cannot be read in full.
bool read_bal(const std::string& path, BalFile& file);
bool write_bal(const std::string& path, const BalFile& file);

}  // namespace peer
