// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The kernels of lenses of any model once more as plain scalar code, one observation at a time:
// what the fast ones are tested against.
#include "eliminate/reference_lens.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace sheaf {
namespace {

/// Columns of a block by those of the point.
using BlockOfPoint = std::array<Vector3<double>, 9>;

/// One point of a group, its observations' rows as the loss has them.
struct PointTrack {
  std::size_t group;
  std::uint32_t lane;
  std::vector<LensRow> rows;
  Matrix3<double> less{};  ///< what the loss's metric takes from V by its weight alone
  double cost = 0;         ///< sum rho, under a loss
};

PointTrack look_at_point(const LensEliminateInput& in, std::size_t g, std::uint32_t lane,
                         EliminateOutput& out) {
  const Batches::Group& group = in.of.batches->groups[g];
  const Vector3<double> X = point_of(in.of.at.points, g, lane);
  PointTrack track{g, lane, {}};
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    LensRow row = lens_row(in.of, X, b, lane);
    const double by = inverse_sigma_at(*in.of.batches, b, lane);
    out.square_sum += by * by * row.square();
    if (in.loss.weighs()) {
      const RowMetric metric = weighed_metric(in.loss, row.r, by);
      add_less(metric, row.point[0].data(), track.less);
      track.cost += apply_loss(in.loss, row, by).value;
      store_metric(metric, out.metric, b, lane);
    }
    track.rows.push_back(row);
  }
  Matrix3<double> unused{};
  Vector3<double> unused_too{};
  track.cost += add_prior(*in.of.batches, g, lane, X, unused, unused_too);
  if (in.loss.weighs()) out.point_costs[8 * g + lane] = track.cost;
  out.loss_sum += track.cost;
  return track;
}

/// T_l = sum J_l^T B of each slot of the point.
std::vector<BlockOfPoint> sum_slots(const LensInput& in, const PointTrack& track,
                                    const std::vector<WhitenedRow>& whitened) {
  std::vector<BlockOfPoint> sums(in.tracks->slots_of(track.group));
  for (std::size_t o = 0; o < track.rows.size(); ++o) {
    const std::uint64_t b = in.batches->groups[track.group].first_batch + o;
    const std::size_t blocks = lens_of(in, b, track.lane).blocks;
    for (std::size_t j = 0; j < blocks; ++j) {
      BlockOfPoint& T = sums[in.tracks->slot[8 * b + track.lane] + j];
      for (std::size_t i = 0; i < 9; ++i)
        for (std::size_t c = 0; c < 3; ++c)
          for (std::size_t e = 0; e < 2; ++e)
            T[i][c] += track.rows[o].lens[j][e][i] * whitened[o].B[e][c];
    }
  }
  return sums;
}

void write_slot_record(const BlockOfPoint& sums, double* T) {
  std::fill_n(T, kTRecord, 0.0);
  for (int k = 0; k < 9; ++k)
    for (int c = 0; c < 3; ++c) T[t_record::at(c, k)] = sums[std::size_t(k)][std::size_t(c)];
}

/// C = Lm^T J and G = Lm^-1 (J - B T_l^T), two rows each of eight columns, then their ninths.
void write_lens_record(const LensRow::Block& J, const WhitenedRow& m, const BlockOfPoint& T,
                       double* to) {
  std::fill_n(to, kLensPairRecord, 0.0);
  for (std::size_t k = 0; k < 9; ++k) {
    std::array<double, 2> rest{J[0][k], J[1][k]};
    for (std::size_t e = 0; e < 2; ++e)
      for (std::size_t c = 0; c < 3; ++c) rest[e] -= m.B[e][c] * T[k][c];
    const std::array<double, 2> C = m.times_transpose(J[0][k], J[1][k]), G = m.times_inverse(rest);
    for (std::size_t e = 0; e < 2; ++e) {
      to[k < 8 ? lens_pair_record::kC + 8 * e + k : lens_pair_record::kC8 + e] = C[e];
      to[k < 8 ? lens_pair_record::kG + 8 * e + k : lens_pair_record::kG8 + e] = G[e];
    }
  }
}

