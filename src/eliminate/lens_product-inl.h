// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// y += (U - W (V + D)^-1 W^T) x over the blocks of images and lenses, nothing formed: the rows of a
// group are computed again and stay in the first-level cache for both sweeps.
#if defined(SHEAF_LINEAR_LENS_PRODUCT_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_LENS_PRODUCT_INL_H_
#undef SHEAF_LINEAR_LENS_PRODUCT_INL_H_
#else
#define SHEAF_LINEAR_LENS_PRODUCT_INL_H_
#endif

#include "eliminate/lens_source-inl.h"
#include "eliminate/schur_product-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// The blocks j of the lanes' lenses; -1: the lens has none.
struct LensBlocks {
  std::int32_t of_lane[8];
  bool uniform = false;

  HWY_INLINE LensBlocks(const LensTracks& tracks, std::uint64_t batch, int j) {
    uniform = tracks.uniform_lens[batch] >= 0;
    for (int l = 0; l < (uniform ? 1 : 8); ++l) {
      const LensPlaces& lens = tracks.lenses[tracks.lens[8 * batch + static_cast<std::size_t>(l)]];
      of_lane[l] = j < lens.blocks ? static_cast<std::int32_t>(lens.first_block) + j : -1;
    }
  }
};

/// Nine of a block's numbers, kProductRecord apart, for the lanes of a part; 0 where there is none.
HWY_INLINE void load_block(const double* x, const LensBlocks& blocks, int lane, V* out) {
  if (blocks.uniform) {
    const std::int32_t block = blocks.of_lane[0];
    for (int i = 0; i < 9; ++i)
      out[i] = block < 0 ? zero() : set(x[kProductRecord * static_cast<std::size_t>(block) + i]);
    return;
  }
  for (int i = 0; i < 9; ++i) {
    alignas(64) double lanes[8];
    for (int l = 0; l < kLanes; ++l) {
      const std::int32_t block = blocks.of_lane[lane + l];
      lanes[l] = block < 0 ? 0 : x[kProductRecord * static_cast<std::size_t>(block) + i];
    }
    out[i] = load(lanes);
  }
}

HWY_INLINE void load_image(const double* x, const std::uint32_t* image, std::int32_t uniform,
                           V* out) {
  if (uniform >= 0) {
    const double* of = x + kProductRecord * static_cast<std::size_t>(uniform);
    for (int i = 0; i < 9; ++i) out[i] = set(of[i]);
    return;
  }
  load_records(x, kProductRecord, image, out);
  alignas(64) double last[8];
  for (int l = 0; l < kLanes; ++l) last[l] = x[kProductRecord * image[l] + 8];
  out[8] = load(last);
}

/// What stands between the two factors of each product of rows: the loss's metric, 0 in masked
/// lanes.
struct Between {
  V mask;
  bool robust;
  Metric metric;

  HWY_INLINE explicit Between(V used) : mask(used), robust(false) {}
  HWY_INLINE Between(const LensProductInput& in, std::uint64_t batch, int lane, V used)
      : mask(used), robust(in.metric != nullptr) {
    if (robust) metric = load_metric(in.metric + kMetricBatch * batch + lane);
  }
  HWY_INLINE void apply(V* e) const {
    if (robust) metric.apply(e[0], e[1]);
    e[0] = hn::Mul(mask, e[0]), e[1] = hn::Mul(mask, e[1]);
  }
};

/// e = Jc x of a part's observation, whose rows go to `row`, with e where residuals stand; and
/// s += Jp^T e.
HWY_INLINE void first_lens_sweep(const LensProductInput& in, std::uint64_t batch, int lane,
                                 const V* X, const Between& between, double* row, V* s) {
  const LensTracks& tracks = *in.of.tracks;
  double* lens = row + row_field::kCount * kLanes;
  LaneJacobian j = lens_rows(in.of, batch, lane, X, lens);
  V x[9], e[2];
  load_image(in.x, &in.of.batches->image[8 * batch + lane], in.of.batches->uniform[batch], x);
  for (int r = 0; r < 2; ++r) {
    e[r] = hn::Mul(j.camera[r][0], x[0]);
    for (int i = 1; i < 9; ++i) e[r] = fma(j.camera[r][i], x[i], e[r]);
  }
  for (int b = 0; b < tracks.most_blocks; ++b) {
    load_block(in.x, LensBlocks(tracks, batch, b), lane, x);
    for (int r = 0; r < 2; ++r)
      for (int i = 0; i < 9; ++i)
        e[r] = fma(load(lens + kLanes * row_field::lens(b, r, i)), x[i], e[r]);
  }
  between.apply(e);
  for (int r = 0; r < 2; ++r) j.r[r] = e[r];
  for (int i = 0; i < 3; ++i) s[i] = fma(j.point[0][i], j.r[0], fma(j.point[1][i], j.r[1], s[i]));
  save(j, row);
}

