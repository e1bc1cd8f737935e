// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What a pass works at: some lanes of a group of eight points, and their sums.
#if defined(SHEAF_ELIMINATE_GROUP_PART_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_GROUP_PART_INL_H_
#undef SHEAF_ELIMINATE_GROUP_PART_INL_H_
#else
#define SHEAF_ELIMINATE_GROUP_PART_INL_H_
#endif

#include <hwy/cache_control.h>

#include "lists/batches.h"
#include "lists/block_layout.h"
#include "rows/rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// A part of a group: kLanes of its points.
struct GroupPart {
  std::size_t group;
  std::uint64_t first_batch;
  std::uint32_t track, lanes;  ///< of the group
  int part;

  HWY_INLINE GroupPart(const Batches::Group& of, std::size_t g, int p)
      : group(g), first_batch(of.first_batch), track(of.track), lanes(of.lanes), part(p) {}
  HWY_INLINE int lane() const { return part * kLanes; }
  HWY_INLINE V mask() const { return lane_mask(lanes, lane()); }
  HWY_INLINE bool full() const { return lanes == 8; }

  HWY_INLINE void load_points(const double* points, V* X) const {
    const double* from = points + kPointGroup * group + lane();
    for (int i = 0; i < 3; ++i) X[i] = load(from + 8 * i);
  }
  HWY_INLINE void store_points(const V* X, double* points) const {
    double* to = points + kPointGroup * group + lane();
    for (int i = 0; i < 3; ++i) store(X[i], to + 8 * i);
  }
  /// Of this part, in what a group has one after another.
  HWY_INLINE const double* factor(const double* factors) const {
    return factors + kFactorGroup * group + lane();
  }
};

/// 1 / sigma of a batch's lanes, for batches that have sigmas.
HWY_INLINE V inverse_sigma_of(const Batches& batches, const GroupPart& of, std::uint64_t b) {
  return load(&batches.inverse_sigma[8 * b + of.lane()]);
}

/// The points' own rows (lists/batches.h), for batches that have some: U and what it makes of Y -
/// mean.
struct PriorRows {
  V u[6], r[3];

  HWY_INLINE PriorRows(const Batches& batches, const GroupPart& of, const V* Y) {
    const double* at = &batches.prior[kPointPrior * of.group + of.lane()];
    V e[3];
    for (int i = 0; i < 6; ++i) u[i] = load(at + point_prior::root(i));
    for (int i = 0; i < 3; ++i) e[i] = hn::Sub(Y[i], load(at + point_prior::mean(i)));
    times(e, r);
  }
  /// U e.
  HWY_INLINE void times(const V* e, V* out) const {
    out[0] = fma(u[0], e[0], fma(u[1], e[1], hn::Mul(u[2], e[2])));
    out[1] = fma(u[3], e[1], hn::Mul(u[4], e[2]));
    out[2] = hn::Mul(u[5], e[2]);
  }
  HWY_INLINE V square() const { return fma(r[0], r[0], fma(r[1], r[1], hn::Mul(r[2], r[2]))); }
};

/// |U v|^2 of the points' own rows.
HWY_INLINE V prior_curvature(const Batches& batches, const GroupPart& of, const V* v) {
  const PriorRows rows(batches, of, v);
  V e[3];
  rows.times(v, e);
  return fma(e[0], e[0], fma(e[1], e[1], hn::Mul(e[2], e[2])));
}

/// The points and the first `rows` rows of the factors of groups [first, end): asked for early,
/// because they come from far away and nothing of a group can begin without them.
HWY_INLINE void prefetch_groups(const double* points, const double* factors, int rows,
                                std::size_t first, std::size_t end) {
  for (std::size_t g = first; g < end; ++g) {
    for (int i = 0; i < 3; ++i) hwy::Prefetch(points + kPointGroup * g + 8 * i);
    for (int i = 0; i < rows; ++i) hwy::Prefetch(factors + kFactorGroup * g + 8 * i);
  }
}

HWY_INLINE double sum_parts(const V* parts) {
  alignas(64) double lanes[8];
  for (int p = 0; p < kParts; ++p) store(parts[p], lanes + p * kLanes);
  return sum8(lanes);
}

HWY_INLINE double max_parts(const V* parts) {
  alignas(64) double lanes[8];
  for (int p = 0; p < kParts; ++p) store(parts[p], lanes + p * kLanes);
  double most = 0;
  for (double x : lanes) most = x > most ? x : most;
  return most;
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
