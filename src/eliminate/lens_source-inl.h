// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Rows through lenses of any model, as the point pass (point_pass-inl.h) takes them.
#if defined(SHEAF_ELIMINATE_LENS_SOURCE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef SHEAF_ELIMINATE_LENS_SOURCE_INL_H_
#undef SHEAF_ELIMINATE_LENS_SOURCE_INL_H_
#else
#define SHEAF_ELIMINATE_LENS_SOURCE_INL_H_
#endif

#include "eliminate/lens_records-inl.h"
#include "eliminate/lens_rows-inl.h"
#include "rows/metric_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

/// e = A (rho + phi x P) + (du / dk) dk of one observation per lane.
HWY_INLINE void lens_motion(const LensView& s, int parameters, V* e) {
  const V *rho = s.c + image_record::kStep, *phi = rho + 3;
  const V P0 = s.P[0].v, P1 = s.P[1].v, P2 = s.P[2].v;
  const V d[3] = {hn::Add(rho[0], fms(phi[1], P2, hn::Mul(phi[2], P1))),
                  hn::Add(rho[1], fms(phi[2], P0, hn::Mul(phi[0], P2))),
                  hn::Add(rho[2], fms(phi[0], P1, hn::Mul(phi[1], P0)))};
  const Lane* dk = s.k + lens_record::kStep;
  for (int r = 0; r < 2; ++r) {
    e[r] = fma(s.J.point[r][0].v, d[0],
               fma(s.J.point[r][1].v, d[1], hn::Mul(s.J.point[r][2].v, d[2])));
    for (int i = 0; i < parameters; ++i)
      e[r] = fma(s.J.parameters[r][static_cast<std::size_t>(i)].v, dk[i].v, e[r]);
  }
}

static_assert(kImageRecord == kCameraRecord, "as charts read them");

/// The observations of a part's points X.
struct LensSource {
  using State = LensInput;
  using KeptRecords = LensRecords;
  static constexpr bool kEvaluates = true, kCountsBehind = false;
  static constexpr int kMostBlocks = 2;  ///< beside the image's

  const State& in;
  const GroupPart& of;
  const V* X;

  static HWY_INLINE const double* images(const State& at) { return at.at.images; }
  static HWY_INLINE const double* points(const State& at) { return at.at.points; }
  static HWY_INLINE void prefetch(const State&, const Batches::Group&) {}
  static HWY_INLINE void begin_chunk(const State& at, const LensRecords& records) {
    if (const BlockSums blocks(*at.tracks, records.blocks); blocks) blocks.clear();
  }
  static HWY_INLINE LensGroupRecords of_group(const State& at, const Chunk& chunk, std::size_t g,
                                              const LensRecords& to) {
    const LensTracks& tracks = *at.tracks;
    const std::uint64_t batch = at.batches->groups[g].first_batch - chunk.first_batch;
    const std::size_t slot =
        8 * (chunk.end_batch - chunk.first_batch) + 8 * slots_before(tracks, chunk, g);
    const std::size_t each = kLensPairRecord * static_cast<std::size_t>(tracks.most_blocks);
    return {{records_from(to.image, batch), to.lens + 8 * each * batch, to.slots, to.blocks},
            to.image.T + kTRecord * slot};
  }
  static HWY_INLINE double* room(const LensGroupRecords& to) { return to.of.image.jacobians; }

  HWY_INLINE std::size_t stride() const { return row_fields(*in.tracks) * kLanes; }
  HWY_INLINE LaneJacobian rows(std::uint64_t b, const V* mask, double* room) const {
    LaneJacobian j = lens_rows(in, b, of.lane(), X, room + row_field::kCount * kLanes);
    if (mask == nullptr) return j;
    scale_rows(*mask, j);
    scale_others(*mask, room);
    return j;
  }
  static HWY_INLINE V add_square(const LaneJacobian& j, V sum) {
    return hn::Add(sum, fma(j.r[0], j.r[0], hn::Mul(j.r[1], j.r[1])));
  }
  /// The rows by the lens's own columns.
  HWY_INLINE void scale_others(V by, double* room) const {
    for (std::size_t i = row_field::kCount; i < row_fields(*in.tracks); ++i)
      store(hn::Mul(load(room + kLanes * i), by), room + kLanes * i);
  }
  HWY_INLINE void apply_loss_to_others(const LossRows& rows, double* room) const {
    for (int k = 0; k < in.tracks->most_blocks; ++k)
      for (int i = 0; i < 9; ++i) {
        double* first = room + kLanes * (row_field::kCount + row_field::lens(k, 0, i));
        double* second = room + kLanes * (row_field::kCount + row_field::lens(k, 1, i));
        V j0 = load(first), j1 = load(second);
        rows.column(j0, j1);
        store(j0, first), store(j1, second);
      }
  }
  HWY_INLINE const double* keep(const LaneJacobian& j, std::uint32_t o, double* room) const {
    save(j, room + stride() * o);
    return room;
  }
  HWY_INLINE void write(const Factor& f, const V* w, const double* rows,
                        const LensGroupRecords& to) const {
    write_part_records(*in.tracks, of, f, w, rows, to);
  }

  HWY_INLINE void couple(std::uint64_t b, const double* metric, V* s) const {
    LensView view;
    const LensTracks& tracks = *in.tracks;
    look<Wanted::parameters, true>(*in.batches, tracks, in.at, b, of.lane(), X, view);
    const std::int32_t kind = tracks.uniform_kind[b];
    const auto count = [&](const LensPlaces& of_kind) {
      return static_cast<int>(parameter_count(of_kind.model));
    };
    V e[2], point[2][3];
    lens_motion(view, kind < 0 ? tracks.most_parameters : count(tracks.kinds[std::size_t(kind)]),
                e);
    if (metric != nullptr) load_metric(metric).apply(e[0], e[1]);
    point_rows(view, point);
    for (int i = 0; i < 3; ++i) s[i] = fma(point[0][i], e[0], fma(point[1][i], e[1], s[i]));
  }

  template <bool kLinearize>
  static HWY_INLINE LaneJacobian evaluate(const State& at, const GroupPart& of, std::uint64_t b,
                                          const V* Y) {
    LensView s;
    look<kLinearize ? Wanted::point : Wanted::pixel, false>(*at.batches, *at.tracks, at.at, b,
                                                            of.lane(), Y, s);
    const double* z = &at.batches->xy[16 * b + of.lane()];
    LaneJacobian j;
    for (int r = 0; r < 2; ++r) j.r[r] = hn::Sub(s.J.pixel[r].v, load(z + 8 * r));
    if constexpr (kLinearize) point_rows(s, j.point);
    return j;
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#endif  // include guard