/// The sums of a lens's block: J^T J and J^T (r + B w) of one observation.
void add_to_sums(const LensRow& row, std::size_t j, const WhitenedRow& m, const EliminatedPoint& p,
                 double* sums) {
  const LensRow::Block& J = row.lens[j];
  for (std::size_t e = 0; e < 2; ++e) {
    double rest = row.r[e];
    for (std::size_t c = 0; c < 3; ++c) rest += m.B[e][c] * p.w[c];
    for (int i = 0; i < 9; ++i) {
      const double x = J[e][std::size_t(i)];
      sums[diagonal_layout::right_side(i)] += x * rest;
      for (int k = 0; k < 9; ++k)
        if (diagonal_layout::is_stored(i, k))
          sums[diagonal_layout::at(i, k)] += x * J[e][std::size_t(k)];
    }
  }
}
/// And what a slot takes from them: T_l T_l^T.
void take_from_sums(const BlockOfPoint& T, double* sums) {
  for (std::size_t c = 0; c < 3; ++c)
    for (int i = 0; i < 9; ++i) {
      const double x = T[std::size_t(i)][c];
      sums[diagonal_layout::squares(i)] += x * x;
      for (int k = 0; k < 9; ++k)
        if (diagonal_layout::is_stored(i, k))
          sums[diagonal_layout::at(i, k)] -= x * T[std::size_t(k)][c];
    }
}

/// Sums of the blocks of lenses, without records: each a diagonal block as those of images are.
void add_point_to_blocks(const LensInput& in, const PointTrack& track, const EliminatedPoint& p,
                         const std::vector<WhitenedRow>& whitened,
                         const std::vector<BlockOfPoint>& slots, double* blocks) {
  const LensTracks& tracks = *in.tracks;
  const auto of = [&](std::size_t block) {
    return blocks + kBlockSums * (block - tracks.image_lens.size());
  };
  for (std::size_t o = 0; o < track.rows.size(); ++o) {
    const LensPlaces& lens =
        lens_of(in, in.batches->groups[track.group].first_batch + o, track.lane);
    for (std::size_t j = 0; j < lens.blocks; ++j)
      add_to_sums(track.rows[o], j, whitened[o], p, of(lens.first_block + j));
  }
  for (std::size_t s = 0; s < slots.size(); ++s) {
    const std::int32_t block =
        tracks.slot_block[8 * (tracks.first_slot[track.group] + s) + track.lane];
    if (block >= 0) take_from_sums(slots[s], of(static_cast<std::size_t>(block)));
  }
}

void write_lens_records(const LensInput& in, const Chunk& chunk, const PointTrack& track,
                        const std::vector<WhitenedRow>& whitened,
                        const std::vector<BlockOfPoint>& slots, const LensRecords& records) {
  const LensTracks& tracks = *in.tracks;
  const auto most = static_cast<std::size_t>(tracks.most_blocks);
  for (std::size_t o = 0; o < track.rows.size(); ++o) {
    const std::uint64_t b = in.batches->groups[track.group].first_batch + o;
    const std::uint64_t record = 8 * (b - chunk.first_batch) + track.lane;
    const std::size_t blocks = lens_of(in, b, track.lane).blocks;
    for (std::size_t j = 0; j < blocks; ++j)
      write_lens_record(track.rows[o].lens[j], whitened[o],
                        slots[tracks.slot[8 * b + track.lane] + j],
                        records.lens + kLensPairRecord * (most * record + j));
  }
  const std::uint64_t observations = 8 * (chunk.end_batch - chunk.first_batch);
  const std::uint64_t first = observations + 8 * slots_before(tracks, chunk, track.group);
  for (std::size_t s = 0; s < slots.size(); ++s)
    write_slot_record(slots[s], records.image.T + kTRecord * (first + 8 * s + track.lane));
}

