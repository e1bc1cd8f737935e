// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Rows of observations through lenses of any model: residual and Jacobians by pose, by the lens's
// parameters and by the point. The lanes of a batch may look through different lenses.
#if defined(SHEAF_LINEAR_LENS_ROWS_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_LINEAR_LENS_ROWS_INL_H_
#undef SHEAF_LINEAR_LENS_ROWS_INL_H_
#else
#define SHEAF_LINEAR_LENS_ROWS_INL_H_
#endif

#include "eliminate/lens_kernels.h"
#include "rows/lens_lanes-inl.h"
#include "rows/rows-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// Which kinds of lenses the lanes of a part look through: of_part() and mask() of each in turn.
class LaneKinds {
 public:
  HWY_INLINE LaneKinds(const LensTracks& tracks, std::uint64_t batch, int lane)
      : tracks_(tracks), lens_(&tracks.lens[8 * batch + lane]) {
    uniform_ = tracks.uniform_kind[batch] >= 0;
    kind_ = tracks.lenses[lens_[0]].kind;
  }
  HWY_INLINE bool uniform() const { return uniform_; }
  HWY_INLINE const LensPlaces& kind() const { return tracks_.kinds[kind_]; }
  /// 1 in the lanes of the present kind.
  HWY_INLINE hn::Mask<D> mask() const {
    alignas(64) double ones[8];
    for (int l = 0; l < kLanes; ++l) ones[l] = tracks_.lenses[lens_[l]].kind == kind_ ? 1 : 0;
    return hn::Gt(load(ones), zero());
  }
  /// On to the next kind; false: that was the last one.
  HWY_INLINE bool next() {
    if (uniform_) return false;
    for (++at_; at_ < kLanes; ++at_) {
      kind_ = tracks_.lenses[lens_[at_]].kind;
      bool seen = false;
      for (int l = 0; l < at_; ++l) seen = seen || tracks_.lenses[lens_[l]].kind == kind_;
      if (!seen) return true;
    }
    return false;
  }

 private:
  const LensTracks& tracks_;
  const std::uint32_t* lens_;
  std::uint32_t kind_ = 0;
  int at_ = 0;
  bool uniform_ = false;
};

/// One observation per lane as it is seen.
struct LensView {
  V c[kImageRecord];    ///< the image's record, as far as it was asked for
  Lane k[kLensRecord];  ///< the lens's
  Lane P[3];
  LensJacobian<Lane> J;  ///< parameters: in the order of each lane's own model; 0 beyond
};

HWY_INLINE void take(hn::Mask<D> mask, const Lane& from, Lane& to) {
  to.v = hn::IfThenElse(mask, from.v, to.v);
}

/// The place of a panorama's pixels that is nearest to what was observed, across its borders.
HWY_INLINE void join_borders(CameraModel model, const Lane* k, const Lane& observed, Lane& x) {
  if (model == CameraModel::equirectangular)
    x = HWY_NAMESPACE::EquirectangularLens::nearest(k, x, observed);
}

template <Wanted kWanted>
HWY_INLINE void project_kinds(LaneKinds kinds, const Lane& observed_x, LensView& out) {
  if (kinds.uniform()) {
    project_on_lanes<kWanted>(kinds.kind().model, out.k, out.P, out.J);
    return join_borders(kinds.kind().model, out.k, observed_x, out.J.pixel[0]);
  }
  for (int r = 0; r < 2; ++r)
    for (Lane& x : out.J.parameters[r]) x = Lane(zero());
  do {
    LensJacobian<Lane> J;
    project_on_lanes<kWanted>(kinds.kind().model, out.k, out.P, J);
    join_borders(kinds.kind().model, out.k, observed_x, J.pixel[0]);
    const hn::Mask<D> mask = kinds.mask();
    const std::size_t count =
        kWanted == Wanted::parameters ? parameter_count(kinds.kind().model) : 0;
    for (int r = 0; r < 2; ++r) {
      take(mask, J.pixel[r], out.J.pixel[r]);
      for (int i = 0; i < 3 && kWanted != Wanted::pixel; ++i)
        take(mask, J.point[r][i], out.J.point[r][i]);
      for (std::size_t i = 0; i < count; ++i)
        take(mask, J.parameters[r][i], out.J.parameters[r][i]);
    }
  } while (kinds.next());
}

