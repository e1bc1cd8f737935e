// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/kept_product.h"

#include <string_view>

#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eliminate/kept_product.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "platform/simd-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

using DF = hn::CappedTag<float, 8>;
using F = hn::Vec<DF>;
constexpr int kFloatLanes = static_cast<int>(hn::MaxLanes(DF()));
constexpr int kFloatParts = 8 / kFloatLanes;

/// The block of each lane, of the image (0) or of its lens (1, 2); -1: there is none.
struct LaneBlocks {
  std::int32_t of_lane[8];
  bool uniform;

  HWY_INLINE LaneBlocks(const KeptProductInput& in, std::uint64_t batch, int k) {
    const LensTracks& tracks = *in.tracks;
    uniform = k == 0 ? in.batches->uniform[batch] >= 0 : tracks.uniform_lens[batch] >= 0;
    for (std::size_t l = 0; l < (uniform ? 1 : 8); ++l) {
      const std::size_t at = 8 * batch + l;
      if (k == 0) {
        of_lane[l] = static_cast<std::int32_t>(in.batches->image[at]);
        continue;
      }
      const LensPlaces& lens = tracks.lenses[tracks.lens[at]];
      of_lane[l] = k <= lens.blocks ? static_cast<std::int32_t>(lens.first_block) + k - 1 : -1;
    }
  }
};

/// x of column i in the lanes from `lane` on.
HWY_INLINE F load_column(const float* x, const LaneBlocks& blocks, int lane, int i) {
  const auto of = [&](std::int32_t block) {
    return block < 0 ? 0.0f : x[kBlockVector * static_cast<std::size_t>(block) + i];
  };
  if (blocks.uniform) return hn::Set(DF(), of(blocks.of_lane[0]));
  alignas(64) float lanes[8];
  for (int l = 0; l < kFloatLanes; ++l) lanes[l] = of(blocks.of_lane[lane + l]);
  return hn::Load(DF(), lanes);
}

HWY_INLINE F field_of(const float* row, int field, int lane) {
  return hn::Load(DF(), row + 8 * field + lane);
}

/// (V + D)^-1 s with the factor L^-1 of a group's points in floats.
struct FloatFactor {
  alignas(64) float of[6][8];

  HWY_INLINE FloatFactor(const double* factor, double unit) {
    // The inverted diagonal scales with unit, what stands below it with its inverse.
    const double scale[6] = {unit, 1 / unit, 1 / unit, unit, 1 / unit, unit};
    for (int k = 0; k < 6; ++k)
      for (int l = 0; l < 8; ++l)
        of[k][l] = static_cast<float>(scale[k] * factor[factor_group::factor(k) + l]);
  }
  HWY_INLINE void solve(int lane, const F* s, F* u) const {
    const auto f = [&](int k) { return hn::Load(DF(), of[k] + lane); };
    const F y0 = hn::Mul(f(0), s[0]);
    const F y1 = hn::Mul(f(3), hn::NegMulAdd(f(1), y0, s[1]));
    const F y2 = hn::Mul(f(5), hn::NegMulAdd(f(4), y1, hn::NegMulAdd(f(2), y0, s[2])));
    u[2] = hn::Mul(f(5), y2);
    u[1] = hn::Mul(f(3), hn::NegMulAdd(f(4), u[2], y1));
    u[0] = hn::Mul(f(0), hn::NegMulAdd(f(2), u[2], hn::NegMulAdd(f(1), u[1], y0)));
  }
};

/// e = Jc x of one observation per lane.
HWY_INLINE void motion(const KeptProductInput& in, std::uint64_t batch, const float* row, int lane,
                       F* e) {
  e[0] = e[1] = hn::Zero(DF());
  for (int k = 0; k <= in.tracks->most_blocks; ++k) {
    const LaneBlocks blocks(in, batch, k);
    for (int i = 0; i < kCameraColumns; ++i) {
      const F x = load_column(in.x, blocks, lane, i);
      for (int r = 0; r < 2; ++r) {
        const int field = k == 0 ? kept_row::camera(r, i) : kept_row::lens(k - 1, r, i);
        e[r] = hn::MulAdd(field_of(row, field, lane), x, e[r]);
      }
    }
  }
}