void eliminate_point(const LensEliminateInput& in, const Chunk& chunk, std::size_t g,
                     std::uint32_t lane, const LensRecords& records, EliminateOutput& out) {
  const PointTrack track = look_at_point(in, g, lane, out);
  PointNormal normal;
  for (const LensRow& row : track.rows) normal.add(row);
  add_prior(*in.of.batches, g, lane, point_of(in.of.at.points, g, lane), normal.V, normal.g);
  const Batches& batches = *in.of.batches;
  const Vector3<double> base = base_of(in.chart, batches, batches.groups[g], lane, in.of.at.images);
  const PointCoordinates at(in.chart, base, point_of(in.of.at.points, g, lane));
  const double lambda = damping_of_point(in.damping, in.own_damping, g, lane);
  const EliminatedPoint p(normal, at, lambda, in.points_held);
  out.point_decrease += p.decrease();
  const double gradient2 =
      in.loss.weighs() ? gradient_by_weight(at, normal.V, track.less, normal.g) : p.decrease();
  out.gradient_max2 = std::max(out.gradient_max2, gradient2);
  p.store(out.factors + kFactorGroup * g + lane);
  std::vector<WhitenedRow> whitened;
  const std::uint64_t batch = in.of.batches->groups[g].first_batch - chunk.first_batch;
  for (std::size_t o = 0; o < track.rows.size(); ++o) {
    whitened.emplace_back(track.rows[o], p);
    const std::uint64_t record = 8 * (batch + o) + lane;
    write_point_records(track.rows[o], whitened[o], records.image.T + kTRecord * record,
                        records.image.C + kCRecord * record);
  }
  if (in.of.tracks->most_blocks == 0) return;
  const std::vector<BlockOfPoint> slots = sum_slots(in.of, track, whitened);
  if (records.blocks != nullptr)
    add_point_to_blocks(in.of, track, p, whitened, slots, records.blocks);
  else
    write_lens_records(in.of, chunk, track, whitened, slots, records);
}

void linearize(const LensEliminateInput& in, const Chunk& chunk, const LensRecords& records,
               EliminateOutput& out) {
  if (records.blocks != nullptr)
    std::fill_n(records.blocks, kBlockSums * lens_blocks(*in.of.tracks), 0.0);
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < in.of.batches->groups[g].lanes; ++l)
      eliminate_point(in, chunk, g, l, records, out);
}

/// T_a T_b^T of the six columns of each block's pose.
void pose_pairs(const Chunks& chunks, const Chunk& chunk, const Records& records, double* tiles) {
  for (std::uint64_t r = chunk.first_pair_run; r < chunk.end_pair_run; ++r) {
    const PairRun& run = chunks.pair_runs[r];
    for (std::uint64_t p = run.first; p < run.first + run.count; ++p) {
      const double *a = records.T + kTRecord * chunks.pairs[p].a,
                   *b = records.T + kTRecord * chunks.pairs[p].b;
      for (int i = 0; i < 6; ++i)
        for (int k = 0; k < 6; ++k)
          for (int c = 0; c < 3; ++c)
            tiles[kTileDoubles * run.tile + std::size_t(tile_layout::at(i, k))] +=
                a[t_record::at(c, i)] * b[t_record::at(c, k)];
    }
  }
}

void residuals(const LensInput& in, const Chunk& chunk, double* out) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < 8; ++l) {
      const Batches::Group& group = in.batches->groups[g];
      for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
        const LensRow row = lens_row(in, point_of(in.at.points, g, l), b, l);
        for (std::size_t e = 0; e < 2; ++e)
          out[16 * (b - chunk.first_batch) + 8 * e + l] =
              inverse_sigma_at(*in.batches, b, l) * std::abs(row.r[e]);
      }
    }
}

}  // namespace

const LensKernels& reference_lens_kernels() {
  static const LensKernels kernels{"scalar",
                                   &linearize,
                                   &lens_products_by_reference,
                                   &pose_pairs,
                                   &lens_trial_by_reference,
                                   &lens_product_by_reference,
                                   &residuals,
                                   &lens_gradient_by_reference,
                                   &lens_curvature_by_reference,
                                   &lens_point_damping_by_reference,
                                   &keep_lens_rows_by_reference};
  return kernels;
}

}  // namespace sheaf
