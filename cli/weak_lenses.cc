// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "weak_lenses.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>
#include <vector>

#include "sheaf/covariance.h"

namespace sheaf {

std::optional<Finding> weak_lenses(const Problem& problem, int threads) {
  constexpr std::size_t kMostImages = 500, kMostObservations = 200000, kShown = 4;
  if (problem.num_images() > kMostImages || problem.num_observations() > kMostObservations ||
      problem.num_observations() == 0)
    return {};
  CovarianceOptions options;
  options.sigma = 1;
  options.points = false;
  options.threads = threads;
  const Result<Covariance> found = covariance(problem, options);
  if (!found.ok() || found.value().weak.empty()) return {};
  Finding out{"weak-lenses", false, 0, "lenses", {}, ""};
  std::vector<std::string> worst;
  for (const WeakDirection& weak : found.value().weak) {
    if (std::find(out.first.begin(), out.first.end(), weak.camera) == out.first.end())
      out.first.push_back(weak.camera);
    if (worst.size() < kShown) worst.push_back(weak.words);
  }
  out.count = out.first.size();
  constexpr std::size_t kMostListed = 1000;
  out.first.resize(std::min(out.first.size(), kMostListed));
  out.words = fmt::format(
      "{} {} parameters that measurements with a sigma of 1 px would not determine: {}{}; "
      "hold them (--fix), share the lens, or take images that cover it (docs/covariance.md)",
      plural(out.count, "lens", "lenses"), out.count == 1 ? "has" : "have", fmt::join(worst, "; "),
      found.value().weak.size() > kShown ? " ..." : "");
  return out;
}

}  // namespace sheaf
