// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>
#include <vector>

#include "platform/portable_math.h"
#include "platform/random.h"
#include "scene/view.h"

namespace sheaf {
namespace {

constexpr std::uint64_t kPathStream = 101, kViewStream = 102, kDriftStream = 103;
constexpr double kStep = 0.11;                // between images; the walls stand 1 to 2.2 away
constexpr std::uint32_t kImagesPerEdge = 60;  // from crossing to crossing
constexpr double kEdge = kStep * kImagesPerEdge;
constexpr double kCorner = 1.2;            // a turn begins that far before the crossing
constexpr std::uint32_t kLongestLoop = 8;  // edges
constexpr double kEye = 0.25;
constexpr double kRoof = 2.5;

// A drive through a grid of streets: edge e leads from crossing (x, y) in the direction (dx, dy).
struct Edge {
  std::int64_t x, y;
  int dx, dy;
};

// Every few crossings the car goes around a block (four lefts) and drives its first side again.
std::vector<Edge> drive(std::size_t edges, Random& random) {
  std::vector<Edge> path;
  Edge at{0, 0, 1, 0};
  int lefts = 4;
  while (path.size() < edges) {
    path.push_back(at);
    at.x += at.dx, at.y += at.dy;
    const double choice = random.uniform();
    const bool left = lefts > 0 || (choice >= 0.5 && choice < 0.75);
    if (lefts > 0) --lefts;
    if (left) {
      at = {at.x, at.y, -at.dy, at.dx};
    } else if (choice >= 0.75) {
      at = {at.x, at.y, at.dy, -at.dx};
    } else if (choice < 0.2) {
      lefts = 4;
    }
  }
  return path;
}

struct Plane {
  double x, y;
};

Plane on_path(const std::vector<Edge>& path, double s) {
  const double position = s / kEdge;
  const auto last = static_cast<std::int64_t>(path.size()) - 1;
  const std::int64_t e =
      std::clamp(static_cast<std::int64_t>(std::floor(position)), std::int64_t{0}, last);
  const double along = position - static_cast<double>(e);
  const Edge& edge = path[static_cast<std::size_t>(e)];
  return {kEdge * (edge.x + along * edge.dx), kEdge * (edge.y + along * edge.dy)};
}

// Rows right, up, back of a camera that looks along (forward, 0) turned by yaw, pitch and roll.
Matrix3<double> looking(Plane forward, double yaw, double pitch, double roll) {
  const SineCosine y = portable_sine_cosine(yaw), p = portable_sine_cosine(pitch),
                   r = portable_sine_cosine(roll);
  const double fx = y.cosine * forward.x - y.sine * forward.y;
  const double fy = y.sine * forward.x + y.cosine * forward.y;
  const double right[3] = {fy, -fx, 0};
  const double up[3] = {-p.sine * fx, -p.sine * fy, p.cosine};
  Matrix3<double> R;
  for (int k = 0; k < 3; ++k) {
    R[k] = r.cosine * right[k] + r.sine * up[k];
    R[3 + k] = r.cosine * up[k] - r.sine * right[k];
  }
  R[6] = -p.cosine * fx, R[7] = -p.cosine * fy, R[8] = -p.sine;
  return R;
}

View make_view(const std::vector<Edge>& path, std::uint32_t i, double lane, double focal_px,
               Random& random) {
  const double s = kStep * i;
  const Plane before = on_path(path, s - kCorner), here = on_path(path, s),
              after = on_path(path, s + kCorner);
  Plane forward{after.x - before.x, after.y - before.y};
  const double length = std::sqrt(forward.x * forward.x + forward.y * forward.y);
  forward = {forward.x / length, forward.y / length};
  View view;
  const Vector3<double> jitter = normal3(random, 0.012);
  view.center = {(before.x + 2 * here.x + after.x) / 4 - lane * forward.y + jitter[0],
                 (before.y + 2 * here.y + after.y) / 4 + lane * forward.x + jitter[1],
                 kEye + jitter[2]};
  // Three lenses take turns: ahead, half left, half right.
  const double heading = i % 3 == 0 ? 0 : (i % 3 == 1 ? 0.45 : -0.45);
  const Vector3<double> turn = normal3(random, 0.02);
  view.rotation = looking(forward, heading + turn[0], turn[1], turn[2]);
  view.intrinsics = {focal_px * (1 + 0.012 * random.normal()), -0.03 + 0.012 * random.normal(),
                     0.004 + 0.003 * random.normal()};
  view.half_x = 1.0;
  view.half_y = 1.3;
  view.weight = growth(0.25 * random.normal());
  if (random.uniform() < 0.02) view.weight = 0.05;
  view.group = i;
  return view;
}

// Errors as a chain of relative measurements leaves them: rotation and scale wander, and positions
// add up what they did. They return to zero over some thousand images, as after loops closed.
std::vector<Drift> wander(const std::vector<View>& views, double size, Random& random) {
  std::vector<Drift> drifts(views.size());
  constexpr double kReturn = 1 - 1.0 / 2000;
  Vector3<double> turn{0, 0, 0};
  double scale = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Vector3<double> step = normal3(random, 1.2e-4 * size);
    for (int k = 0; k < 3; ++k) turn[k] = kReturn * turn[k] + step[k];
    scale = kReturn * scale + 3e-4 * size * random.normal();
    Drift& drift = drifts[i];
    drift.turn = portable_quaternion(turn);
    drift.scale = 1 + std::max(scale, -0.5);
    drift.from = drift.to = views[i].center;
    if (i == 0) continue;
    Drift last = drifts[i - 1];
    last.turn = drift.turn;
    last.scale = drift.scale;
    drift.to = last(views[i].center);
  }
  return drifts;
}

// Images of edges driven a short loop before, in rings. A place seen again after a longer drive is
// not recognised: drift would have carried its two copies far apart.
std::vector<std::uint32_t> find_revisits(const std::vector<Edge>& path, std::uint32_t images) {
  std::vector<std::uint32_t> next(images);
  for (std::uint32_t i = 0; i < images; ++i) next[i] = i;
  std::unordered_map<std::uint64_t, std::uint32_t> last_drive;  // of a directed edge
  for (std::size_t e = 0; e * kImagesPerEdge < images; ++e) {
    const Edge& edge = path[e];
    const auto x = static_cast<std::uint64_t>(edge.x + (std::int64_t{1} << 28));
    const auto y = static_cast<std::uint64_t>(edge.y + (std::int64_t{1} << 28));
    const auto direction = static_cast<std::uint64_t>(edge.dx + 1 + 3 * (edge.dy + 1));
    const auto last = last_drive.find((x << 34) | (y << 4) | direction);
    const auto before = last == last_drive.end() ? UINT32_MAX : last->second;
    last_drive[(x << 34) | (y << 4) | direction] = static_cast<std::uint32_t>(e);
    if (before == UINT32_MAX || e - before > kLongestLoop) continue;
    for (std::uint32_t k = 0; k < kImagesPerEdge; ++k) {
      const auto i = static_cast<std::uint32_t>(e * kImagesPerEdge + k);
      if (i < images) std::swap(next[i], next[before * kImagesPerEdge + k]);
    }
  }
  return next;
}

// The lenses' images come in no strict order: each up to some twenty places late.
void number_files(std::vector<View>& views, Random& random) {
  std::vector<std::pair<double, std::uint32_t>> late(views.size());
  for (std::uint32_t i = 0; i < views.size(); ++i) late[i] = {i + random.uniform(0, 20), i};
  std::sort(late.begin(), late.end());
  for (std::uint32_t i = 0; i < views.size(); ++i) views[late[i].second].file_index = i;
}

// In [0, 1), the same for all who stand in the same stretch of street.
double wall_hash(double x, double y, int side) {
  const auto cell = [](double v) {
    return static_cast<std::uint64_t>(std::floor(v / 1.5) + (1 << 29));
  };
  return Random(cell(x) * 2 + static_cast<std::uint64_t>(side), cell(y)).uniform();
}

}  // namespace