/// v = Jc^T e of a part's observation: the image's nine, then nine for each block.
HWY_INLINE void lens_rows_times(const double* row, int blocks, const V* e, V* v) {
  for (int i = 0; i < 9; ++i)
    v[i] = fma(load_field(row, row_field::camera(0, i)), e[0],
               hn::Mul(load_field(row, row_field::camera(1, i)), e[1]));
  const double* lens = row + row_field::kCount * kLanes;
  for (int b = 0; b < blocks; ++b)
    for (int i = 0; i < 9; ++i)
      v[9 + 9 * b + i] = fma(load(lens + kLanes * row_field::lens(b, 0, i)), e[0],
                             hn::Mul(load(lens + kLanes * row_field::lens(b, 1, i)), e[1]));
}

/// v = Jc^T (e - M Jp u).
HWY_INLINE void second_lens_sweep(const double* row, int blocks, const Between& between, const V* u,
                                  V* v) {
  V along[2] = {zero(), zero()}, e[2];
  for (int r = 0; r < 2; ++r)
    for (int i = 0; i < 3; ++i)
      along[r] = fma(load_field(row, row_field::point(r, i)), u[i], along[r]);
  between.apply(along);
  for (int r = 0; r < 2; ++r) e[r] = hn::Sub(load_field(row, row_field::residual(r)), along[r]);
  lens_rows_times(row, blocks, e, v);
}

HWY_INLINE void scatter_to_lenses(const double* rows, const double* ninth, const LensBlocks& blocks,
                                  double* sums) {
  if (blocks.uniform) {
    if (blocks.of_lane[0] >= 0) scatter(rows, ninth, nullptr, blocks.of_lane[0], sums);
    return;
  }
  for (int l = 0; l < 8; ++l) {
    if (blocks.of_lane[l] < 0) continue;
    double* to = sums + kProductRecord * static_cast<std::size_t>(blocks.of_lane[l]);
    for (int i = 0; i < 8; ++i) to[i] += rows[8 * l + i];
    to[8] += ninth[l];
  }
}

/// Whether all lanes of a batch look through one kind of lens. Then rows need no common form: the
/// free parameters stand one after another, and what a shared lens gets is summed lane by lane over
/// a group.
HWY_INLINE bool is_plain(const LensTracks& tracks, std::uint64_t batch) {
  return tracks.uniform_kind[batch] >= 0;
}

/// Where a parameter stands in the blocks of its lens, from the first one's record on.
HWY_INLINE std::size_t block_column(int place) {
  const auto own = static_cast<std::size_t>(place - LensPlaces::kRiders);
  return kProductRecord * (own / 9) + own % 9;
}

/// That of each lane's lens.
HWY_INLINE V load_parameter(const double* x, const LensTracks& tracks, std::uint64_t batch,
                            int lane, int place) {
  const std::uint32_t* lens = &tracks.lens[8 * batch + static_cast<std::size_t>(lane)];
  const auto of = [&](std::uint32_t l) {
    return x[kProductRecord * std::size_t(tracks.lenses[l].first_block) + block_column(place)];
  };
  if (tracks.uniform_lens[batch] >= 0) return set(of(lens[0]));
  alignas(64) double lanes[8];
  for (int l = 0; l < kLanes; ++l) lanes[l] = of(lens[l]);
  return load(lanes);
}

/// A (2x3, du/dP), P, R and e of an observation, kept as this many vectors; then two for each free
/// parameter.
constexpr int kPlainFields = 20;

