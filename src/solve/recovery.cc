// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/recovery.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "starts/intersection.h"
#include "starts/resection.h"

namespace sheaf {
namespace {

/// A chain of passes ends where two of them, one of each kind, leave more than this of the cost.
/// Every chain begins with so many passes, and the cheapest goes on while two more, one of each
/// kind, leave less than kGains of the cost. Tried on 280 disturbed scenes and ten real ones: two
/// chains that go on, or longer beginnings, come home as often and take more passes.
constexpr std::size_t kBegin = 2, kLongest = 40;
constexpr double kGains = 0.95;

class Passes {
 public:
  Passes(const RecoveryRequest& request, Threads& threads)
      : request_(request),
        threads_(threads),
        sights_(request.problem, request.skip),
        free_(free_images(request.problem, request.fixed)) {}

  bool moves_points() const { return !request_.fixed.points; }
  bool moves_images() const {
    const auto is_free = [](std::uint8_t pose) { return pose != 0; };
    if (std::any_of(free_.pose.begin(), free_.pose.end(), is_free)) return true;
    for (std::size_t c = 0; c < free_.lens_held.size(); ++c)
      if (free_.lens_own[c] && free_.lens_held[c] != kAllParameters) return true;
    return false;
  }
  bool exhausted() const { return made_ >= request_.most_passes || request_.cancelled(); }
  int made() const { return made_; }

  void run(bool points, Estimate& state) {
    ++made_;
    if (points)
      intersect(sights_, request_.loss, request_.cancelled, threads_, state);
    else
      resect(sights_, free_, request_.loss, request_.cancelled, threads_, state);
  }
  double cost(const Estimate& state) {
    std::vector<double> of_image(sights_.num_images(), 0);
    threads_.for_each(of_image.size(), [&](std::size_t image) {
      of_image[image] = fit_of_image(sights_, image, state, request_.loss).cost;
    });
    double sum = 0;
    for (double cost : of_image) sum += cost;
    return sum;
  }

 private:
  const RecoveryRequest& request_;
  Threads& threads_;
  const Sights sights_;
  const FreeImages free_;
  int made_ = 0;
};

struct Chain {
  Estimate state;
  bool from_start;
  bool points_next;
  std::vector<double> costs{};  ///< before the first pass, and after each

  bool gains() const {
    const std::size_t n = costs.size();
    return n < 3 ? true : costs[n - 1] < kGains * costs[n - 3];
  }
};

/// Not finite is dearer than anything.
bool cheaper(double a, double b) { return a < b || (std::isnan(b) && !std::isnan(a)); }

}  // namespace

Recovered recover(const RecoveryRequest& request, const Estimate& start, const Estimate& reached,
                  Threads& threads) {
  Passes passes(request, threads);
  const bool points = passes.moves_points(), images = passes.moves_images();
  Recovered best;
  best.record.cost_before = best.record.cost_after = passes.cost(reached);
  std::vector<Chain> chains;
  for (const bool from_start : {true, false})
    for (const bool points_first : {false, true})
      if (points_first ? points : images)
        chains.push_back({from_start ? start : reached, from_start, points_first});
  const auto advance = [&](Chain& chain) {
    if (chain.costs.empty()) chain.costs.push_back(passes.cost(chain.state));
    passes.run(chain.points_next, chain.state);
    chain.points_next = points && (!images || !chain.points_next);
    chain.costs.push_back(passes.cost(chain.state));
    // A pass that was broken off leaves a state that is as good as any.
    if (!cheaper(chain.costs.back(), best.record.cost_after)) return;
    best.record.cost_after = chain.costs.back();
    best.record.from_start = chain.from_start;
    best.state = chain.state;
  };
  for (std::size_t pass = 0; pass < kBegin; ++pass)
    for (Chain& chain : chains)
      if (!passes.exhausted()) advance(chain);
  std::erase_if(chains, [](const Chain& chain) { return chain.costs.empty(); });
  const auto cheapest = std::min_element(
      chains.begin(), chains.end(),
      [](const Chain& x, const Chain& y) { return cheaper(x.costs.back(), y.costs.back()); });
  while (cheapest != chains.end() && !passes.exhausted() && cheapest->gains() &&
         cheapest->costs.size() <= kLongest)
    advance(*cheapest);
  best.record.passes = passes.made();
  best.found = best.record.cost_after < (1 - Recovered::kWorth) * best.record.cost_before ||
               (!std::isfinite(best.record.cost_before) && std::isfinite(best.record.cost_after));
  best.record.taken = best.found;
  return best;
}

}  // namespace sheaf
