// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The diagonal blocks of lenses, summed lane by lane as points are eliminated:
//   S_ll = sum J_l^T J_l - sum T_l T_l^T,   its right-hand side sum J_l^T (r + B w).
// For a few lenses whose blocks are all that is wanted of them: no records are written for them.
#if defined(SHEAF_LINEAR_LENS_BLOCKS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_LENS_BLOCKS_INL_H_
#undef SHEAF_LINEAR_LENS_BLOCKS_INL_H_
#else
#define SHEAF_LINEAR_LENS_BLOCKS_INL_H_
#endif

#include "eliminate/lens_kernels.h"
#include "eliminate/lens_rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// The sums of the blocks that the lanes of a part look at.
class LaneBlocks {
 public:
  /// block(l): of lane l, counted from the lenses' first; lanes without one share the last.
  template <class Block>
  HWY_INLINE LaneBlocks(double* sums, int lane, const Block& block) {
    for (int l = 0; l < kLanes; ++l) {
      of_lane_[l] = sums + kBlockSums * block(l) + static_cast<std::size_t>(lane + l);
      uniform_ = uniform_ && of_lane_[l] == of_lane_[0] + l;
    }
  }
  HWY_INLINE V get(int number) const {
    if (uniform_) return load(of_lane_[0] + 8 * number);
    alignas(64) double lanes[8];
    for (int l = 0; l < kLanes; ++l) lanes[l] = of_lane_[l][8 * number];
    return load(lanes);
  }
  HWY_INLINE void put(int number, V x) const {
    if (uniform_) return store(x, of_lane_[0] + 8 * number);
    alignas(64) double lanes[8];
    store(x, lanes);
    for (int l = 0; l < kLanes; ++l) of_lane_[l][8 * number] = lanes[l];
  }

 private:
  double* of_lane_[8];
  bool uniform_ = true;
};

class BlockSums {
 public:
  HWY_INLINE BlockSums(const LensTracks& tracks, double* sums) : tracks_(tracks), sums_(sums) {}
  HWY_INLINE explicit operator bool() const { return sums_ != nullptr; }

  void clear() const { std::fill_n(sums_, kBlockSums * (lens_blocks(tracks_) + 1), 0.0); }

  /// The rows J of an observation's lens in its block j, and e = r + B w.
  HWY_INLINE void add(std::uint64_t batch, int lane, int j, const double* lens, const V* e) const {
    const LaneBlocks of(sums_, lane, [&](int l) {
      const std::uint32_t seen_by = tracks_.lens[8 * batch + static_cast<std::size_t>(lane + l)];
      const LensPlaces& places = tracks_.lenses[seen_by];
      return j < places.blocks ? number(places.first_block) + static_cast<std::size_t>(j) : none();
    });
    for (int i = 0; i < tracks_.most_width[static_cast<std::size_t>(j)]; ++i) {
      const V x0 = load(lens + kLanes * row_field::lens(j, 0, i));
      const V x1 = load(lens + kLanes * row_field::lens(j, 1, i));
      of.put(block_sums::kRightSide + i,
             fma(x0, e[0], fma(x1, e[1], of.get(block_sums::kRightSide + i))));
      for (int k = 0; k <= i; ++k) {
        const V y0 = load(lens + kLanes * row_field::lens(j, 0, k));
        const V y1 = load(lens + kLanes * row_field::lens(j, 1, k));
        of.put(block_sums::at(i, k), fma(x0, y0, fma(x1, y1, of.get(block_sums::at(i, k)))));
      }
    }
  }
  /// Takes away what a row of slots holds: T, 9 x 3 vectors.
  HWY_INLINE void take(std::uint64_t slot, int lane, const double* T) const {
    const LaneBlocks of(sums_, lane, [&](int l) {
      const std::int32_t block = tracks_.slot_block[8 * slot + static_cast<std::size_t>(lane + l)];
      return block < 0 ? none() : number(static_cast<std::uint32_t>(block));
    });
    const auto row = [&](int i, V* t) {
      for (int q = 0; q < 3; ++q) t[q] = load(T + kLanes * (3 * i + q));
    };
    for (int i = 0; i < std::max(tracks_.most_width[0], tracks_.most_width[1]); ++i) {
      V a[3], b[3];
      row(i, a);
      for (int k = 0; k <= i; ++k) {
        row(k, b);
        V sum = of.get(block_sums::at(i, k));
        for (int q = 0; q < 3; ++q) sum = fnma(a[q], b[q], sum);
        of.put(block_sums::at(i, k), sum);
      }
      V sum = of.get(block_sums::kSquares + i);
      for (const V& x : a) sum = fma(x, x, sum);
      of.put(block_sums::kSquares + i, sum);
    }
  }
  /// Adds the lanes to the blocks.
  void flush(double* diagonal) const {
    for (std::size_t block = 0; block < lens_blocks(tracks_); ++block) {
      const double* from = sums_ + kBlockSums * block;
      double* to = diagonal + kDiagonalDoubles * (tracks_.image_lens.size() + block);
      const auto of = [&](int number) { return sum8(from + 8 * number); };
      for (int i = 0; i < 9; ++i) {
        for (int k = 0; k <= i; ++k) {
          const double x = of(block_sums::at(i, k));
          to[diagonal_layout::at(i, k)] += x;
          if (k < i && i < 8) to[diagonal_layout::at(k, i)] += x;
        }
        to[diagonal_layout::right_side(i)] += of(block_sums::kRightSide + i);
        to[diagonal_layout::squares(i)] += of(block_sums::kSquares + i);
      }
    }
  }

 private:
  HWY_INLINE std::size_t number(std::uint32_t block) const {
    return block - tracks_.image_lens.size();
  }
  HWY_INLINE std::size_t none() const { return lens_blocks(tracks_); }

  const LensTracks& tracks_;
  double* sums_;
};

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
