// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "rows/exact_patches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "rows/patches.h"
#include "rows/row_layout.h"

namespace sheaf {
namespace {

using test::Patches;

/// By the pose between host and target, alpha, beta and the inverse depth; then r.
constexpr std::size_t kColumns = 10, kPoint = 8, kResidual = 9;
using Gram = std::array<double, kColumns * kColumns>;

Gram gram_of(const std::vector<std::array<double, kColumns>>& rows) {
  Gram out{};
  for (const auto& row : rows)
    for (std::size_t i = 0; i < kColumns; ++i)
      for (std::size_t j = 0; j < kColumns; ++j) out[kColumns * i + j] += row[i] * row[j];
  return out;
}

struct Exact {
  std::vector<double> rows, brightness, seen, costs;
  PhotometricOutput totals{};
};

Exact collapse(const Patches& p, const ScaledLoss& loss, bool per_patch, int lanes) {
  const std::size_t n = p.batches.num_batches();
  Exact out;
  out.rows.resize(kRowBatch * kExactPairs * n);
  out.brightness.resize(kBrightnessBatch * n);
  out.seen.resize(16 * n), out.costs.resize(16 * n);
  out.totals = {out.rows.data(), nullptr, out.brightness.data(), out.seen.data(), out.costs.data()};
  const PhotometricInput in{&p.batches,
                            p.scene.planes.data(),
                            p.targets.data(),
                            p.views.data(),
                            p.points.data(),
                            p.rays.data(),
                            p.scene.references.data(),
                            &p.scene.grid,
                            p.leaving.data(),
                            p.scene.camera,
                            p.scene.taps,
                            loss,
                            per_patch,
                            true,
                            true};
  collapse_exactly(in, lanes, 0, static_cast<std::uint32_t>(p.batches.groups.size()), out.totals);
  return out;
}

/// J^T J and J^T r as a lane's rows have them, and its brightness sums.
Gram gram_of_rows(const Exact& of, std::uint64_t b, int lane, int lanes) {
  std::vector<std::array<double, kColumns>> rows;
  for (std::uint64_t k = 0; k < kExactPairs; ++k)
    for (int r = 0; r < 2; ++r) {
      const double* from =
          &of.rows[kRowBatch * (kExactPairs * b + k) + first_row_field(lanes, lane)];
      std::array<double, kColumns> row;
      for (int c = 0; c < 8; ++c)
        row[static_cast<std::size_t>(c)] = from[lanes * row_field::camera(r, c)];
      row[kPoint] = from[lanes * row_field::point(r, 0)];
      row[kResidual] = from[lanes * row_field::residual(r)];
      rows.push_back(row);
    }
  Gram out = gram_of(rows);
  const double* rest = &of.brightness[kBrightnessBatch * b + static_cast<std::size_t>(lane)];
  out[6 * kColumns + 6] += rest[0], out[7 * kColumns + 7] += rest[16];
  out[6 * kColumns + 7] += rest[8], out[7 * kColumns + 6] += rest[8];
  for (std::size_t k = 0; k < 2; ++k) {
    out[(6 + k) * kColumns + kResidual] += rest[24 + 8 * k];
    out[kResidual * kColumns + 6 + k] += rest[24 + 8 * k];
  }
  return out;
}

/// The same of the pixels themselves, by central differences of plain code.
Gram gram_by_differences(const Patches& p, const Sight& sight) {
  constexpr double h = 1e-6;
  std::vector<double> now;
  EXPECT_TRUE(patch_residuals(p.scene, p.state, sight, now));
  std::vector<std::array<double, kColumns>> rows(now.size());
  for (std::size_t k = 0; k < now.size(); ++k) rows[k][kResidual] = now[k];
  for (std::size_t c = 0; c < kResidual; ++c) {
    std::vector<double> side[2];
    for (int sign : {-1, 1}) {
      PatchState moved = p.state;
      Vector3<double> rho{}, phi{};
      if (c < 6) (c < 3 ? rho : phi)[c % 3] = sign * h;
      Pose& pose = moved.poses[sight.image];
      const auto to = left_perturbed<double>({pose.rotation, pose.translation}, rho, phi);
      pose = {to.rotation, to.translation};
      // alpha and beta of the target against its host, whose brightness stays
      const Brightness& host = p.state.brightness[p.scene.host[sight.point]];
      Brightness& look = moved.brightness[sight.image];
      if (c == 6) look.a += sign * h * host.a, look.b += sign * h * host.b;
      if (c == 7) look.b += sign * h;
      if (c == kPoint) moved.points[3 * std::size_t(sight.point)] += sign * h;
      EXPECT_TRUE(patch_residuals(p.scene, moved, sight, side[sign > 0]));
    }
    for (std::size_t k = 0; k < now.size(); ++k) rows[k][c] = (side[1][k] - side[0][k]) / (2 * h);
  }
  return gram_of(rows);
}

/// Calls visit(batch, lane, sight) for every patch.
template <class Visit>
void for_each_patch(const Patches& p, const Visit& visit) {
  for (std::size_t g = 0; g < p.batches.groups.size(); ++g) {
    const Batches::Group& group = p.batches.groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      for (std::uint32_t l = 0; l < group.lanes; ++l)
        visit(b, static_cast<int>(l),
              Sight{p.batches.lane_point[8 * g + l], p.targets[p.batches.image[8 * b + l]]});
  }
}

TEST(ExactPatches, RowsAreThoseOfTheirPixels) {
  for (const char* pattern : {"4x4", "8", "cross", "9x9"}) {
    const Patches p(true, Interpolation::bicubic, pattern);
    const Exact got = collapse(p, {}, false, 4);
    std::size_t seen = 0;
    for_each_patch(p, [&](std::uint64_t b, int lane, const Sight& sight) {
      const Gram is = gram_of_rows(got, b, lane, 4), should = gram_by_differences(p, sight);
      for (std::size_t i = 0; i < kColumns; ++i)
        for (std::size_t j = 0; j < kColumns; ++j) {
          if (i == kResidual && j == kResidual) continue;  // what no column explains is not kept
          const double size = std::sqrt(should[kColumns * i + i] * should[kColumns * j + j]) + 1e-6;
          EXPECT_NEAR(is[kColumns * i + j], should[kColumns * i + j], 1e-5 * size)
              << pattern << " " << i << " " << j;
        }
      ++seen;
    });
    EXPECT_GT(seen, 40u);
  }
}

TEST(ExactPatches, CostsAndPlacesAreTheKernels) {
  const Patches p(true);
  const Exact one = collapse(p, {LossKind::huber, 4}, false, 1);
  std::vector<double> residuals;
  double cost = 0, square = 0;
  for (const Sight& sight : p.sights) {
    ASSERT_TRUE(patch_residuals(p.scene, p.state, sight, residuals));
    for (double r : residuals) cost += evaluate_loss({LossKind::huber, 4}, r * r).value;
    for (double r : residuals) square += r * r;
  }
  EXPECT_NEAR(one.totals.cost, cost, 1e-11 * cost);
  EXPECT_NEAR(one.totals.square_sum, square, 1e-11 * square);
  EXPECT_EQ(one.totals.left, 0u);
  for_each_patch(p, [&](std::uint64_t b, int lane, const Sight& sight) {
    const PatchPlace at = place_patch(p.scene, p.state, sight);
    const std::size_t l = 16 * b + static_cast<std::size_t>(lane);
    EXPECT_NEAR(one.seen[l], at.x, 1e-9);
    EXPECT_NEAR(one.seen[l + 8], at.y, 1e-9);
  });
}

// Under a loss the rows' J^T r is the slope of the cost.
TEST(ExactPatches, RowsHaveTheGradientOfTheLoss) {
  for (bool per_patch : {false, true}) {
    const ScaledLoss loss{LossKind::cauchy, per_patch ? 20.0 : 5.0};
    Patches p(true);
    const Exact at = collapse(p, loss, per_patch, 8);
    std::array<double, 7> slope{};
    for_each_patch(p, [&](std::uint64_t b, int lane, const Sight& sight) {
      if (sight.image != 1) return;
      const Gram gram = gram_of_rows(at, b, lane, 8);
      for (std::size_t c = 0; c < 6; ++c) slope[c] += gram[kColumns * c + kResidual];
    });
    const auto cost = [&](const PatchState& state) {
      double sum = 0;
      std::vector<double> residuals;
      for (const Sight& sight : p.sights) {
        if (sight.image != 1) continue;
        EXPECT_TRUE(patch_residuals(p.scene, state, sight, residuals));
        double square = 0;
        for (double r : residuals) {
          if (!per_patch) sum += evaluate_loss(loss, r * r).value;
          square += r * r;
        }
        if (per_patch) sum += evaluate_loss(loss, square).value;
      }
      return sum;
    };
    for (std::size_t c = 0; c < 6; ++c) {
      constexpr double h = 1e-6;
      double side[2];
      for (int sign : {-1, 1}) {
        PatchState moved = p.state;
        Vector3<double> rho{}, phi{};
        (c < 3 ? rho : phi)[c % 3] = sign * h;
        const auto to =
            left_perturbed<double>({moved.poses[1].rotation, moved.poses[1].translation}, rho, phi);
        moved.poses[1] = {to.rotation, to.translation};
        side[sign > 0] = cost(moved);
      }
      const double expected = (side[1] - side[0]) / (4 * h);
      EXPECT_NEAR(slope[c], expected, 1e-5 * std::abs(expected) + 1e-2) << c;
    }
  }
}

TEST(ExactPatches, PatchesThatLeftHaveNoRows) {
  Patches p(true);
  std::fill(p.leaving.begin(), p.leaving.end(), 7.0);
  for (std::size_t b = 0; b < p.targets.size(); ++b) p.views[kViewRecord * b + 11] = -1e3;
  const Exact got = collapse(p, {LossKind::huber, 1}, true, 2);
  EXPECT_EQ(got.totals.left, p.sights.size());
  EXPECT_DOUBLE_EQ(got.totals.cost, 7.0 * static_cast<double>(p.sights.size()));
  for (double x : got.rows) EXPECT_EQ(x, 0);
}

}  // namespace
}  // namespace sheaf
