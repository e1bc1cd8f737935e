// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What a dogleg asks of rows through lenses of any model, as dogleg_kernels.cc does of BAL's. The
// step of the cameras is x, by blocks.
#if defined(SHEAF_ELIMINATE_LENS_DOGLEG_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_LENS_DOGLEG_INL_H_
#undef SHEAF_ELIMINATE_LENS_DOGLEG_INL_H_
#else
#define SHEAF_ELIMINATE_LENS_DOGLEG_INL_H_
#endif

#include "eliminate/dogleg_kernels.h"
#include "eliminate/lens_product-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Adds nine numbers of each lane to its image's record, and to those of its lens's blocks.
HWY_INLINE void scatter_to_blocks(const LensInput& in, std::uint64_t batch, const V (*v)[27],
                                  double* sums) {
  const LensTracks& tracks = *in.tracks;
  alignas(64) double rows[3][64], ninth[3][8];
  for (int part = 0; part < kParts; ++part)
    for (int k = 0; k <= tracks.most_blocks; ++k) {
      store_records(v[part] + 9 * k, rows[k] + 8 * part * kLanes, 8);
      store(v[part][9 * k + 8], ninth[k] + part * kLanes);
    }
  scatter(rows[0], ninth[0], &in.batches->image[8 * batch], in.batches->uniform[batch], sums);
  for (int k = 0; k < tracks.most_blocks; ++k)
    scatter_to_lenses(rows[k + 1], ninth[k + 1], LensBlocks(tracks, batch, k), sums);
}

/// Doubles of the rows of one observation of a part: a lens has two blocks at most.
constexpr std::size_t kOneRow = row_field::count(2) * kLanes;

inline void lens_gradient_group(const LensProductInput& in, std::size_t g, double* sums) {
  const Batches& batches = *in.of.batches;
  const Batches::Group& group = batches.groups[g];
  const V none[3] = {zero(), zero(), zero()};
  alignas(64) double saved[kOneRow];
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    V v[kParts][27];
    for (int part = 0; part < kParts; ++part) {
      const int lane = part * kLanes;
      const double* at = in.of.at.points + kPointGroup * g + lane;
      const V X[3] = {load(at), load(at + 8), load(at + 16)};
      const V scale = row_scale(in, b, lane, lane_mask(group.lanes, lane));
      LaneJacobian j = lens_rows(in.of, b, lane, X, saved + row_field::kCount * kLanes);
      for (V& r : j.r) r = hn::Neg(hn::Mul(hn::Mul(scale, scale), r));
      save(j, saved);
      second_lens_sweep(saved, in.of.tracks->most_blocks, zero(), none, v[part]);
    }
    scatter_to_blocks(in.of, b, v, sums);
  }
}

/// Sums over the observations of a part: |J v|^2, and of its points (J^T r)^T C^-1 (J^T r).
HWY_INLINE void lens_curvature_part(const LensProductInput& in, double damping, bool points_held,
                                    std::size_t g, int part, V& square, V& gradient2) {
  alignas(64) double saved[kOneRow];
  const Batches::Group& group = in.of.batches->groups[g];
  const int lane = part * kLanes;
  const double* at = in.of.at.points + kPointGroup * g + lane;
  const V X[3] = {load(at), load(at + 8), load(at + 16)};
  const V mask = lane_mask(group.lanes, lane);
  V step[3] = {zero(), zero(), zero()};
  if (!points_held) {
    V gradient[3], sum = zero();
    descend_point(in.factors + kFactorGroup * g + lane, set(damping), gradient, step);
    for (int i = 0; i < 3; ++i) sum = fma(gradient[i], step[i], sum);
    gradient2 = fma(mask, sum, gradient2);
  }
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const V scale = row_scale(in, b, lane, mask);
    V unused[3] = {zero(), zero(), zero()};
    // With a scale of 1, e = Jc x comes to stand where residuals do.
    first_lens_sweep(in, b, lane, X, set(1.0), saved, unused);
    for (int r = 0; r < 2; ++r) {
      V e = load_field(saved, row_field::residual(r));
      for (int i = 0; i < 3; ++i) e = fma(load_field(saved, row_field::point(r, i)), step[i], e);
      e = hn::Mul(e, scale);
      square = fma(e, e, square);
    }
  }
}

inline void lens_curvature_chunk(const LensProductInput& in, double damping, bool points_held,
                                 const Chunk& chunk, CurvatureOutput& out) {
  V square[kParts], gradient2[kParts];
  for (int p = 0; p < kParts; ++p) square[p] = gradient2[p] = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (int p = 0; p < kParts; ++p)
      lens_curvature_part(in, damping, points_held, g, p, square[p], gradient2[p]);
  out.square_sum += sum_parts(square);
  out.gradient2 += sum_parts(gradient2);
}

/// Rows to floats, a field of eight lanes after the other.
inline void keep_group(const LensProductInput& in, double unit, std::size_t g, float* rows) {
  const hn::Rebind<float, D> narrow;
  const Batches::Group& group = in.of.batches->groups[g];
  const int blocks = in.of.tracks->most_blocks;
  alignas(64) double saved[kOneRow];
  const double* lens = saved + row_field::kCount * kLanes;
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
    for (int lane = 0; lane < 8; lane += kLanes) {
      const double* at = in.of.at.points + kPointGroup * g + lane;
      const V X[3] = {load(at), load(at + 8), load(at + 16)};
      const V root = row_scale(in, b, lane, lane_mask(group.lanes, lane));
      const V shorter = hn::Mul(root, set(1 / unit));
      const LaneJacobian j = lens_rows(in.of, b, lane, X, saved + row_field::kCount * kLanes);
      float* to = rows + 8 * kept_row::fields(blocks) * b + lane;
      const auto keep = [&](V x, int field) {
        hn::StoreU(hn::DemoteTo(narrow, x), narrow, to + 8 * field);
      };
      for (int r = 0; r < 2; ++r) {
        for (int i = 0; i < 3; ++i) keep(hn::Mul(shorter, j.point[r][i]), kept_row::point(r, i));
        for (int i = 0; i < 9; ++i) keep(hn::Mul(root, j.camera[r][i]), kept_row::camera(r, i));
        for (int k = 0; k < blocks; ++k)
          for (int i = 0; i < 9; ++i)
            keep(hn::Mul(root, load(lens + kLanes * row_field::lens(k, r, i))),
                 kept_row::lens(k, r, i));
      }
    }
}

inline double lens_point_damping_chunk(const LensProductInput& in, const Chunk& chunk) {
  alignas(64) double saved[kOneRow];
  V sums[kParts];
  for (V& s : sums) s = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = in.of.batches->groups[g];
    for (int part = 0; part < kParts; ++part) {
      const int lane = part * kLanes;
      const double* at = in.of.at.points + kPointGroup * g + lane;
      const V X[3] = {load(at), load(at + 8), load(at + 16)};
      const V mask = lane_mask(group.lanes, lane);
      V s[3] = {zero(), zero(), zero()}, d[3];
      for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
        first_lens_sweep(in, b, lane, X, row_scale(in, b, lane, mask), saved, s);
      const V square = back_substitute(in.factors + kFactorGroup * g + lane, s, d);
      sums[part] = fma(mask, square, sums[part]);
    }
  }
  return sum_parts(sums);
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
