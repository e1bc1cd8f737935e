// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "platform/portable_math.h"
#include "platform/random.h"
#include "scene/view.h"

namespace sheaf {
namespace {

constexpr std::uint64_t kSpotStream = 111, kViewStream = 112, kOrderStream = 113,
                        kDriftStream = 114;
constexpr double kTurn = 6.28318530717958647692;
constexpr double kCell = 0.35;  // side of a house

// What people photograph. Each spot lies on from another, mostly from the one before it: the
// streets of a town, with branches.
struct Spot {
  double x = 0, y = 0;
  double direction = 0;  // from where most photographs are taken, radians
  double heading = 0;    // of the way there
  std::uint32_t parent = 0;
};

std::vector<Spot> make_spots(std::size_t count, Random& random) {
  std::vector<Spot> spots(count);
  for (std::size_t k = 0; k < count; ++k) {
    Spot& spot = spots[k];
    const double u = random.uniform();
    spot.parent = static_cast<std::uint32_t>((1 - u * u * u) * static_cast<double>(k));
    spot.direction = kTurn * random.uniform();
    spot.heading =
        k == 0 ? kTurn * random.uniform() : spots[spot.parent].heading + 0.6 * random.normal();
    const SineCosine to = portable_sine_cosine(spot.heading);
    const double distance = random.uniform(2.2, 3.4);
    if (k == 0) continue;
    spot.x = spots[spot.parent].x + distance * to.cosine;
    spot.y = spots[spot.parent].y + distance * to.sine;
    // Streets lead people around: the view does not turn at once.
    spot.direction = spots[spot.parent].direction + 0.3 * random.normal();
  }
  return spots;
}

// Which spot each image shows. Popularity falls with the rank like Zipf's law; a spot has at least
// a few images.
std::vector<std::uint32_t> share_images(std::uint32_t images, std::size_t spots) {
  std::vector<double> ends(spots);
  double sum = 0;
  for (std::size_t k = 0; k < spots; ++k) {
    const double rank = static_cast<double>(k + 1);
    sum += 1 / rank + 1 / std::sqrt(rank * std::sqrt(rank));
    ends[k] = sum;
  }
  const std::uint32_t least =
      std::min<std::uint32_t>(8, images / static_cast<std::uint32_t>(spots));
  const double rest = images - least * static_cast<double>(spots);
  std::vector<std::uint32_t> spot_of(images);
  std::uint32_t at = 0;
  for (std::size_t k = 0; k < spots; ++k) {
    const auto end = k + 1 == spots ? images
                                    : static_cast<std::uint32_t>(rest * ends[k] / sum) +
                                          least * static_cast<std::uint32_t>(k + 1);
    while (at < end) spot_of[at++] = static_cast<std::uint32_t>(k);
  }
  return spot_of;
}

// Rows right, up, back for a camera that looks from the direction `back`, upright but for roll.
Matrix3<double> looking_from(const Vector3<double>& back, double roll) {
  const double n = std::sqrt(back[0] * back[0] + back[1] * back[1]);
  const Vector3<double> right = {-back[1] / n, back[0] / n, 0};
  const Vector3<double> up = {-back[2] * right[1], back[2] * right[0],
                              back[0] * right[1] - back[1] * right[0]};
  const SineCosine r = portable_sine_cosine(roll);
  Matrix3<double> R;
  for (int k = 0; k < 3; ++k) {
    R[k] = r.cosine * right[k] + r.sine * up[k];
    R[3 + k] = r.cosine * up[k] - r.sine * right[k];
    R[6 + k] = back[k];
  }
  return R;
}

struct Target {
  double x, y;
};

// `number` counts the images of a spot: every sixth stands between the spot and its parent.
View make_view(const std::vector<Spot>& spots, std::uint32_t group, std::uint32_t number, bool few,
               double focal_px, Random& random, Target& target) {
  const Spot& spot = spots[group];
  const Spot& parent = spots[spot.parent];
  const bool between = number % 6 == 0;
  const double part = !between ? 0 : number == 0 ? 0.5 : random.uniform();
  const double spread = few ? 0.3 : 0.45;
  target = {spot.x + part * (parent.x - spot.x) + spread * random.normal(),
            spot.y + part * (parent.y - spot.y) + spread * random.normal()};
  const double zoom = growth(0.3 * random.normal());
  const double distance = std::clamp(
      2.2 * std::sqrt(zoom) * growth(0.25 * random.normal()) * (between ? 1.4 : 1), 0.9, 14.0);
  const double side = random.uniform() < 0.3 && number > 0 ? (few ? 0.75 : 0.6) : 0;
  const SineCosine a =
      portable_sine_cosine(spot.direction + part * (parent.direction - spot.direction) + side +
                           (few ? 0.07 : 0.1) * random.normal());
  const SineCosine e = portable_sine_cosine(random.uniform(0.38, 0.55));
  const Vector3<double> back = {e.cosine * a.cosine, e.cosine * a.sine, e.sine};
  const double roll = 0.03 * random.normal();
  View view;
  view.center = {target.x + distance * back[0], target.y + distance * back[1], distance * back[2]};
  view.rotation = looking_from(back, roll);
  view.intrinsics = {focal_px * zoom, -0.06 + 0.05 * random.normal(), 0.03 * random.normal()};
  const double half = std::clamp(0.42 * growth(0.25 * random.normal()), 0.2, 0.7);
  const bool portrait = random.uniform() < 0.2;
  view.half_x = portrait ? 0.75 * half : half;
  view.half_y = portrait ? half : 0.75 * half;
  view.weight = growth((few ? 0.3 : 0.8) * random.normal());
  if (!few && random.uniform() < 0.02) view.weight = 0.02;
  view.group = group;
  return view;
}

// Index along Hilbert's curve of order 16.
std::uint64_t hilbert(std::uint32_t x, std::uint32_t y) {
  std::uint64_t d = 0;
  for (std::uint32_t s = 1u << 15; s > 0; s >>= 1) {
    const std::uint32_t rx = (x & s) != 0, ry = (y & s) != 0;
    d += std::uint64_t{s} * s * ((3 * rx) ^ ry);
    if (ry == 0) {
      if (rx == 1) x = 65535 - x, y = 65535 - y;
      std::swap(x, y);
    }
  }
  return d;
}

// The views' order along the curve, or along it within each of their groups; `shift` (of the
// square's side) moves its seams.
std::vector<std::uint32_t> curve_order(const std::vector<Target>& targets,
                                       const std::vector<std::uint32_t>& groups, double shift) {
  double low = 0, high = 0;
  for (const Target& t : targets) {
    low = std::min({low, t.x, t.y});
    high = std::max({high, t.x, t.y});
  }
  const double size = 1.5 * (high - low) + 1e-9;
  const auto grid = [&](double v) {
    return static_cast<std::uint32_t>(65535 * ((v - low) / size + shift));
  };
  std::vector<std::array<std::uint64_t, 3>> keys(targets.size());
  for (std::uint32_t i = 0; i < targets.size(); ++i)
    keys[i] = {groups.empty() ? 0 : groups[i], hilbert(grid(targets[i].x), grid(targets[i].y)), i};
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(targets.size());
  for (std::size_t i = 0; i < keys.size(); ++i) order[i] = static_cast<std::uint32_t>(keys[i][2]);
  return order;
}

// Each spot was put together by itself and joined to its parent: errors add up along the tree. They
// fade over some spots, as where branches meet and are joined once more.
std::vector<Drift> join(const std::vector<Spot>& spots, double size, Random& random) {
  constexpr double kKept = 0.85;
  std::vector<Drift> drifts(spots.size());
  for (std::size_t k = 0; k < spots.size(); ++k) {
    const Drift& parent = drifts[spots[k].parent];
    const Vector3<double> position = {spots[k].x, spots[k].y, 0};
    const Vector3<double> carried = parent(position);
    Vector3<double> turn = portable_angle_axis(parent.turn);
    const Vector3<double> own_turn = normal3(random, 0.003 * size);
    const Vector3<double> move = normal3(random, 0.004 * size);
    Drift drift;
    drift.from = position;
    for (int i = 0; i < 3; ++i) {
      drift.to[i] = position[i] + kKept * (carried[i] - position[i]) + move[i];
      turn[i] = kKept * turn[i] + own_turn[i];
    }
    drift.turn = portable_quaternion(turn);
    drift.scale = std::max(1 + kKept * (parent.scale - 1) + 0.004 * size * random.normal(), 0.5);
    drifts[k] = drift;
  }
  return drifts;
}

void number_files(std::vector<View>& views, Random& random) {
  std::vector<std::uint32_t> places(views.size());
  std::iota(places.begin(), places.end(), 0u);
  for (std::size_t i = places.size(); i > 1; --i) std::swap(places[i - 1], places[random.below(i)]);
  for (std::size_t i = 0; i < views.size(); ++i) views[i].file_index = places[i];
}

}  // namespace

Layout make_collection(const FamilyOptions& options) {
  const auto images = static_cast<std::uint32_t>(options.images);
  const bool few = images < 60;
  Random spot_random(options.seed, kSpotStream);
  const std::vector<Spot> spots = make_spots(few ? 1 : images / 40, spot_random);
  const std::vector<std::uint32_t> spot_of = share_images(images, spots.size());
  Random random(options.seed, kViewStream);
  std::vector<View> views(images);
  std::vector<Target> targets(images);
  const double focal_px = options.focal_px > 0 ? options.focal_px : 1500;
  std::uint32_t number = 0;
  for (std::uint32_t i = 0; i < images; ++i) {
    number = i > 0 && spot_of[i] == spot_of[i - 1] ? number + 1 : 0;
    views[i] = make_view(spots, spot_of[i], number, few, focal_px, random, targets[i]);
  }

  Layout layout;
  layout.family = SceneFamily::collection;
  const std::vector<std::uint32_t> order = curve_order(targets, {}, 0);
  layout.views.reserve(images);
  std::vector<std::uint32_t> rank(images);
  for (std::uint32_t i = 0; i < images; ++i) {
    layout.views.push_back(views[order[i]]);
    rank[order[i]] = i;
  }
  // Where popular spots crowd out a small one, its images still find each other by spot.
  layout.second_order = curve_order(targets, spot_of, 1.0 / 3);
  layout.second_rank.resize(images);
  for (std::uint32_t i = 0; i < images; ++i) {
    std::uint32_t& view = layout.second_order[i];
    view = rank[view];
    layout.second_rank[view] = i;
  }
  Random order_random(options.seed, kOrderStream);
  number_files(layout.views, order_random);
  Random drift_random(options.seed, kDriftStream);
  layout.drifts = join(spots, options.drift, drift_random);
  return layout;
}

bool collection_point(const View& view, double x, double y, Random& random, Vector3<double>& X) {
  const Matrix3<double>& R = view.rotation;
  Vector3<double> ray;
  for (int k = 0; k < 3; ++k) ray[k] = x * R[k] + y * R[3 + k] - R[6 + k];
  const double share = random.uniform(), rare = random.uniform();
  double depth;
  // What lies far behind the spot is hidden by houses, but for a little.
  if (ray[2] < -0.24 || (ray[2] < -0.06 && rare < 0.04)) {
    depth = -view.center[2] / ray[2];
    // Houses: the ray ends on a wall or a roof of the cell where it would meet the ground.
    const auto cell = [&](int k) {
      const double v = view.center[k] + depth * ray[k];
      return static_cast<std::uint64_t>(std::floor(v / kCell) + (1 << 29));
    };
    const double u = Random(cell(0), cell(1)).uniform();
    const double height =
        std::min(0.9 * u * u * (share < 0.7 ? share / 0.7 : 0), 0.7 * view.center[2]);
    depth = (height - view.center[2]) / ray[2];
  } else {
    if (rare > 0.02) return false;  // sky, but for some hills far away
    depth = view.center[2] * (10 + 1500 * rare);
  }
  for (int k = 0; k < 3; ++k) X[k] = view.center[k] + depth * ray[k];
  return true;
}

}  // namespace sheaf
