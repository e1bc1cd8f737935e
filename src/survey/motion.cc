// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "survey/motion.h"

#include <algorithm>
#include <cmath>

#include "scene/rigs.h"
#include "scene/terms.h"

namespace sheaf {
namespace {

// The median of a normal error's length in three dimensions is 1.538 sigma; Cauchy's loss keeps 95
// % of the efficiency at 2.385 sigma.
constexpr double kSigmaOfMedian = 1 / 1.538, kCauchy = 2.385;

Vector3<double> difference(const Vector3<double>& a, const Vector3<double>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
double length(const Vector3<double>& v) { return std::hypot(v[0], v[1], v[2]); }

/// What was measured, in the model of a scale.
Vector3<double> antenna(const SurveyTie& tie, double scale) {
  Vector3<double> out = tie.from;
  for (std::size_t k = 0; k < 3; ++k) out[k] += tie.lever_arm[k] / scale;
  return out;
}
Vector3<double> error_of(const SurveyTie& tie, const Similarity& S) {
  return difference(S(antenna(tie, S.scale)), tie.to);
}
double sigmas_of(const SurveyTie& tie, const Similarity& S) {
  return length(multiply(*whitening(tie.covariance), error_of(tie, S)));
}
double median_of(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}
double variance(const SurveyTie& tie) {
  return (tie.covariance[0] + tie.covariance[4] + tie.covariance[8]) / 3;
}

std::vector<Vector3<double>> places_of(const std::vector<SurveyTie>& ties, double scale) {
  std::vector<Vector3<double>> out;
  for (const SurveyTie& tie : ties) out.push_back(antenna(tie, scale));
  return out;
}

/// The same turn with scale 1, at the weighted mean.
Similarity made_rigid(Similarity S, const std::vector<SurveyTie>& ties,
                      const std::vector<double>& weights) {
  S.scale = 1;
  S.translation = {};
  Vector3<double> sum{};
  double total = 0;
  for (std::size_t i = 0; i < ties.size(); ++i) {
    const Vector3<double> e = error_of(ties[i], S);
    for (std::size_t k = 0; k < 3; ++k) sum[k] -= weights[i] * e[k];
    total += weights[i];
  }
  for (std::size_t k = 0; k < 3; ++k) S.translation[k] = sum[k] / total;
  return S;
}

/// How far the ties stray, in the sigmas that they state; at least 1.
double spread(const std::vector<SurveyTie>& ties, const Similarity& S) {
  return std::max(1.0, kSigmaOfMedian * median_sigmas(ties, S));
}

Similarity robust_start(const std::vector<SurveyTie>& ties, const std::vector<Vector3<double>>& to,
                        bool rigid) {
  constexpr int kScales = 4;  // lever arms are known in the survey's unit, which the scale tells
  Similarity S = align_robustly(places_of(ties, 1), to).alignment.similarity;
  const bool arms = std::any_of(ties.begin(), ties.end(), [](const SurveyTie& tie) {
    return tie.lever_arm != Vector3<double>{0, 0, 0};
  });
  if (rigid || !arms) return S;
  for (int round = 0; round < kScales; ++round)
    S = align_robustly(places_of(ties, S.scale), to).alignment.similarity;
  return S;
}

}  // namespace

double median_sigmas(const std::vector<SurveyTie>& ties, const Similarity& motion) {
  std::vector<double> all;
  for (const SurveyTie& tie : ties) all.push_back(sigmas_of(tie, motion));
  return median_of(all);
}

SurveyMotion motion_of(const std::vector<SurveyTie>& ties, bool rigid) {
  constexpr int kRounds = 30;
  std::vector<Vector3<double>> to;
  for (const SurveyTie& tie : ties) to.push_back(tie.to);
  Similarity S = robust_start(ties, to, rigid);
  std::vector<double> weights(ties.size(), 1);
  if (rigid) {
    // The distance that is left tells a tie that is wrong from one that is right.
    const double typical = std::max(1e-300, [&] {
      std::vector<double> d;
      for (const SurveyTie& tie : ties) d.push_back(length(error_of(tie, S)));
      return median_of(d);
    }());
    for (std::size_t i = 0; i < ties.size(); ++i) {
      const double d = length(error_of(ties[i], S)) / (kCauchy * typical);
      weights[i] = 1 / (1 + d * d);
    }
    S = made_rigid(S, ties, weights);
  }
  for (int round = 0; round < kRounds; ++round) {
    const double c = kCauchy * spread(ties, S);
    for (std::size_t i = 0; i < ties.size(); ++i) {
      const double d = sigmas_of(ties[i], S) / c;
      weights[i] = 1 / (variance(ties[i]) * (1 + d * d));
    }
    S = align(places_of(ties, S.scale), to, weights).similarity;
    if (rigid) S = made_rigid(S, ties, weights);
  }
  SurveyMotion out{S, kOutlierSigmas * spread(ties, S), {}};
  for (const SurveyTie& tie : ties)
    if (const double sigmas = sigmas_of(tie, S); sigmas > out.threshold_sigmas)
      out.outliers.push_back({tie.name, length(error_of(tie, S)), sigmas});
  std::stable_sort(
      out.outliers.begin(), out.outliers.end(),
      [](const SurveyOutlier& a, const SurveyOutlier& b) { return a.sigmas > b.sigmas; });
  return out;
}

bool in_a_line(const std::vector<SurveyTie>& ties) {
  constexpr int kPowers = 200;
  constexpr double kThin = 1e-3, kTurn_rad = 0.5;
  Vector3<double> mean{};
  for (const SurveyTie& tie : ties)
    for (std::size_t k = 0; k < 3; ++k) mean[k] += tie.to[k] / static_cast<double>(ties.size());
  Vector3<double> along{0.577, 0.577, 0.578};
  for (int power = 0; power < kPowers; ++power) {
    Vector3<double> next{};
    for (const SurveyTie& tie : ties) {
      const Vector3<double> d = difference(tie.to, mean);
      const double dot = d[0] * along[0] + d[1] * along[1] + d[2] * along[2];
      for (std::size_t k = 0; k < 3; ++k) next[k] += dot * d[k];
    }
    const double norm = length(next);
    if (!(norm > 0)) return true;
    for (std::size_t k = 0; k < 3; ++k) along[k] = next[k] / norm;
  }
  double square = 0, off = 0, information = 0;
  for (const SurveyTie& tie : ties) {
    const Vector3<double> d = difference(tie.to, mean), across = cross(d, along);
    square += d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    const double off2 = across[0] * across[0] + across[1] * across[1] + across[2] * across[2];
    off += off2;
    information += off2 / variance(tie);
  }
  return off < kThin * kThin * square || information < 1 / (kTurn_rad * kTurn_rad);
}

}  // namespace sheaf
