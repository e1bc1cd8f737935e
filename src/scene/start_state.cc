// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/start_state.h"

#include <algorithm>
#include <cmath>

#include "platform/random.h"

namespace sheaf {
namespace {

constexpr std::uint64_t kImageStream = std::uint64_t{2} << 40,
                        kPointStream = std::uint64_t{3} << 40;

ViewState state_of(const Vector3<double>& center, const Quaternion<double>& rotation,
                   const Vector3<double>& intrinsics) {
  ViewState state;
  state.angle_axis = portable_angle_axis(rotation);
  state.rotation = portable_matrix(portable_quaternion(state.angle_axis));
  state.translation = multiply(state.rotation, {-center[0], -center[1], -center[2]});
  state.intrinsics = intrinsics;
  return state;
}

// Largest angle, as a tangent, under which the track's images see the point, from the seed's.
double parallax(const Layout& layout, const Track& track) {
  const View& seed = layout.views[track.seed_view];
  double largest = 0;
  for (const std::uint32_t v : track.views) {
    double dot = 0, a2 = 0, b2 = 0;
    for (int k = 0; k < 3; ++k) {
      const double a = track.X[k] - seed.center[k], b = track.X[k] - layout.views[v].center[k];
      dot += a * b, a2 += a * a, b2 += b * b;
    }
    if (dot > 0) largest = std::max(largest, a2 * b2 / (dot * dot) - 1);
  }
  return std::sqrt(std::max(largest, 1e-12));
}

}  // namespace

std::vector<ViewState> true_states(const Layout& layout) {
  std::vector<ViewState> states(layout.views.size());
  for (const View& view : layout.views)
    states[view.file_index] =
        state_of(view.center, portable_quaternion(view.rotation), view.intrinsics);
  return states;
}

std::vector<ViewState> start_states(const Layout& layout, const FamilyOptions& options) {
  const double size = options.drift;
  if (size == 0) return true_states(layout);
  const bool street = layout.family == SceneFamily::street;
  std::vector<ViewState> states(layout.views.size());
  for (const View& view : layout.views) {
    Random random(options.seed, kImageStream + view.file_index);
    const Drift& drift = layout.drifts[view.group];
    Vector3<double> center = drift(view.center);
    // Most images are placed well, some badly.
    const double place = size * growth(std::clamp(0.8 * random.normal() - 0.6, -3.0, 1.2));
    const double bend = street ? 1 : std::min(1.0, 1500 / view.intrinsics[0]);
    const Vector3<double> step = normal3(random, (street ? 0.005 : 0.006) * bend * place);
    for (int k = 0; k < 3; ++k) center[k] += step[k];
    const Quaternion<double> jitter =
        portable_quaternion(normal3(random, (street ? 0.0025 : 0.0015) * bend * place));
    const Quaternion<double> back = {drift.turn[0], -drift.turn[1], -drift.turn[2], -drift.turn[3]};
    // Lenses start without distortion, as they do where nothing is known of them.
    const double keep = std::max(0.0, 1 - size);
    const Vector3<double> intrinsics = {
        view.intrinsics[0] * growth(std::clamp(0.012 * bend * place * random.normal(), -2.0, 2.0)),
        keep * view.intrinsics[1] + 1e-7 * size * random.normal(),
        keep * view.intrinsics[2] + 1e-12 * size * random.normal()};
    states[view.file_index] = state_of(
        center, multiply(multiply(jitter, portable_quaternion(view.rotation)), back), intrinsics);
  }
  return states;
}

Vector3<double> start_point(const Layout& layout, const FamilyOptions& options, std::uint64_t i,
                            const Track& track) {
  if (options.drift == 0) return track.X;
  Random random(options.seed, kPointStream + i);
  const View& seed = layout.views[track.seed_view];
  const Drift& drift = layout.drifts[seed.group];
  const double angle = parallax(layout, track);
  double stretch = options.drift * 1.0 * random.normal() / (seed.intrinsics[0] * angle);
  // A street's most distant points may come out behind the car.
  const bool far = layout.family == SceneFamily::street && angle < 0.02;
  stretch = std::clamp(stretch, -0.3, far ? 1.0 : 0.5);
  if (far && random.uniform() < 0.05 * std::min(options.drift, 1.0)) stretch = -2 - stretch;
  Vector3<double> X;
  for (int k = 0; k < 3; ++k) X[k] = track.X[k] + stretch * (track.X[k] - seed.center[k]);
  return drift(X);
}

std::array<double, 2> project(const ViewState& state, const Vector3<double>& X, bool& behind) {
  const Vector3<double> q = multiply(state.rotation, X);
  const Vector3<double> P = {q[0] + state.translation[0], q[1] + state.translation[1],
                             q[2] + state.translation[2]};
  behind = P[2] >= 0;
  const double x = -P[0] / P[2], y = -P[1] / P[2];
  const double n = x * x + y * y;
  const double scale =
      state.intrinsics[0] * (1 + n * (state.intrinsics[1] + n * state.intrinsics[2]));
  return {scale * x, scale * y};
}

}  // namespace sheaf