Layout make_street(const FamilyOptions& options) {
  Random path_random(options.seed, kPathStream);
  const auto images = static_cast<std::uint32_t>(options.images);
  const std::vector<Edge> path = drive(images / kImagesPerEdge + 2, path_random);
  Layout layout;
  layout.family = SceneFamily::street;
  layout.views.reserve(images);
  Random random(options.seed, kViewStream);
  double lane = 0, next_lane = 0.08 * path_random.normal();
  const double focal_px = options.focal_px > 0 ? options.focal_px : 400;
  for (std::uint32_t i = 0; i < images; ++i) {
    const std::uint32_t k = i % kImagesPerEdge;
    if (k == 0) lane = next_lane, next_lane = 0.08 * path_random.normal();
    layout.views.push_back(
        make_view(path, i, lane + (next_lane - lane) * k / kImagesPerEdge, focal_px, random));
  }
  number_files(layout.views, random);
  layout.revisit = find_revisits(path, images);
  Random drift_random(options.seed, kDriftStream);
  layout.drifts = wander(layout.views, options.drift, drift_random);
  return layout;
}

bool street_point(const View& view, double x, double y, Random& random, Vector3<double>& X) {
  const Matrix3<double>& R = view.rotation;
  Vector3<double> ray;
  for (int k = 0; k < 3; ++k) ray[k] = x * R[k] + y * R[3 + k] - R[6 + k];
  // Streets run along x or y; the car drives along the one it faces more.
  const bool along_x = std::fabs(R[6]) > std::fabs(R[7]);
  const double aside = along_x ? ray[1] : ray[0];
  const double clutter = random.uniform(), far = random.uniform();
  const double wall = 1 + 1.2 * wall_hash(view.center[0], view.center[1], aside > 0);
  double depth = wall / std::max(std::fabs(aside), 1e-3);
  if (ray[2] < 0) depth = std::min(depth, -view.center[2] / ray[2] + 0.05);
  if (clutter < 0.2) depth *= 0.4 + 3 * clutter;
  const bool sky = view.center[2] + depth * ray[2] > kRoof;
  if (sky || depth > 9) {
    if (far > 0.03) return false;
    depth = 9 * 0.03 / std::max(far, 0.001);
  }
  depth = std::max(depth, 0.4);
  for (int k = 0; k < 3; ++k) X[k] = view.center[k] + depth * ray[k];
  return true;
}

}  // namespace sheaf
