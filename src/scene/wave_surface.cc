// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "scene/wave_surface.h"

#include <cmath>

#include "platform/portable_math.h"

namespace sheaf {
namespace {

constexpr double kTwoPi = 6.283185307179586;
constexpr int kWaves = 10;
constexpr double kAmplitude = 12;  ///< grey levels: ten of them stray by 27 on average
constexpr double kMiddle = 127;
/// Of the square that hangs halfway between surface and cameras.
constexpr double kOccluderX = 0.25, kOccluderY = 0.15, kOccluderHalf = 0.2;

}  // namespace

WaveSurface::WaveSurface(const PhotometricSceneOptions& options, double focal_px, Random random)
    : relief_(options.relief * kDepth / 2), occluder_(options.occluder) {
  const double finest = kTwoPi * focal_px / (options.wavelength_px * kDepth);
  for (int k = 0; k < kWaves; ++k) {
    // From the finest to a third of it, in directions that cover all angles.
    const double rate = finest / (1 + 2.0 * k / (kWaves - 1));
    const SineCosine way = portable_sine_cosine(kTwoPi * (k * 0.382 + 0.05 * random.uniform()));
    waves_.push_back({rate * way.cosine, rate * way.sine, kTwoPi * random.uniform(), kAmplitude});
  }
}

double WaveSurface::height(double x, double y) const {
  return relief_ *
         (portable_sine_cosine(1.1 * x + 0.3).sine + portable_sine_cosine(0.9 * y + 0.7 * x).sine);
}

double WaveSurface::grey(double x, double y) const {
  double sum = kMiddle;
  for (const Wave& wave : waves_)
    sum += wave.amplitude * portable_sine_cosine(wave.x * x + wave.y * y + wave.phase).sine;
  return sum;
}

WaveSurface::Hit WaveSurface::hit(const Vector3<double>& origin,
                                  const Vector3<double>& direction) const {
  if (occluder_) {
    const double depth = (-kDepth / 2 - origin[2]) / direction[2];
    const double x = origin[0] + depth * direction[0], y = origin[1] + depth * direction[1];
    if (std::abs(x - kOccluderX) < kOccluderHalf && std::abs(y - kOccluderY) < kOccluderHalf)
      return {depth, grey(2 * x + 5, 2 * y + 7), true};
  }
  // The surface is flat enough for this to converge: each round is ten times closer and more.
  double depth = -origin[2] / direction[2];
  if (relief_ > 0)
    for (int i = 0; i < 8; ++i)
      depth =
          (height(origin[0] + depth * direction[0], origin[1] + depth * direction[1]) - origin[2]) /
          direction[2];
  return {depth, grey(origin[0] + depth * direction[0], origin[1] + depth * direction[1]), false};
}

}  // namespace sheaf
