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
