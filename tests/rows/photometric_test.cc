// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "rows/photometric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "eliminate/kernel_table.h"
#include "geometry/loss.h"
#include "geometry/rigid_motion.h"
#include "rows/patches.h"
#include "sheaf/photometric.h"

namespace sheaf {
namespace {

using test::Patches;

struct Collapsed {
  std::vector<double> rows, brightness, seen, costs;
  PhotometricOutput totals;
};

Collapsed collapse(const Patches& p, const char* simd, const ScaledLoss& loss, bool per_patch) {
  // Kernels load and store whole vectors: their arrays are aligned as those of the systems are.
  const auto aligned = [](const std::vector<double>& v) {
    Buffer<double> out(v.size());
    std::copy(v.begin(), v.end(), out.begin());
    return out;
  };
  const std::size_t n = p.batches.num_batches();
  Buffer<double> views = aligned(p.views), points = aligned(p.points), rays = aligned(p.rays),
                 leaving = aligned(p.leaving), rows(kRowBatch * n), seen(16 * n), costs(16 * n),
                 brightness(kBrightnessBatch * n);
  const PhotometricInput in{&p.batches,
                            p.scene.planes.data(),
                            p.targets.data(),
                            views.data(),
                            points.data(),
                            p.scene.has_rays() ? rays.data() : nullptr,
                            p.scene.references.data(),
                            &p.scene.grid,
                            leaving.data(),
                            p.scene.camera,
                            p.scene.taps,
                            loss,
                            per_patch,
                            true,
                            p.scene.warped};
  Collapsed out;
  out.totals = {rows.data(), nullptr, brightness.data(), seen.data(), costs.data()};
  photometric_kernels(simd).collapse(in, 0, static_cast<std::uint32_t>(p.batches.groups.size()),
                                     out.totals);
  out.rows.assign(rows.begin(), rows.end());
  out.brightness.assign(brightness.begin(), brightness.end());
  out.seen.assign(seen.begin(), seen.end());
  out.costs.assign(costs.begin(), costs.end());
  return out;
}

int lanes_of(const std::string& simd) {
  return simd == "avx512" ? 8 : simd == "avx2" ? 4 : simd == "sse4" || simd == "neon" ? 2 : 1;
}

double row_field(const Collapsed& of, int lanes, std::uint64_t batch, int lane, int field) {
  return of.rows[kRowBatch * batch + static_cast<std::size_t>(26 * lanes * (lane / lanes) +
                                                              lanes * field + lane % lanes)];
}

/// Twice the cost by plain code.
double plain_cost(const PatchScene& scene, const PatchState& state,
                  const std::vector<Sight>& sights, const ScaledLoss& loss, bool per_patch) {
  std::vector<double> residuals;
  double sum = 0;
  for (const Sight& sight : sights) {
    if (!patch_residuals(scene, state, sight, residuals)) continue;
    double square = 0;
    for (double r : residuals) {
      if (!per_patch) sum += evaluate_loss(loss, r * r).value;
      square += r * r;
    }
    if (per_patch) sum += evaluate_loss(loss, square).value;
  }
  return sum;
}

std::vector<std::string> instruction_sets() {
  std::vector<std::string> names;
  for (const Kernels* kernels : available_kernels()) names.push_back(kernels->name);
  return names;
}

TEST(PhotometricKernels, CostsAreThoseOfPlainCode) {
  const ScaledLoss losses[] = {{LossKind::none, 1}, {LossKind::huber, 3}, {LossKind::cauchy, 5}};
  for (bool on_rays : {false, true})
    for (Interpolation interpolation :
         {Interpolation::bicubic, Interpolation::bilinear, Interpolation::bilinear_exact})
      for (const char* pattern : {"4x4", "8", "9x9"}) {
        if (!on_rays && std::string(pattern) != "4x4") continue;  // what is stored
        const Patches p(on_rays, interpolation, pattern);
        ASSERT_GT(p.sights.size(), 40u);
        for (const ScaledLoss& loss : losses)
          for (bool per_patch : {false, true})
            for (const std::string& simd : instruction_sets()) {
              const double expected = plain_cost(p.scene, p.state, p.sights, loss, per_patch);
              const Collapsed got = collapse(p, simd.c_str(), loss, per_patch);
              EXPECT_NEAR(got.totals.cost, expected, 1e-11 * expected)
                  << simd << " " << pattern << " rays " << on_rays;
              EXPECT_EQ(got.totals.left, 0u);
            }
      }
}

// Lanes then read through copies, whose rows are as far apart in all of them.
TEST(PhotometricKernels, ImagesMayBeOfDifferentSizes) {
  for (Interpolation interpolation : {Interpolation::bicubic, Interpolation::bilinear}) {
    Patches p(false, interpolation);
    std::erase_if(p.sights, [](const Sight& s) { return (s.point + s.image) % 4 == 0; });
    p.points.clear();
    p.arrange_all();
    for (int i = 0; i < 2; ++i) {
      const GreyPlane& plane = p.scene.planes[static_cast<std::size_t>(i)];
      const int width = plane.width() + 20 + 30 * i, height = plane.height() + i;
      std::vector<float> pixels;
      for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
          pixels.push_back(
              *plane.at(std::min(x, plane.width() - 1), std::min(y, plane.height() - 1)));
      p.scene.planes[static_cast<std::size_t>(i)] = GreyPlane(width, height, pixels.data());
    }
    EXPECT_NE(p.scene.planes[0].stride(), p.scene.planes[1].stride());
    EXPECT_GT(std::count(p.batches.uniform.begin(), p.batches.uniform.end(), -1), 0);
    const ScaledLoss loss{LossKind::huber, 3};
    const double expected = plain_cost(p.scene, p.state, p.sights, loss, true);
    for (const std::string& simd : instruction_sets()) {
      const Collapsed got = collapse(p, simd.c_str(), loss, true);
      EXPECT_NEAR(got.totals.cost, expected, 1e-11 * expected) << simd;
      EXPECT_EQ(got.totals.left, 0u);
    }
  }
}

TEST(PhotometricKernels, InstructionSetsAgree) {
  const Patches p(true);
  const ScaledLoss loss{LossKind::huber, 3};
  const std::vector<std::string> sets = instruction_sets();
  const Collapsed reference = collapse(p, sets.back().c_str(), loss, false);
  for (const std::string& simd : sets) {
    const Collapsed got = collapse(p, simd.c_str(), loss, false);
    double most = 0, off = 0;
    for (std::uint64_t b = 0; b < p.batches.num_batches(); ++b)
      for (int l = 0; l < 8; ++l)
        for (int f = 0; f < 26; ++f) {
          const double expected = row_field(reference, lanes_of(sets.back()), b, l, f);
          most = std::max(most, std::abs(expected));
          off = std::max(off, std::abs(row_field(got, lanes_of(simd), b, l, f) - expected));
        }
    EXPECT_GT(most, 0);
    EXPECT_LT(off, 1e-9 * most) << simd;
  }
  if (sets.size() > 2 && sets[0] == "avx512" && sets[1] == "avx2") {
    const Collapsed a = collapse(p, "avx512", loss, false), b = collapse(p, "avx2", loss, false);
    EXPECT_EQ(a.totals.cost, b.totals.cost) << "both fuse multiply and add: the same bits";
    EXPECT_EQ(a.brightness, b.brightness);
  }
}

/// What the rows say of the cost's slope along one change of the state, and what it is.
void expect_slope(Patches& p, const std::function<void(PatchState&, double)>& move,
                  const std::function<double(const Collapsed&, std::uint64_t, int)>& slope_of,
                  const char* what) {
  const ScaledLoss loss{LossKind::huber, 4};
  const Collapsed at = collapse(p, instruction_sets().front().c_str(), loss, false);
  double expected = 0;
  for (std::size_t g = 0; g < p.batches.groups.size(); ++g)
    for (std::uint32_t o = 0; o < p.batches.groups[g].track; ++o)
      for (std::uint32_t l = 0; l < p.batches.groups[g].lanes; ++l)
        expected += slope_of(at, p.batches.groups[g].first_batch + o, static_cast<int>(l));
  constexpr double h = 1e-6;
  PatchState plus = p.state, minus = p.state;
  move(plus, h), move(minus, -h);
  const double slope = (plain_cost(p.scene, plus, p.sights, loss, false) -
                        plain_cost(p.scene, minus, p.sights, loss, false)) /
                       (4 * h);
  EXPECT_NEAR(expected, slope, 1e-4 * std::abs(slope) + 1e-3) << what;
}

TEST(PhotometricKernels, RowsHaveTheCostsGradient) {
  Patches p(false);
  const int lanes = lanes_of(instruction_sets().front());
  const auto in_image = [&](std::uint64_t b, int l, std::uint32_t image) {
    return p.batches.image[8 * b + static_cast<std::size_t>(l)] == image;
  };
  for (int k = 0; k < 6; ++k) {
    const auto move = [&](PatchState& state, double h) {
      Vector3<double> rho{}, phi{};
      (k < 3 ? rho : phi)[k % 3] = h;
      Pose& pose = state.poses[1];
      const auto moved = left_perturbed<double>({pose.rotation, pose.translation}, rho, phi);
      pose = {moved.rotation, moved.translation};
    };
    const auto slope = [&](const Collapsed& at, std::uint64_t b, int l) {
      if (!in_image(b, l, 1)) return 0.0;
      return row_field(at, lanes, b, l, 2 + k) * row_field(at, lanes, b, l, 0) +
             row_field(at, lanes, b, l, 11 + k) * row_field(at, lanes, b, l, 1);
    };
    expect_slope(p, move, slope, "pose");
  }
  for (int k = 0; k < 2; ++k) {
    const auto move = [&](PatchState& state, double h) {
      (k == 0 ? state.brightness[2].a : state.brightness[2].b) += h;
    };
    const auto slope = [&](const Collapsed& at, std::uint64_t b, int l) {
      if (!in_image(b, l, 2)) return 0.0;
      return row_field(at, lanes, b, l, 8 + k) * row_field(at, lanes, b, l, 0) +
             row_field(at, lanes, b, l, 17 + k) * row_field(at, lanes, b, l, 1) +
             at.brightness[kBrightnessBatch * b + static_cast<std::size_t>(8 * (3 + k) + l)];
    };
    expect_slope(p, move, slope, "brightness");
  }
  for (int k = 0; k < 3; ++k) {
    const auto move = [&](PatchState& state, double h) {
      for (std::size_t i = 0; i < state.points.size() / 3; ++i) state.points[3 * i + k] += h;
    };
    const auto slope = [&](const Collapsed& at, std::uint64_t b, int l) {
      return row_field(at, lanes, b, l, 20 + k) * row_field(at, lanes, b, l, 0) +
             row_field(at, lanes, b, l, 23 + k) * row_field(at, lanes, b, l, 1);
    };
    expect_slope(p, move, slope, "points");
  }
}

TEST(PhotometricKernels, PatchesThatLeftCostWhatTheyAreToldTo) {
  Patches p(false);
  for (std::size_t i = 0; i < p.leaving.size(); ++i) p.leaving[i] = 7;
  for (std::size_t b = 0; b < p.targets.size(); ++b) p.views[kViewRecord * b + 11] = -1e3;
  const Collapsed got = collapse(p, instruction_sets().front().c_str(), {LossKind::huber, 1}, true);
  EXPECT_EQ(got.totals.left, p.sights.size());
  EXPECT_DOUBLE_EQ(got.totals.cost, 7.0 * static_cast<double>(p.sights.size()));
  for (double x : got.rows) EXPECT_EQ(x, 0);
}

}  // namespace
}  // namespace sheaf