/// As first_lens_sweep.
HWY_INLINE void first_plain_sweep(const LensProductInput& in, std::uint64_t batch, int lane,
                                  const V* X, const Between& between, double* saved, V* s) {
  const LensTracks& tracks = *in.of.tracks;
  const Batches& batches = *in.of.batches;
  LensView view;
  look<Wanted::parameters, false>(batches, tracks, in.of.at, batch, lane, X, view);
  V x[9];
  load_image(in.x, &batches.image[8 * batch + lane], batches.uniform[batch], x);
  const V P0 = view.P[0].v, P1 = view.P[1].v, P2 = view.P[2].v;
  const V d0 = fma(x[4], P2, fnma(x[5], P1, x[0]));
  const V d1 = fma(x[5], P0, fnma(x[3], P2, x[1]));
  const V d2 = fma(x[3], P1, fnma(x[4], P0, x[2]));
  V A[2][3], e[2];
  for (int r = 0; r < 2; ++r) {
    for (int i = 0; i < 3; ++i) A[r][i] = view.J.point[r][i].v;
    e[r] = fma(A[r][0], d0, fma(A[r][1], d1, hn::Mul(A[r][2], d2)));
  }
  const LensPlaces& lens = tracks.lenses[tracks.lens[8 * batch]];
  double* to = saved + kPlainFields * kLanes;
  for (std::size_t p = 0; p < kMaxCameraParameters; ++p) {
    const int place = lens.place[p];
    if (place < 0) continue;
    const V along = place < LensPlaces::kRiders ? x[6 + place]
                                                : load_parameter(in.x, tracks, batch, lane, place);
    for (int r = 0; r < 2; ++r, to += kLanes) {
      e[r] = fma(view.J.parameters[r][p].v, along, e[r]);
      store(view.J.parameters[r][p].v, to);
    }
  }
  between.apply(e);
  V g[3];
  for (int i = 0; i < 3; ++i) g[i] = fma(A[0][i], e[0], hn::Mul(A[1][i], e[1]));
  for (int i = 0; i < 3; ++i)
    s[i] = fma(view.c[i], g[0], fma(view.c[3 + i], g[1], fma(view.c[6 + i], g[2], s[i])));
  for (int r = 0; r < 2; ++r) {
    for (int i = 0; i < 3; ++i) store(A[r][i], saved + (3 * r + i) * kLanes);
    store(e[r], saved + (18 + r) * kLanes);
  }
  store(P0, saved + 6 * kLanes), store(P1, saved + 7 * kLanes), store(P2, saved + 8 * kLanes);
  for (int i = 0; i < 9; ++i) store(view.c[i], saved + (9 + i) * kLanes);
}

/// As second_lens_sweep; what the lens's own blocks get is added to `sums`, eight lanes for each
/// free parameter in turn.
HWY_INLINE void second_plain_sweep(const double* saved, const LensPlaces& lens, int lane,
                                   const Between& between, const V* u, V* v, double* sums) {
  const auto field = [&](int i) { return load_field(saved, i); };
  V m[3], e[2];
  for (int i = 0; i < 3; ++i)
    m[i] =
        fma(field(9 + 3 * i), u[0], fma(field(10 + 3 * i), u[1], hn::Mul(field(11 + 3 * i), u[2])));
  for (int r = 0; r < 2; ++r) {
    e[r] = fma(field(3 * r), m[0], fma(field(3 * r + 1), m[1], hn::Mul(field(3 * r + 2), m[2])));
  }
  between.apply(e);
  for (int r = 0; r < 2; ++r) e[r] = hn::Sub(field(18 + r), e[r]);
  for (int i = 0; i < 3; ++i) v[i] = fma(field(i), e[0], hn::Mul(field(3 + i), e[1]));
  const V P0 = field(6), P1 = field(7), P2 = field(8);
  v[3] = fms(P1, v[2], hn::Mul(P2, v[1]));
  v[4] = fms(P2, v[0], hn::Mul(P0, v[2]));
  v[5] = fms(P0, v[1], hn::Mul(P1, v[0]));
  for (int i = 6; i < 9; ++i) v[i] = zero();
  const double* J = saved + kPlainFields * kLanes;
  for (std::size_t p = 0; p < kMaxCameraParameters; ++p) {
    const int place = lens.place[p];
    if (place < 0) continue;
    const V along = fma(load(J), e[0], hn::Mul(load(J + kLanes), e[1]));
    J += 2 * kLanes;
    if (place < LensPlaces::kRiders)
      v[6 + place] = along;
    else
      add_to(along, sums + 8 * p + lane);
  }
}

