// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/tracks.h"

#include <algorithm>
#include <cmath>

namespace sheaf {
namespace {

constexpr std::uint64_t kTrackStream = std::uint64_t{1} << 40;
constexpr std::uint32_t kNone = UINT32_MAX;
constexpr std::uint64_t kFewest = 8;  // points found in each image, where there are enough

double tail_at(double x, double s, double most) {
  const double k = (1 - x / most) / (1 + x / s);
  return k * k;
}

double mean_above_two(double s, std::uint32_t most) {
  double sum = 0;
  for (std::uint32_t x = 1; x < most; ++x) sum += tail_at(x, s, most);
  return sum;
}

std::uint32_t longest_track(const FamilyOptions& options) {
  const double images = static_cast<double>(options.images);
  // The car leaves a place behind; how many strangers photograph one thing grows with all of them.
  const double longest = options.family == SceneFamily::street ? 150 : 24 * std::sqrt(images);
  return static_cast<std::uint32_t>(std::min(images, longest));
}

}  // namespace

TrackLengths::TrackLengths(double mean, std::uint32_t longest) {
  const std::uint32_t most = longest - 1;
  double low = 1e-3, high = 1;
  while (high < 1e9 && mean_above_two(high, most) < mean - 2) high *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    (mean_above_two(middle, most) < mean - 2 ? low : high) = middle;
  }
  for (std::uint32_t x = 0; x < most; ++x) tail_.push_back(tail_at(x, high, most));
}

std::uint32_t TrackLengths::of(std::uint64_t i) const {
  // Multiples of the golden ratio modulo 1.
  const double u = static_cast<double>((i * 0x9e3779b97f4a7c15u) >> 11) * 0x1p-53;
  const auto end =
      std::partition_point(tail_.begin(), tail_.end(), [&](double t) { return t > u; });
  return 1 + static_cast<std::uint32_t>(std::max<std::ptrdiff_t>(end - tail_.begin(), 1));
}

TrackMaker::TrackMaker(const Layout& layout, const FamilyOptions& options)
    : layout_(layout),
      seed_(options.seed),
      longest_(longest_track(options)),
      lengths_(2, longest_),
      view_at_(layout.views.size()),
      taken_(layout.views.size(), 0) {
  for (std::uint32_t v = 0; v < layout.views.size(); ++v) view_at_[layout.views[v].file_index] = v;
  share_points(options.points);
}

void TrackMaker::share_points(std::uint64_t points) {
  const std::uint64_t images = view_at_.size();
  const std::uint64_t least = std::min<std::uint64_t>(kFewest, points / images);
  double sum = 0;
  for (const View& view : layout_.views) sum += view.weight;
  const double rest = static_cast<double>(points - least * images);
  double so_far = 0;
  first_point_.assign(1, 0);
  for (std::uint64_t k = 0; k < images; ++k) {
    so_far += layout_.views[view_at_[k]].weight;
    first_point_.push_back(least * (k + 1) + static_cast<std::uint64_t>(rest * (so_far / sum)));
  }
  first_point_.back() = points;
}

void TrackMaker::set_mean(double mean) {
  lengths_ = TrackLengths(std::clamp(mean, 2.0, 0.5 * longest_ + 1), longest_);
}

std::uint32_t TrackMaker::seed_of(std::uint64_t i) const {
  const auto after = std::upper_bound(first_point_.begin(), first_point_.end(), i);
  return view_at_[static_cast<std::size_t>(after - first_point_.begin()) - 1];
}

bool TrackMaker::surface(const View& view, Random& random, Vector3<double>& X) const {
  const double x = view.half_x * random.uniform(-0.98, 0.98);
  const double y = view.half_y * random.uniform(-0.98, 0.98);
  return layout_.family == SceneFamily::street ? street_point(view, x, y, random, X)
                                               : collection_point(view, x, y, random, X);
}

