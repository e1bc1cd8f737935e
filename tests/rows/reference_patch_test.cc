// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// The collapse of patches against its scalar twin: every instruction set is equivalent to the
// reference.
#include "rows/reference_patch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "eliminate/kernel_table.h"
#include "rows/patches.h"
#include "rows/row_layout.h"

namespace sheaf {
namespace {

using test::Patches;

struct Instructions {
  const PhotometricKernels* kernels;
  int lanes;  ///< of a part
};

std::vector<Instructions> compiled() {
  std::vector<Instructions> out{{&photometric_kernels("baseline"), 1}};
  for (const Kernels* of : available_kernels()) {
    const std::string name = of->name;
    if (name == "scalar") continue;
    const int lanes = name == "avx512" ? 8 : name == "avx2" ? 4 : 2;
    out.push_back({&photometric_kernels(of->name), lanes});
  }
  return out;
}

struct Settings {
  ScaledLoss loss{};
  bool loss_per_patch = false;
  bool brightness = true;
  bool warped = false;
  bool free_to_leave = false;
};

/// Everything that the kernel produces; rows field by field, lane by lane.
struct Outcome {
  std::vector<double> rows, factors, brightness, seen, costs;
  PhotometricOutput totals{};
};

Buffer<double> aligned(const std::vector<double>& v) {
  Buffer<double> out(v.size());
  std::copy(v.begin(), v.end(), out.begin());
  return out;
}

Outcome collapse(const Patches& p, const Instructions& by, const Settings& settings) {
  const std::size_t n = p.batches.num_batches();
  const Buffer<double> views = aligned(p.views), points = aligned(p.points), rays = aligned(p.rays),
                       leaving = aligned(p.leaving);
  Buffer<double> rows(kRowBatch * n), factors(patch_factors(settings.brightness) * n),
      brightness(kBrightnessBatch * n), seen(16 * n), costs(16 * n);
  for (Buffer<double>* of : {&rows, &factors, &brightness, &seen, &costs}) of->fill(0);
  const PhotometricInput in{&p.batches,
                            p.scene.planes.data(),
                            p.targets.data(),
                            views.data(),
                            points.data(),
                            p.scene.has_rays() ? rays.data() : nullptr,
                            p.scene.references.data(),
                            &p.scene.grid,
                            settings.free_to_leave ? nullptr : leaving.data(),
                            p.scene.camera,
                            p.scene.taps,
                            settings.loss,
                            settings.loss_per_patch,
                            settings.brightness,
                            settings.warped};
  Outcome out;
  out.totals = {rows.data(), factors.data(), brightness.data(), seen.data(), costs.data()};
  by.kernels->collapse(in, 0, static_cast<std::uint32_t>(p.batches.groups.size()), out.totals);
  for (std::size_t b = 0; b < n; ++b)
    for (int field = 0; field < row_field::kCount; ++field)
      for (int lane = 0; lane < 8; ++lane)
        out.rows.push_back(rows[kRowBatch * b + first_row_field(by.lanes, lane) +
                                static_cast<std::size_t>(by.lanes * field)]);
  out.factors.assign(factors.begin(), factors.end());
  out.brightness.assign(brightness.begin(), brightness.end());
  out.seen.assign(seen.begin(), seen.end());
  out.costs.assign(costs.begin(), costs.end());
  return out;
}

/// Eight numbers after each other are lanes of one field, of which each batch has `fields`; each
/// against the largest of its field, or this part of the largest of all.
void expect_close(const std::vector<double>& got, const std::vector<double>& expected,
                  std::size_t fields, double tolerance, double least, const char* what) {
  ASSERT_EQ(got.size(), expected.size());
  std::vector<double> largest(fields, 0);
  for (std::size_t i = 0; i < expected.size(); ++i)
    if (std::isfinite(expected[i]))
      largest[i / 8 % fields] = std::max(largest[i / 8 % fields], std::abs(expected[i]));
  const double all = *std::max_element(largest.begin(), largest.end());
  for (double& x : largest) x = std::max(x, least * all);
  for (std::size_t i = 0; i < expected.size(); ++i)
    if (std::isnan(expected[i]))
      ASSERT_TRUE(std::isnan(got[i])) << what << " " << i;
    else
      ASSERT_NEAR(got[i], expected[i], tolerance * largest[i / 8 % fields]) << what << " " << i;
}

/// least: what is smaller beside other fields may be rounding.
void expect_equivalence(const Patches& p, const Settings& settings, double least = 0) {
  constexpr double kTolerance = 1e-10;
  SCOPED_TRACE(std::string(to_string(settings.loss.kind)) +
               (settings.loss_per_patch ? " on patches" : " on pixels") +
               (settings.warped ? ", warped" : "") + (settings.brightness ? ", brightness" : "") +
               ", interpolation " + std::to_string(static_cast<int>(p.options.interpolation)));
  const Outcome expected = collapse(p, {&photometric_kernels("scalar"), kReferenceLanes}, settings);
  EXPECT_GT(expected.totals.cost, 0);
  for (const Instructions& by : compiled()) {
    SCOPED_TRACE(by.kernels->name);
    const Outcome got = collapse(p, by, settings);
    expect_close(got.rows, expected.rows, row_field::kCount, kTolerance, least, "row");
    expect_close(got.factors, expected.factors, patch_factors(settings.brightness) / 8, kTolerance,
                 least, "factor");
    expect_close(got.brightness, expected.brightness, 5, kTolerance, least, "brightness");
    expect_close(got.seen, expected.seen, 2, kTolerance, least, "place");
    expect_close(got.costs, expected.costs, 2, kTolerance, least, "cost");
    EXPECT_NEAR(got.totals.cost, expected.totals.cost, kTolerance * expected.totals.cost);
    EXPECT_NEAR(got.totals.square_sum, expected.totals.square_sum,
                kTolerance * expected.totals.square_sum);
    EXPECT_EQ(got.totals.left, expected.totals.left);
  }
}

/// World points that were taken from a pixel are seen at one, where slopes jump: a little beside,
/// by a camera whose focal lengths differ.
Patches beside_pixels(bool on_rays, Interpolation interpolation, const char* pattern = "4x4") {
  Patches p(on_rays, interpolation, pattern);
  p.scene.camera.fy *= 1.02;
  for (std::size_t b = 0; b < p.targets.size(); ++b)
    for (std::size_t i = 9; i < 12; ++i) p.views[kViewRecord * b + i] += 1e-3 / double(b + i);
  return p;
}

/// A camera that has lost its pose, so that where its patches are is not a number; and what they
/// cost then.
Patches some_left(bool on_rays, Interpolation interpolation, const char* pattern) {
  Patches p = beside_pixels(on_rays, interpolation, pattern);
  std::fill_n(p.views.begin(), 12, 0.0);
  for (std::size_t i = 0; i < p.leaving.size(); ++i) p.leaving[i] = 3 + std::sin(double(i));
  return p;
}

constexpr Interpolation kInterpolations[] = {Interpolation::bicubic, Interpolation::bilinear,
                                             Interpolation::bilinear_exact};
constexpr LossKind kLosses[] = {LossKind::none,   LossKind::huber, LossKind::soft_l1,
                                LossKind::cauchy, LossKind::tukey, LossKind::geman_mcclure};

TEST(ReferencePatches, TheScalarTableIsTheReference) {
  EXPECT_EQ(&photometric_kernels("scalar"), &reference_photometric_kernels());
  for (const Instructions& by : compiled())
    EXPECT_NE(by.kernels->collapse, reference_photometric_kernels().collapse);
}

TEST(ReferencePatches, WorldPointsAreEquivalentToReference) {
  for (Interpolation interpolation : kInterpolations) {
    const Patches all = beside_pixels(false, interpolation),
                  some = some_left(false, interpolation, "4x4");
    for (bool brightness : {true, false})
      for (bool per_patch : {true, false})
        for (LossKind loss : kLosses) {
          Settings settings;
          settings.brightness = brightness;
          settings.loss_per_patch = per_patch;
          settings.loss = {loss, 20};
          expect_equivalence(all, settings);
          expect_equivalence(some, settings);
        }
  }
}

/// Warped and as a whole, patterns with holes in them too.
TEST(ReferencePatches, PointsOnRaysAreEquivalentToReference) {
  for (Interpolation interpolation : kInterpolations)
    for (const char* pattern : {"4x4", "8", "5x5", "9x9"}) {
      SCOPED_TRACE(pattern);
      const Patches some = some_left(true, interpolation, pattern);
      for (bool brightness : {true, false})
        for (bool warped : {true, false})
          for (bool per_patch : {true, false}) {
            Settings settings;
            settings.brightness = brightness;
            settings.warped = warped;
            settings.loss_per_patch = per_patch;
            settings.loss = {LossKind::huber, 5};
            expect_equivalence(some, settings);
            settings.loss = {};
            expect_equivalence(some, settings);
          }
    }
}

TEST(ReferencePatches, LeavingForNothingIsEquivalentToReference) {
  for (bool on_rays : {true, false}) {
    const Patches some = some_left(on_rays, Interpolation::bicubic, "4x4");
    Settings settings;
    settings.free_to_leave = true;
    settings.warped = on_rays;
    expect_equivalence(some, settings);
  }
}

/// Images without texture, or with slopes along one axis alone, leave rows of zeros.
TEST(ReferencePatches, ImagesWithoutTextureAreEquivalentToReference) {
  for (double slope : {0.0, 0.5})
    for (bool on_rays : {true, false}) {
      Patches p(on_rays);
      for (GreyPlane& plane : p.scene.planes) {
        std::vector<float> pixels;
        for (int y = 0; y < plane.height(); ++y)
          for (int x = 0; x < plane.width(); ++x)
            pixels.push_back(static_cast<float>(100 + slope * x));
        plane = GreyPlane(plane.width(), plane.height(), pixels.data());
      }
      Settings settings;
      settings.warped = on_rays;
      settings.loss = {LossKind::cauchy, 5};
      expect_equivalence(p, settings, 1e-3);
    }
}

}  // namespace
}  // namespace sheaf