/// What lenses' own blocks get from a group, eight lanes for each parameter. The sums of a lens
/// that all lanes share run on from batch to batch.
class LensSums {
 public:
  HWY_INLINE LensSums(const LensTracks& tracks, double* y) : tracks_(tracks), y_(y) {}
  HWY_INLINE double* of(std::uint64_t batch) {
    const std::int32_t shared = tracks_.uniform_lens[batch];
    if (shared < 0 || shared != shared_) {
      flush();
      std::fill_n(lanes_, 8 * kMaxCameraParameters, 0.0);
      lens_ = &tracks_.lens[8 * batch];
      shared_ = shared;
    }
    return lanes_;
  }
  HWY_INLINE void flush() const {
    if (lens_ == nullptr) return;
    const LensPlaces& kind = tracks_.lenses[lens_[0]];
    const auto add = [&](std::uint32_t lens, std::size_t p, double value) {
      const auto at = kProductRecord * std::size_t(tracks_.lenses[lens].first_block);
      y_[at + block_column(kind.place[p])] += value;
    };
    for (std::size_t p = 0; p < kMaxCameraParameters; ++p) {
      if (kind.place[p] < LensPlaces::kRiders) continue;
      if (shared_ >= 0)
        add(lens_[0], p, sum8(lanes_ + 8 * p));
      else
        for (std::size_t l = 0; l < 8; ++l) add(lens_[l], p, lanes_[8 * p + l]);
    }
  }

 private:
  const LensTracks& tracks_;
  double* y_;
  const std::uint32_t* lens_ = nullptr;  ///< of the lanes
  std::int32_t shared_ = -1;
  alignas(64) double lanes_[8 * kMaxCameraParameters];
};

inline void lens_product_group(const LensProductInput& in, std::size_t g, double* saved,
                               double* sums) {
  const Batches& batches = *in.of.batches;
  const LensTracks& tracks = *in.of.tracks;
  const Batches::Group& group = batches.groups[g];
  const int blocks = tracks.most_blocks;
  const std::size_t part_doubles = row_fields(tracks) * kLanes;
  V u[kParts][3];
  for (int part = 0; part < kParts; ++part) {
    const int lane = part * kLanes;
    const double* at = in.of.at.points + kPointGroup * g + lane;
    const V X[3] = {load(at), load(at + 8), load(at + 16)};
    const V mask = lane_mask(group.lanes, lane);
    V s[3] = {zero(), zero(), zero()};
    for (std::uint32_t o = 0; o < group.track; ++o) {
      const std::uint64_t b = group.first_batch + o;
      const Between between(in, b, lane, mask);
      double* to = saved + part_doubles * (kParts * o + part);
      if (is_plain(tracks, b))
        first_plain_sweep(in, b, lane, X, between, to, s);
      else
        first_lens_sweep(in, b, lane, X, between, to, s);
    }
    solve_point(in.factors + kFactorGroup * g + lane, s, u[part]);
  }
  LensSums of_lenses(tracks, sums);
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::uint64_t b = group.first_batch + o;
    alignas(64) double rows[3][64], ninth[3][8];
    const bool plain = is_plain(tracks, b);
    const LensPlaces& lens = tracks.lenses[tracks.lens[8 * b]];
    double* lens_sums = plain && lens.blocks > 0 ? of_lenses.of(b) : nullptr;
    const int own_blocks = plain ? 0 : blocks;
    for (int part = 0; part < kParts; ++part) {
      const int lane = part * kLanes;
      V v[27];
      const double* from = saved + part_doubles * (kParts * o + part);
      const Between between(in, b, lane, lane_mask(group.lanes, lane));
      if (plain)
        second_plain_sweep(from, lens, lane, between, u[part], v, lens_sums);
      else
        second_lens_sweep(from, blocks, between, u[part], v);
      for (int k = 0; k <= own_blocks; ++k) {
        store_records(v + 9 * k, rows[k] + 8 * lane, 8);
        store(v[9 * k + 8], ninth[k] + lane);
      }
    }
    scatter(rows[0], ninth[0], &batches.image[8 * b], batches.uniform[b], sums);
    for (int k = 0; k < own_blocks; ++k)
      scatter_to_lenses(rows[k + 1], ninth[k + 1], LensBlocks(tracks, b, k), sums);
  }
  of_lenses.flush();
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