/// kSteps: with the records' steps.
template <Wanted kWanted, bool kSteps>
HWY_INLINE void look(const Batches& batches, const LensTracks& tracks, const LensState& at,
                     std::uint64_t batch, int lane, const V* X, LensView& out) {
  load_state<kSteps ? 3 : 2, kImageRecord>(at.images, &batches.image[8 * batch + lane],
                                           batches.uniform[batch], out.c);
  const auto load_eight = [&](int first) {
    V k[8];
    load_state<1, kLensRecord>(at.lenses + first, &tracks.lens[8 * batch + lane],
                               tracks.uniform_lens[batch], k);
    for (int i = 0; i < 8; ++i) out.k[first + i].v = k[i];
  };
  for (int first = 0; first < tracks.most_parameters; first += 8) {
    load_eight(first);
    if (kSteps) load_eight(lens_record::kStep + first);
  }
  for (int i = 0; i < 3; ++i)
    out.P[i].v = fma(out.c[3 * i], X[0],
                     fma(out.c[3 * i + 1], X[1],
                         fma(out.c[3 * i + 2], X[2], out.c[pose_record::kTranslation + i])));
  project_kinds<kWanted>(LaneKinds(tracks, batch, lane), Lane(load(&batches.xy[16 * batch + lane])),
                         out);
}

/// A R, the point's rows.
HWY_INLINE void point_rows(const LensView& s, V out[2][3]) {
  for (int r = 0; r < 2; ++r)
    for (int i = 0; i < 3; ++i)
      out[r][i] = fma(s.J.point[r][0].v, s.c[i],
                      fma(s.J.point[r][1].v, s.c[3 + i], hn::Mul(s.J.point[r][2].v, s.c[6 + i])));
}

/// Puts the parameters' derivatives where their columns are, those of the lens's own blocks at
/// row_field::lens of `lens`; the rest is 0.
HWY_INLINE void place_parameters(LaneKinds kinds, const LensView& s, int blocks, LaneJacobian& j,
                                 double* lens) {
  const bool uniform = kinds.uniform();
  for (int i = 0; i < 18 * blocks; ++i) store(zero(), lens + i * kLanes);
  for (int r = 0; r < 2; ++r)
    for (int i = 6; i < 9; ++i) j.camera[r][i] = zero();
  do {
    const LensPlaces& kind = kinds.kind();
    const hn::Mask<D> mask = uniform ? hn::Gt(set(1.0), zero()) : kinds.mask();
    for (std::size_t p = 0; p < kMaxCameraParameters; ++p) {
      const int place = kind.place[p];
      if (place < 0) continue;
      for (int r = 0; r < 2; ++r) {
        const V x = s.J.parameters[r][p].v;
        if (place < LensPlaces::kRiders) {
          V& to = j.camera[r][6 + place];
          to = uniform ? x : hn::IfThenElse(mask, x, to);
          continue;
        }
        const int block = (place - LensPlaces::kRiders) / 9, i = (place - LensPlaces::kRiders) % 9;
        double* to = lens + kLanes * row_field::lens(block, r, i);
        store(uniform ? x : hn::IfThenElse(mask, x, load(to)), to);
      }
    }
  } while (kinds.next());
}

/// Residual and all Jacobians of one observation per lane; the lens's own columns go to `lens`.
HWY_INLINE LaneJacobian lens_rows(const LensInput& in, std::uint64_t batch, int lane, const V* X,
                                  double* lens) {
  LensView s;
  look<Wanted::parameters, false>(*in.batches, *in.tracks, in.at, batch, lane, X, s);
  const double* z = &in.batches->xy[16 * batch + lane];
  LaneJacobian j;
  for (int r = 0; r < 2; ++r) {
    j.r[r] = hn::Sub(s.J.pixel[r].v, load(z + 8 * r));
    const V a0 = s.J.point[r][0].v, a1 = s.J.point[r][1].v, a2 = s.J.point[r][2].v;
    j.camera[r][0] = a0, j.camera[r][1] = a1, j.camera[r][2] = a2;
    j.camera[r][3] = fms(a2, s.P[1].v, hn::Mul(a1, s.P[2].v));
    j.camera[r][4] = fms(a0, s.P[2].v, hn::Mul(a2, s.P[0].v));
    j.camera[r][5] = fms(a1, s.P[0].v, hn::Mul(a0, s.P[1].v));
  }
  point_rows(s, j.point);
  place_parameters(LaneKinds(*in.tracks, batch, lane), s, in.tracks->most_blocks, j, lens);
  return j;
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
