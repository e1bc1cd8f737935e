// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The kernels of kept rows once more as plain scalar code, one observation at a time: what the fast
// ones are tested against.
#include <algorithm>
#include <vector>

#include "eliminate/reference_point.h"
#include "eliminate/row_kernels.h"
#include "rows/reference_patch.h"
#include "rows/row_layout.h"

namespace sheaf {
namespace {

PointRow stored_row(const double* batch, std::uint32_t lane) {
  const double* from = batch + first_row_field(kReferenceLanes, static_cast<int>(lane));
  PointRow row;
  for (int e = 0; e < 2; ++e) {
    const auto to = static_cast<std::size_t>(e);
    row.r[to] = from[row_field::residual(e)];
    for (int k = 0; k < 9; ++k) row.camera[to][std::size_t(k)] = from[row_field::camera(e, k)];
    for (int k = 0; k < 3; ++k) row.point[to][std::size_t(k)] = from[row_field::point(e, k)];
  }
  return row;
}

PointRow kept_row(const KeptRows& rows, std::size_t g, std::uint64_t b, std::uint32_t lane) {
  if (rows.stored != nullptr) return stored_row(rows.stored + kRowBatch * b, lane);
  const bool brightness = rows.patches->brightness;
  return patch_rows(
      {*rows.patches, g, b, lane},
      PatchFactor::restore(brightness, rows.factors + patch_factors(brightness) * b + lane));
}

/// The six columns of a pose; h in the seventh of C. What is beyond in T is not read.
void write_pose_records(const PointRow& row, const WhitenedRow& m, double* T, double* C) {
  std::fill_n(T, 24, 0.0);
  std::fill_n(C, kCRecord, 0.0);
  for (std::size_t k = 0; k < 6; ++k) {
    const double j0 = row.camera[0][k], j1 = row.camera[1][k];
    const std::array<double, 2> column = m.times_transpose(j0, j1);
    for (std::size_t e = 0; e < 2; ++e) C[8 * e + k] = column[e];
    for (std::size_t c = 0; c < 3; ++c) T[8 * c + k] = j0 * m.B[0][c] + j1 * m.B[1][c];
  }
  C[6] = m.h[0], C[8 + 6] = m.h[1];
}

void eliminate_point(const StoredRowsInput& in, const Chunk& chunk, std::size_t g,
                     std::uint32_t lane, const Records& records, EliminateOutput& out) {
  const Batches::Group& group = in.batches->groups[g];
  std::vector<PointRow> rows;
  PointNormal normal;
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    rows.push_back(kept_row(in.rows, g, b, lane));
    normal.add(rows.back());
  }
  const ChartRules none{};
  const double lambda = damping_of_point(in.damping, in.own_damping, g, lane);
  const EliminatedPoint p(normal, {none, {}, {}}, lambda, in.points_held);
  out.point_decrease += p.decrease();
  out.gradient_max2 = std::max(out.gradient_max2, p.decrease());
  p.store(out.factors + kFactorGroup * g + lane);
  for (std::size_t o = 0; o < rows.size(); ++o) {
    const std::uint64_t record = 8 * (group.first_batch + o - chunk.first_batch) + lane;
    (in.poses ? write_pose_records : write_point_records)(rows[o], WhitenedRow(rows[o], p),
                                                          records.T + kTRecord * record,
                                                          records.C + kCRecord * record);
  }
}

void eliminate(const StoredRowsInput& in, const Chunk& chunk, const Records& records,
               EliminateOutput& out) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < in.batches->groups[g].lanes; ++l)
      eliminate_point(in, chunk, g, l, records, out);
}