// How likely the view finds the point again: 0 out of the frame or behind; 1 where it looks as it
// does from elsewhere, less with another scale, and nothing beyond 33 degrees.
double TrackMaker::likeness(const View& view, const Vector3<double>& X,
                            const Vector3<double>& from) const {
  const Vector3<double> P = view.in_camera(X);
  const double depth = -P[2];
  if (depth < 0.1 || std::fabs(P[0]) > view.half_x * depth || std::fabs(P[1]) > view.half_y * depth)
    return 0;
  double dot = 0, there = 0, here = 0;
  for (int k = 0; k < 3; ++k) {
    const double a = X[k] - from[k], b = X[k] - view.center[k];
    dot += a * b, there += a * a, here += b * b;
  }
  const double cosine2 = dot * dot / (there * here);
  if (dot <= 0 || cosine2 < 0.7) return 0;
  return std::min(there / here, here / there) * (cosine2 - 0.7) / 0.3;
}

// A view near in one of the orders: P(offset > k) = reach / (reach + k). kNone if there is none.
std::uint32_t TrackMaker::neighbour(std::uint32_t view, std::uint32_t reach, Random& random) const {
  const double u = random.uniform();
  const double k = 1 + static_cast<double>(static_cast<std::uint64_t>(reach * u / (1 - u)));
  const std::uint64_t choice = random.next();
  const double views = static_cast<double>(layout_.views.size());
  const bool second = (choice & 2) != 0;
  std::uint32_t base = view;
  if (layout_.family == SceneFamily::collection) {
    if (second) base = layout_.second_rank[view];
  } else if ((choice & 12) == 0) {
    base = layout_.revisit[view];
  }
  const double at = (choice & 1) != 0 ? base + k : base - k;
  if (!(at >= 0 && at < views)) return kNone;
  const auto index = static_cast<std::uint32_t>(at);
  return layout_.family == SceneFamily::collection && second ? layout_.second_order[index] : index;
}

void TrackMaker::gather(std::uint32_t length, std::uint32_t attempt, Random& random, Track& track) {
  const bool eager = attempt >= 10;  // takes whatever sees the point, from farther and farther
  ++gathering_;
  track.views.assign(1, track.seed_view);
  taken_[track.seed_view] = gathering_;
  const Vector3<double>& from = layout_.views[track.seed_view].center;
  const std::uint32_t reach =
      (layout_.family == SceneFamily::street ? 2 + length / 2 : 3 + (3 * length) / 4) +
      (eager ? 2 * attempt : 0);
  for (std::uint64_t draws = 40 + 14 * std::uint64_t{length}; draws > 0; --draws) {
    const std::uint32_t v = neighbour(track.seed_view, reach, random);
    if (v == kNone || taken_[v] == gathering_) continue;
    const View& view = layout_.views[v];
    const double chance = eager ? 0 : random.uniform() * (view.weight + 0.6);
    if (chance > view.weight) continue;
    if (!(likeness(view, track.X, from) * view.weight > chance)) continue;
    taken_[v] = gathering_;
    track.views.push_back(v);
    if (track.views.size() >= length) return;
  }
}

void TrackMaker::make(std::uint64_t i, Track& track) {
  Random random(seed_, kTrackStream + i);
  const std::uint32_t length = lengths_.of(i);
  const std::uint32_t seed = seed_of(i);
  // A car sees few points for long: those take some finding.
  const std::uint32_t retries =
      layout_.family == SceneFamily::street ? 1 + std::min(length / 8, 4u) : 1;
  Track best;
  for (std::uint32_t attempt = 0; attempt < 120; ++attempt) {
    // A view that sees nothing others see leaves its points to its neighbours.
    track.seed_view = attempt < 60 ? seed : neighbour(seed, attempt, random);
    if (track.seed_view == kNone) continue;
    if (!surface(layout_.views[track.seed_view], random, track.X)) continue;
    gather(length, attempt, random, track);
    if (track.views.size() > best.views.size()) best = track;
    if (best.views.size() >= length || (attempt >= retries && best.views.size() >= 2)) break;
  }
  track = best;
}

}  // namespace sheaf
