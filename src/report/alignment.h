// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "geometry/rotation.h"
#include "scene/similarity.h"
#include "sheaf/problem.h"

namespace sheaf {

struct Alignment {
  Similarity similarity;
  /// How well the points determine the rotation, from 0 (not at all: fewer than three places, or
  /// places on a line) to about 1: the relative distance of the two largest eigenvalues.
  double certainty = 0;
};

/// Whether the scale of an alignment is sought, or is 1: then it is a rigid motion.
enum class AlignScale { free, one };

/// The similarity that minimises sum w_i |to_i - S(from_i)|^2 (Horn 1987: the rotation is the
/// largest eigenvector of a symmetric 4x4 matrix, whatever the scale); without weights each is 1.
/// The scale is 1 where `from` is a single place.
Alignment align(const std::vector<Vector3<double>>& from, const std::vector<Vector3<double>>& to,
                const std::vector<double>& weights = {}, AlignScale scale = AlignScale::free);

/// The same, not led astray where almost half the places are wrong: of the similarities through
/// three places each (chosen by a fixed seed) the one of least median distance, then weights
/// 1 / (1 + (distance / s)^2) (Cauchy's) with s = 2.385 sigma, sigma from the median distance,
/// until they settle. `inliers`: the places that end within 3 s.
struct RobustAlignment {
  Alignment alignment;
  std::size_t inliers = 0;
};
RobustAlignment align_robustly(const std::vector<Vector3<double>>& from,
                               const std::vector<Vector3<double>>& to,
                               AlignScale scale = AlignScale::free);

/// -R^T t of each image: where its camera is in the world.
std::vector<Vector3<double>> camera_centers(const Problem& problem);

}  // namespace sheaf