void pose_diagonal(const Chunks& chunks, const Chunk& chunk, const Records& records,
                   double* diagonal) {
  for (std::uint64_t r = chunk.first_diagonal_run; r < chunk.end_diagonal_run; ++r) {
    const DiagonalRun& run = chunks.diagonal_runs[r];
    double* block = diagonal + kDiagonalDoubles * run.image;
    for (std::uint64_t at = run.first; at < run.first + run.count; ++at) {
      const double *T = records.T + kTRecord * chunks.diagonal[at],
                   *C = records.C + kCRecord * chunks.diagonal[at];
      for (int i = 0; i < 6; ++i) {
        for (int e = 0; e < 2; ++e) {
          for (int k = 0; k < 6; ++k)
            block[diagonal_layout::at(i, k)] += C[8 * e + i] * C[8 * e + k];
          block[diagonal_layout::right_side(i)] += C[8 * e + i] * C[8 * e + 6];
        }
        for (int c = 0; c < 3; ++c)
          block[diagonal_layout::squares(i)] += T[8 * c + i] * T[8 * c + i];
      }
    }
  }
}

/// Of one point: s = sum Jp^T Jc dc.
Vector3<double> coupling(const RowTrialInput& in, std::size_t g, std::uint32_t lane) {
  const Batches::Group& group = in.batches->groups[g];
  Vector3<double> s{};
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const PointRow row = kept_row(in.rows, g, b, lane);
    const double* step = in.steps + kBlockVector * in.batches->image[8 * b + lane];
    for (std::size_t e = 0; e < 2; ++e) {
      double moved = 0;
      for (std::size_t k = 0; k < 9; ++k) moved += row.camera[e][k] * step[k];
      for (std::size_t i = 0; i < 3; ++i) s[i] += row.point[e][i] * moved;
    }
  }
  return s;
}

void substitute_point(const RowTrialInput& in, std::size_t g, std::uint32_t lane,
                      TrialOutput& out) {
  Vector3<double> d{};
  if (lane < in.batches->groups[g].lanes) {  // others stay where they are
    const double* factor = in.factors + kFactorGroup * g + lane;
    d = back_substitute(factor, coupling(in, g, lane));
    for (std::size_t i = 0; i < 3; ++i)
      out.damping_term += d[i] * d[i] * factor[factor_group::damping(static_cast<int>(i))];
  }
  double moved = 0, size = 1e-300;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t at = kPointGroup * g + 8 * i + lane;
    out.points[at] = in.points[at] + d[i];
    moved += d[i] * d[i], size += in.points[at] * in.points[at];
  }
  out.step2_max = std::max(out.step2_max, moved / size);
}

void back_substitute_rows(const RowTrialInput& in, const Chunk& chunk, TrialOutput& out) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < 8; ++l) substitute_point(in, g, l, out);
}

/// e = Jc x, u = (V + D)^-1 sum Jp^T e, y += Jc^T (e - Jp u).
void multiply_point(const RowTrialInput& in, std::size_t g, std::uint32_t lane, double* y) {
  const Batches::Group& group = in.batches->groups[g];
  // back_substitute gives L^-T (w - L^-1 s): taken from that of s = 0, (V + D)^-1 s is left.
  const double* factor = in.factors + kFactorGroup * g + lane;
  const Vector3<double> with = back_substitute(factor, coupling(in, g, lane));
  const Vector3<double> without = back_substitute(factor, {});
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const PointRow row = kept_row(in.rows, g, b, lane);
    const std::size_t block = kBlockVector * in.batches->image[8 * b + lane];
    for (std::size_t r = 0; r < 2; ++r) {
      double e = 0;
      for (std::size_t k = 0; k < 9; ++k) e += row.camera[r][k] * in.steps[block + k];
      for (std::size_t i = 0; i < 3; ++i) e -= row.point[r][i] * (without[i] - with[i]);
      for (std::size_t k = 0; k < 9; ++k) y[block + k] += row.camera[r][k] * e;
    }
  }
}

void multiply(const RowTrialInput& in, const Chunk& chunk, double* y) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < in.batches->groups[g].lanes; ++l) multiply_point(in, g, l, y);
}

}  // namespace

const RowKernels& reference_row_kernels() {
  static const RowKernels kernels{"scalar",       kReferenceLanes,       &eliminate,
                                  &pose_diagonal, &back_substitute_rows, &multiply};
  return kernels;
}

}  // namespace sheaf
