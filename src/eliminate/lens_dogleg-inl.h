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
  alignas(64) double saved[kOneRow];
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    V v[kParts][27];
    for (int part = 0; part < kParts; ++part) {
      const int lane = part * kLanes;
      const double* at = in.of.at.points + kPointGroup * g + lane;
      const V X[3] = {load(at), load(at + 8), load(at + 16)};
      const LaneJacobian j = lens_rows(in.of, b, lane, X, saved + row_field::kCount * kLanes);
      save(j, saved);
      V w = lane_mask(group.lanes, lane);
      if (in.metric != nullptr) w = hn::Mul(w, load_metric(in.metric + kMetricBatch * b + lane).w);
      const V down[2] = {hn::Neg(hn::Mul(w, j.r[0])), hn::Neg(hn::Mul(w, j.r[1]))};
      lens_rows_times(saved, in.of.tracks->most_blocks, down, v[part]);
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
    const Batches& batches = *in.of.batches;
    if (batches.prior.size() > 0)
      square = hn::Add(square, prior_curvature(batches, {group, g, part}, step));
  }
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    V unused[3] = {zero(), zero(), zero()}, e[2];
    // With nothing between, e = Jc x comes to stand where residuals do.
    first_lens_sweep(in, b, lane, X, Between(set(1.0)), saved, unused);
    for (int r = 0; r < 2; ++r) {
      e[r] = load_field(saved, row_field::residual(r));
      for (int i = 0; i < 3; ++i)
        e[r] = fma(load_field(saved, row_field::point(r, i)), step[i], e[r]);
    }
    V m[2] = {e[0], e[1]};
    Between(in, b, lane, mask).apply(m);
    for (int r = 0; r < 2; ++r) square = fma(e[r], m[r], square);
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

/// The root of what stands between the two factors of each product of rows.
struct RootBetween {
  Between of;
  MetricRoot root;

  HWY_INLINE RootBetween(const LensProductInput& in, std::uint64_t batch, int lane, V used)
      : of(in, batch, lane, used) {
    if (of.robust) root = MetricRoot(of.metric);
  }
  HWY_INLINE void apply(V& j0, V& j1) const {
    if (of.robust) root.column(of.metric, j0, j1);
    j0 = hn::Mul(of.mask, j0), j1 = hn::Mul(of.mask, j1);
  }
};

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
      const LaneJacobian j = lens_rows(in.of, b, lane, X, saved + row_field::kCount * kLanes);
      float* to = rows + 8 * kept_row::fields(blocks) * b + lane;
      const RootBetween between(in, b, lane, lane_mask(group.lanes, lane));
      const auto keep = [&](V j0, V j1, double by, int first, int second) {
        between.apply(j0, j1);
        hn::StoreU(hn::DemoteTo(narrow, hn::Mul(j0, set(by))), narrow, to + 8 * first);
        hn::StoreU(hn::DemoteTo(narrow, hn::Mul(j1, set(by))), narrow, to + 8 * second);
      };
      for (int i = 0; i < 3; ++i)
        keep(j.point[0][i], j.point[1][i], 1 / unit, kept_row::point(0, i), kept_row::point(1, i));
      for (int i = 0; i < 9; ++i)
        keep(j.camera[0][i], j.camera[1][i], 1, kept_row::camera(0, i), kept_row::camera(1, i));
      for (int k = 0; k < blocks; ++k)
        for (int i = 0; i < 9; ++i)
          keep(load(lens + kLanes * row_field::lens(k, 0, i)),
               load(lens + kLanes * row_field::lens(k, 1, i)), 1, kept_row::lens(k, 0, i),
               kept_row::lens(k, 1, i));
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
        first_lens_sweep(in, b, lane, X, Between(in, b, lane, mask), saved, s);
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
