// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/model_alignment.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

namespace sheaf {
namespace {

using Places = std::vector<Vector3<double>>;

// Places in a line whose width is w times its length have a certainty of about 2 w^2.
constexpr double kCertain = 2e-4;

double distance(const Vector3<double>& a, const Vector3<double>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// No two places are apart by more than rounding.
bool in_one_place(const Places& places) {
  double apart = 0, size = 0;
  for (const Vector3<double>& place : places) {
    apart = std::max(apart, distance(place, places[0]));
    size = std::max(size, distance(place, {}));
  }
  return !(apart > 1e-12 * size);
}

Error undetermined(const Places& from, const Places& to) {
  const std::string centers =
      "the centres of the " + std::to_string(from.size()) + " common images are ";
  if (in_one_place(from) || in_one_place(to))
    return Error(ErrorCode::usage, centers + "in one place in " +
                                       (in_one_place(from) ? "the model" : "the reference") +
                                       ": neither rotation nor scale is determined by them");
  return Error(ErrorCode::usage,
               centers + "in a line: the turn about that line is not determined by them");
}

}  // namespace

Result<ModelAlignment> align_models(const Problem& model, const Problem& reference,
                                    const ModelAlignmentOptions& options) {
  Result<Matching> matched = match_models(model, reference);
  if (!matched.ok()) return matched.error();
  ModelAlignment out;
  out.matching = std::move(matched).value();
  const Places from = camera_centers(common_of_estimate(model, out.matching));
  const Places to = camera_centers(common_of_reference(reference, out.matching));
  if (from.size() < 3)
    return Error(ErrorCode::usage,
                 "the two models have " + std::to_string(from.size()) +
                     " images: it takes the centres of three to determine a rotation");
  Alignment found;
  out.inliers = from.size();
  if (options.robust) {
    const RobustAlignment robust = align_robustly(from, to, options.scale);
    found = robust.alignment;
    out.inliers = robust.inliers;
  } else {
    found = align(from, to, {}, options.scale);
  }
  if (in_one_place(from) || in_one_place(to) || !(found.certainty > kCertain) ||
      !(found.similarity.scale > 0))
    return undetermined(from, to);
  out.similarity = found.similarity;
  for (std::size_t k = 0; k < from.size(); ++k)
    out.distances.push_back(distance(out.similarity(from[k]), to[k]));
  return out;
}

std::vector<std::size_t> worst_first(const ModelAlignment& alignment) {
  std::vector<std::size_t> order(alignment.distances.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return alignment.distances[a] > alignment.distances[b];
  });
  return order;
}

}  // namespace sheaf
