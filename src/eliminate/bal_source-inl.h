// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Rows through BAL cameras, as the point pass (point_pass-inl.h) takes them.
#if defined(SHEAF_ELIMINATE_BAL_SOURCE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_BAL_SOURCE_INL_H_
#undef SHEAF_ELIMINATE_BAL_SOURCE_INL_H_
#else
#define SHEAF_ELIMINATE_BAL_SOURCE_INL_H_
#endif

#include "eliminate/group_part-inl.h"
#include "eliminate/kernels.h"
#include "eliminate/records-inl.h"
#include "rows/bal_lanes-inl.h"
#include "rows/metric_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// e = Jc dc of one observation per lane; c: the fields of its camera record.
template <class C, class W>
HWY_INLINE void camera_motion(const C& c, const SeenAs<W>& seen, W fd, W dd, W& e0, W& e1) {
  // dP = phi x P + rho, d p = iz (dP.xy + p dP.z), and iz P = (x, y, -1).
  using namespace camera_record;
  const W m0 = fnma(c[kPhi + 2], seen.y, fms(seen.iz, c[kRho], c[kPhi + 1]));
  const W m1 = fma(c[kPhi + 2], seen.x, fma(seen.iz, c[kRho + 1], c[kPhi]));
  const W m2 = fnma(c[kPhi + 1], seen.x, fma(c[kPhi], seen.y, hn::Mul(seen.iz, c[kRho + 2])));
  const W dx = fma(seen.x, m2, m0);
  const W dy = fma(seen.y, m2, m1);
  const W intrinsic = fma(seen.n, fma(seen.n, c[kRadial + 2], c[kRadial + 1]), c[kRadial]);
  const W along = fma(dd, fma(seen.x, dx, hn::Mul(seen.y, dy)), intrinsic);
  e0 = fma(fd, dx, hn::Mul(along, seen.x));
  e1 = fma(fd, dy, hn::Mul(along, seen.y));
}

/// s += Jp^T e: A^T e with A = iz (fd I + dd p p^T) [I | p], then R^T.
template <class C, class W>
HWY_INLINE void add_to_point(const C& c, const SeenAs<W>& seen, W fd, W dd, W e0, W e1, W* s) {
  const W t = hn::Mul(dd, fma(seen.x, e0, hn::Mul(seen.y, e1)));
  const W h0 = hn::Mul(seen.iz, fma(fd, e0, hn::Mul(t, seen.x)));
  const W h1 = hn::Mul(seen.iz, fma(fd, e1, hn::Mul(t, seen.y)));
  const W h2 = fma(seen.x, h0, hn::Mul(seen.y, h1));
  for (int i = 0; i < 3; ++i) s[i] = fma(c[i], h0, fma(c[3 + i], h1, fma(c[6 + i], h2, s[i])));
}

/// s += Jp^T M Jc dc of one observation per lane; metric: nullptr for M = I.
HWY_INLINE void add_coupled(const V* c, const Seen& seen, const double* metric, V* s) {
  const V fd = hn::Mul(c[camera_record::kFocal], distortion(c, seen.n));
  const V dd = distortion_slope(c, seen.n);
  V e0, e1;
  camera_motion(c, seen, fd, dd, e0, e1);
  if (metric != nullptr) load_metric(metric).apply(e0, e1);
  add_to_point(c, seen, fd, dd, e0, e1, s);
}

/// Cameras and points.
struct BalState {
  const Batches* batches;
  const double *cameras, *points;
};

/// The observations of a part's points X.
struct BalSource {
  using State = BalState;
  using KeptRecords = Records;
  static constexpr bool kEvaluates = true, kCountsBehind = true;
  static constexpr int kMostBlocks = 0;  ///< beside the image's
  static constexpr std::size_t kStride = row_field::kCount * kLanes;

  const State& in;
  const GroupPart& of;
  const V* X;