/// Adds a column's eight lanes to their blocks: where one has them all, their sum in a fixed tree.
HWY_INLINE void scatter_column(const float* v, const LaneBlocks& blocks, int i, double* y) {
  const auto at = [&](std::int32_t block) -> double& {
    return y[kProductRecord * static_cast<std::size_t>(block) + i];
  };
  if (blocks.uniform) {
    if (blocks.of_lane[0] >= 0)
      at(blocks.of_lane[0]) +=
          static_cast<double>(((v[0] + v[1]) + (v[2] + v[3])) + ((v[4] + v[5]) + (v[6] + v[7])));
    return;
  }
  for (int l = 0; l < 8; ++l)
    if (blocks.of_lane[l] >= 0) at(blocks.of_lane[l]) += static_cast<double>(v[l]);
}

HWY_INLINE void scatter_rows(const KeptProductInput& in, std::uint64_t batch, const float* row,
                             const float (*e)[8], double* y) {
  for (int k = 0; k <= in.tracks->most_blocks; ++k) {
    const LaneBlocks blocks(in, batch, k);
    for (int i = 0; i < kCameraColumns; ++i) {
      alignas(64) float v[8];
      for (int lane = 0; lane < 8; lane += kFloatLanes) {
        const auto of = [&](int r) {
          return field_of(row, k == 0 ? kept_row::camera(r, i) : kept_row::lens(k - 1, r, i), lane);
        };
        hn::Store(hn::MulAdd(of(0), hn::Load(DF(), e[0] + lane),
                             hn::Mul(of(1), hn::Load(DF(), e[1] + lane))),
                  DF(), v + lane);
      }
      scatter_column(v, blocks, i, y);
    }
  }
}

void kept_product_group(const KeptProductInput& in, std::size_t g, double* y) {
  const Batches::Group& group = in.batches->groups[g];
  const std::size_t stride = 8 * kept_row::fields(in.tracks->most_blocks);
  const FloatFactor factor(in.factors + kFactorGroup * g, in.unit);
  F u[kFloatParts][3];
  for (int part = 0; part < kFloatParts; ++part) {
    const int lane = part * kFloatLanes;
    F s[3] = {hn::Zero(DF()), hn::Zero(DF()), hn::Zero(DF())};
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
      const float* row = in.rows + stride * b;
      F e[2];
      motion(in, b, row, lane, e);
      for (int r = 0; r < 2; ++r)
        for (int i = 0; i < 3; ++i)
          s[i] = hn::MulAdd(field_of(row, kept_row::point(r, i), lane), e[r], s[i]);
    }
    factor.solve(lane, s, u[part]);
  }
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const float* row = in.rows + stride * b;
    alignas(64) float left[2][8];
    for (int part = 0; part < kFloatParts; ++part) {
      const int lane = part * kFloatLanes;
      F e[2];
      motion(in, b, row, lane, e);
      for (int r = 0; r < 2; ++r) {
        for (int i = 0; i < 3; ++i)
          e[r] = hn::NegMulAdd(field_of(row, kept_row::point(r, i), lane), u[part][i], e[r]);
        hn::Store(e[r], DF(), left[r] + lane);
      }
    }
    scatter_rows(in, b, row, left, y);
  }
}

void multiply_kept(const KeptProductInput& in, const Chunk& chunk, double* y) {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) kept_product_group(in, g, y);
}

constexpr KeptProduct kept_table() { return {set_name(HWY_TARGET), &multiply_kept}; }

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

const KeptProduct& kept_product(const char* simd_name) {
  if (std::string_view(simd_name) == reference_kept_product().name) return reference_kept_product();
  static constexpr KeptProduct tables[] = SHEAF_TABLES(kept_table);
  return table_named(tables, simd_name);
}

}  // namespace sheaf
#endif  // HWY_ONCE
