// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "platform/random.h"
#include "report/alignment.h"

namespace sheaf {
namespace {

using Places = std::vector<Vector3<double>>;

// With 45% of the places wrong, 300 triples miss a good one with probability (1 - 0.55^3)^300,
// about 1e-24; noise makes not every good triple serve, hence so many.
constexpr int kTriples = 300;
constexpr std::size_t kMostScored = 2000;  // places that a triple is held against

std::vector<double> distances(const Similarity& S, const Places& from, const Places& to) {
  std::vector<double> out(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Vector3<double> moved = S(from[i]);
    double square = 0;
    for (int k = 0; k < 3; ++k) square += (moved[k] - to[i][k]) * (moved[k] - to[i][k]);
    out[i] = std::sqrt(square);
  }
  return out;
}

double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Places thinned(const Places& places) {
  const std::size_t step = (places.size() + kMostScored - 1) / kMostScored;
  Places out;
  for (std::size_t i = 0; i < places.size(); i += step) out.push_back(places[i]);
  return out;
}

// The start: of all places together and of triples, what leaves the least median distance.
Alignment best_start(const Places& from, const Places& to, AlignScale scale) {
  Alignment best = align(from, to, {}, scale);
  double least = median_of(distances(best.similarity, from, to));
  Random random(1);
  for (int trial = 0; trial < kTriples; ++trial) {
    Places a, b;
    for (int k = 0; k < 3; ++k) {
      const std::uint64_t i = random.below(from.size());
      a.push_back(from[i]);
      b.push_back(to[i]);
    }
    const Alignment candidate = align(a, b, {}, scale);
    if (!(candidate.certainty > 1e-3) || !std::isfinite(candidate.similarity.scale)) continue;
    const double median = median_of(distances(candidate.similarity, from, to));
    if (median < least) {
      least = median;
      best = candidate;
    }
  }
  return best;
}

}  // namespace

RobustAlignment align_robustly(const Places& from, const Places& to, AlignScale scale) {
  RobustAlignment out;
  if (from.empty()) return out;
  out.alignment = best_start(thinned(from), thinned(to), scale);
  // The median of a normal error's length in three dimensions is 1.538 sigma.
  constexpr double kSigmaOfMedian = 1 / 1.538, kCauchy = 2.385;
  std::vector<double> weights(from.size());
  double s = 0;
  for (int round = 0; round < 100; ++round) {
    const std::vector<double> d = distances(out.alignment.similarity, from, to);
    const double before = s;
    s = kCauchy * kSigmaOfMedian * median_of(d);
    out.inliers = static_cast<std::size_t>(
        std::count_if(d.begin(), d.end(), [&](double x) { return x <= 3 * s; }));
    // The median at rounding means that half the places agree exactly: nothing is left to weigh.
    if (!(s > 0) || std::fabs(s - before) <= 1e-12 * s) break;
    for (std::size_t i = 0; i < d.size(); ++i) weights[i] = 1 / (1 + (d[i] / s) * (d[i] / s));
    out.alignment = align(from, to, weights, scale);
  }
  return out;
}

}  // namespace sheaf
