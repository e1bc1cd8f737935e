// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/dogleg_kernels.h"

#include <string_view>

#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eliminate/dogleg_kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "eliminate/schur_product-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// The weight of the loss, 0 in masked lanes: what makes the gradient of residuals that of costs.
HWY_INLINE V row_weight(const ProductInput& in, std::uint64_t batch, int lane, V mask) {
  if (in.metric == nullptr) return mask;
  return hn::Mul(mask, load_metric(in.metric + kMetricBatch * batch + lane).w);
}

void gradient(const ProductInput& in, const Chunk& chunk, double* sums) {
  const Batches& batches = *in.batches;
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = batches.groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
      alignas(64) double rows[64], ninth[8];
      for (int part = 0; part < kParts; ++part) {
        const int lane = part * kLanes;
        const double* X = in.points + kPointGroup * g + lane;
        const double* z = &batches.xy[16 * b + lane];
        V c[8 * camera_record::kStateOctets], v[9];
        load_cameras<camera_record::kStateOctets>(in.cameras, &batches.image[8 * b + lane],
                                                  batches.uniform[b], c);
        const LaneJacobian j =
            linearize_lanes(c, load(X), load(X + 8), load(X + 16), load(z), load(z + 8), nullptr);
        const V w = hn::Neg(row_weight(in, b, lane, lane_mask(group.lanes, lane)));
        const V r0 = hn::Mul(w, j.r[0]), r1 = hn::Mul(w, j.r[1]);
        for (int k = 0; k < 9; ++k) v[k] = fma(j.camera[0][k], r0, hn::Mul(j.camera[1][k], r1));
        store_records(v, rows + 8 * lane, 8);
        store(v[8], ninth + lane);
      }
      scatter(rows, ninth, &batches.image[8 * b], batches.uniform[b], sums);
    }
  }
}

/// v += A u of one observation per lane, u = R v_p: what the point's step does to a pixel.
HWY_INLINE void add_point_motion(const V* c, const Seen& seen, V fd, V dd, const V* step, V& e0,
                                 V& e1) {
  V m[3];
  for (int i = 0; i < 3; ++i)
    m[i] = fma(c[3 * i], step[0], fma(c[3 * i + 1], step[1], hn::Mul(c[3 * i + 2], step[2])));
  const V dx = hn::Mul(seen.iz, fma(seen.x, m[2], m[0]));
  const V dy = hn::Mul(seen.iz, fma(seen.y, m[2], m[1]));
  const V along = hn::Mul(dd, fma(seen.x, dx, hn::Mul(seen.y, dy)));
  e0 = hn::Add(e0, fma(fd, dx, hn::Mul(along, seen.x)));
  e1 = hn::Add(e1, fma(fd, dy, hn::Mul(along, seen.y)));
}

struct CurvatureSums {
  V square[kParts], gradient2[kParts];
};

HWY_INLINE void curvature_part(const CurvatureInput& in, std::size_t g, int part,
                               CurvatureSums& sums) {
  const ProductInput& state = in.state;
  const Batches& batches = *state.batches;
  const Batches::Group& group = batches.groups[g];
  const int lane = part * kLanes;
  const double* X = state.points + kPointGroup * g + lane;
  const V X0 = load(X), X1 = load(X + 8), X2 = load(X + 16);
  const V mask = lane_mask(group.lanes, lane);
  V step[3] = {zero(), zero(), zero()};
  if (!in.points_held) {
    V gradient[3];
    descend_point(state.factors + kFactorGroup * g + lane, set(in.damping), gradient, step);
    V square = zero();
    for (int i = 0; i < 3; ++i) square = fma(gradient[i], step[i], square);
    sums.gradient2[part] = fma(mask, square, sums.gradient2[part]);
    if (batches.prior.size() > 0)
      sums.square[part] =
          hn::Add(sums.square[part], prior_curvature(batches, {group, g, part}, step));
  }
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    V c[kCameraRecord], e0, e1;
    load_cameras<camera_record::kOctets>(state.cameras, &batches.image[8 * b + lane],
                                         batches.uniform[b], c);
    const Seen seen = see(c, X0, X1, X2);
    const V fd = hn::Mul(c[camera_record::kFocal], distortion(c, seen.n));
    const V dd = distortion_slope(c, seen.n);
    camera_motion(c, seen, fd, dd, e0, e1);
    add_point_motion(c, seen, fd, dd, step, e0, e1);
    V m0 = e0, m1 = e1;
    if (state.metric != nullptr) load_metric(state.metric + kMetricBatch * b + lane).apply(m0, m1);
    const V square = fma(e0, m0, hn::Mul(e1, m1));
    sums.square[part] = fma(mask, square, sums.square[part]);
  }
}

void curvature(const CurvatureInput& in, const Chunk& chunk, CurvatureOutput& out) {
  CurvatureSums sums;
  for (int p = 0; p < kParts; ++p) sums.square[p] = sums.gradient2[p] = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (int p = 0; p < kParts; ++p) curvature_part(in, g, p, sums);
  out.square_sum += sum_parts(sums.square);
  out.gradient2 += sum_parts(sums.gradient2);
}

double point_damping(const ProductInput& in, const Chunk& chunk) {
  const Batches& batches = *in.batches;
  V sums[kParts];
  for (V& s : sums) s = zero();
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = batches.groups[g];
    for (int part = 0; part < kParts; ++part) {
      const int lane = part * kLanes;
      const double* X = in.points + kPointGroup * g + lane;
      const V X0 = load(X), X1 = load(X + 8), X2 = load(X + 16);
      V s[3] = {zero(), zero(), zero()}, d[3];
      for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
        V c[kCameraRecord];
        load_cameras<camera_record::kOctets>(in.cameras, &batches.image[8 * b + lane],
                                             batches.uniform[b], c);
        add_coupled(c, see(c, X0, X1, X2),
                    in.metric == nullptr ? nullptr : in.metric + kMetricBatch * b + lane, s);
      }
      const V mask = lane_mask(group.lanes, lane);
      for (V& x : s) x = hn::Mul(x, mask);
      const V square = back_substitute(in.factors + kFactorGroup * g + lane, s, d);
      sums[part] = fma(mask, square, sums[part]);
    }
  }
  return sum_parts(sums);
}

constexpr DoglegKernels dogleg_table() {
  return {set_name(HWY_TARGET), &gradient, &curvature, &point_damping};
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

const DoglegKernels& dogleg_kernels(const char* simd_name) {
  if (std::string_view(simd_name) == reference_dogleg_kernels().name)
    return reference_dogleg_kernels();
  static constexpr DoglegKernels tables[] = SHEAF_TABLES(dogleg_table);
  return table_named(tables, simd_name);
}

}  // namespace sheaf
#endif  // HWY_ONCE