  /// The fields of the cameras of batch b's lanes, the first 8 Octets.
  template <int Octets>
  static HWY_INLINE void load_fields(const State& at, const GroupPart& of, std::uint64_t b, V* c) {
    const Batches& batches = *at.batches;
    load_cameras<Octets>(at.cameras, &batches.image[8 * b + of.lane()], batches.uniform[b], c);
  }
  static HWY_INLINE const double* measured(const State& at, const GroupPart& of, std::uint64_t b) {
    return &at.batches->xy[16 * b + of.lane()];
  }

  static HWY_INLINE const double* images(const State& at) { return at.cameras; }
  static HWY_INLINE const double* points(const State& at) { return at.points; }
  static HWY_INLINE void prefetch(const State&, const Batches::Group&) {}
  static HWY_INLINE void begin_chunk(const State&, const Records&) {}
  static HWY_INLINE double* room(const Records& to) { return to.jacobians; }

  /// The rows of batch b, 0 where mask is; those that are not in it go to `room`.
  HWY_INLINE LaneJacobian rows(std::uint64_t b, const V* mask, double*) const {
    V c[8 * camera_record::kStateOctets];
    load_fields<camera_record::kStateOctets>(in, of, b, c);
    const double* z = measured(in, of, b);
    return linearize_lanes(c, X[0], X[1], X[2], load(z), load(z + 8), mask);
  }
  static HWY_INLINE V add_square(const LaneJacobian& j, V sum) {
    return fma(j.r[0], j.r[0], fma(j.r[1], j.r[1], sum));
  }
  /// Where rows stand that were kept, stride() apart.
  HWY_INLINE const double* keep(const LaneJacobian& j, std::uint32_t o, double* room) const {
    save(j, room + kStride * o);
    return room;
  }
  HWY_INLINE std::size_t stride() const { return kStride; }

  HWY_INLINE void write(const Factor& f, const V* w, const double* rows, const Records& to) const {
    for (std::uint32_t o = 0; o < of.track; ++o) {
      const std::size_t record = 8 * o + static_cast<std::size_t>(of.lane());
      const LaneJacobian j = restore(rows + kStride * o);
      write_records(j, Eliminated(j, f, w), to.T + kTRecord * record, to.C + kCRecord * record);
    }
  }
  static HWY_INLINE Records of_group(const State& at, const Chunk& chunk, std::size_t g,
                                     const Records& records) {
    return records_from(records, at.batches->groups[g].first_batch - chunk.first_batch);
  }

  HWY_INLINE void couple(std::uint64_t b, const double* metric, V* s) const {
    V c[kCameraRecord];
    load_fields<camera_record::kOctets>(in, of, b, c);
    add_coupled(c, see(c, X[0], X[1], X[2]), metric, s);
  }
  /// The residuals at points Y and, where they are asked for, the points' rows.
  template <bool kLinearize>
  static HWY_INLINE LaneJacobian evaluate(const State& at, const GroupPart& of, std::uint64_t b,
                                          const V* Y) {
    V c[8 * camera_record::kStateOctets];
    load_fields<camera_record::kStateOctets>(at, of, b, c);
    const double* z = measured(at, of, b);
    if constexpr (kLinearize)
      return linearize_lanes(c, Y[0], Y[1], Y[2], load(z), load(z + 8), nullptr);
    const Seen seen = see(c, Y[0], Y[1], Y[2]);
    const V fd = hn::Mul(c[camera_record::kFocal], distortion(c, seen.n));
    LaneJacobian j;
    j.r[0] = fms(fd, seen.x, load(z)), j.r[1] = fms(fd, seen.y, load(z + 8));
    return j;
  }

  /// Depth of a point along its camera's axis; behind it is more than 0.
  static HWY_INLINE V depth(const State& at, const GroupPart& of, std::uint64_t b, const V* Y) {
    V c[8 * camera_record::kStateOctets];
    load_fields<camera_record::kStateOctets>(at, of, b, c);
    return fma(c[6], Y[0], fma(c[7], Y[1], fma(c[8], Y[2], c[camera_record::kTranslation + 2])));
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
