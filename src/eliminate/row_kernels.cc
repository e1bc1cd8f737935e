// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "eliminate/row_kernels.h"

#include <string_view>
#include <type_traits>

#include "platform/dispatch.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "eliminate/row_kernels.cc"
#include <hwy/foreach_target.h>  // IWYU pragma: keep
// After foreach_target.h:
#include <hwy/highway.h>

#include "eliminate/point_trial-inl.h"
#include "eliminate/row_source-inl.h"
#include "eliminate/schur_product-inl.h"

HWY_BEFORE_NAMESPACE();
namespace sheaf {
namespace HWY_NAMESPACE {

template <class Kept>
using SourceOf = RowSource<std::remove_const_t<std::remove_pointer_t<Kept>>>;

void eliminate_rows(const StoredRowsInput& in, const Chunk& chunk, const Records& records,
                    EliminateOutput& out) {
  with_kept(in.rows, [&](auto* kept) {
    eliminate_chunk<SourceOf<decltype(kept)>, false, false>(
        {{in.batches, &in.rows, nullptr, nullptr, in.poses},
         {in.damping, in.points_held, {}, {}, in.own_damping}},
        chunk, records, out);
  });
}

void back_substitute_rows(const RowTrialInput& in, const Chunk& chunk, TrialOutput& out) {
  const RowState held{in.batches, &in.rows, in.points, in.steps, false};
  with_kept(in.rows, [&](auto* kept) {
    trial_chunk<SourceOf<decltype(kept)>, false, false>({held, held, in.factors, nullptr, {}},
                                                        chunk, out);
  });
}

template <class Source>
void multiply_group(const RowState& in, const double* factors, std::size_t g, double* y) {
  const Batches& batches = *in.batches;
  const Batches::Group& group = batches.groups[g];
  V u[kParts][3];
  for (int part = 0; part < kParts; ++part) {
    const GroupPart of(group, g, part);
    const Source source(in, of, nullptr);
    V s[3] = {zero(), zero(), zero()};
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      source.couple(b, nullptr, s);
    solve_point(factors + kFactorGroup * g + of.lane(), s, u[part]);
  }
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    alignas(64) double rows[64], ninth[8];
    for (int part = 0; part < kParts; ++part) {
      const GroupPart of(group, g, part);
      const Source source(in, of, nullptr);
      const LaneJacobian j = source.rows(b, nullptr, nullptr);
      V x[9], e[2], v[9];
      source.load_x(in.steps, b, x);
      times_block(j, x, e);
      for (int r = 0; r < 2; ++r)
        for (int i = 0; i < 3; ++i) e[r] = fnma(j.point[r][i], u[part][i], e[r]);
      for (int k = 0; k < 9; ++k) v[k] = fma(j.camera[0][k], e[0], hn::Mul(j.camera[1][k], e[1]));
      store_records(v, rows + 8 * of.lane(), 8);
      store(v[8], ninth + of.lane());
    }
    scatter(rows, ninth, &batches.image[8 * b], batches.uniform[b], y);
  }
}

void multiply_rows(const RowTrialInput& in, const Chunk& chunk, double* y) {
  const RowState held{in.batches, &in.rows, in.points, in.steps, false};
  with_kept(in.rows, [&](auto* kept) {
    for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g)
      multiply_group<SourceOf<decltype(kept)>>(held, in.factors, g, y);
  });
}

/// a[k] += x[k] v for k < 6.
HWY_INLINE void add_outer6(const double* x, V v, V* a) {
  for (int k = 0; k < 6; ++k) a[k] = fma(set(x[k]), v, a[k]);
}

/// Of records as write_pose_records leaves them; every sum in chains of its own, so that one
/// product need not wait for another's sum.
void pose_diagonal(const Chunks& chunks, const Chunk& chunk, const Records& from, double* sums) {
  for (std::uint64_t i = chunk.first_diagonal_run; i < chunk.end_diagonal_run; ++i) {
    const DiagonalRun run = chunks.diagonal_runs[i];
    const std::uint16_t* records = &chunks.diagonal[run.first];
    double* block = sums + kDiagonalDoubles * run.image;
    alignas(64) double products[6][8];
    for (int column = 0; column < 8; column += kLanes) {
      V first[6], second[6], squares[3];
      for (int k = 0; k < 6; ++k) first[k] = second[k] = zero();
      for (V& x : squares) x = zero();
      for (std::uint32_t o = 0; o < run.count; ++o) {
        const double* c = from.C + kCRecord * records[o];
        const double* t = from.T + kTRecord * records[o] + column;
        add_outer6(c, load(c + column), first);
        add_outer6(c + c_record::row(1), load(c + c_record::row(1) + column), second);
        for (int q = 0; q < 3; ++q) {
          const V of = load(t + t_record::column(q));
          squares[q] = fma(of, of, squares[q]);
        }
      }
      for (int k = 0; k < 6; ++k) store(hn::Add(first[k], second[k]), products[k] + column);
      add_to(hn::Add(squares[0], hn::Add(squares[1], squares[2])),
             block + diagonal_layout::kSquares + column);
    }
    for (int k = 0; k < 6; ++k) {
      for (int c = 0; c < 6; ++c) block[diagonal_layout::at(k, c)] += products[k][c];
      block[diagonal_layout::right_side(k)] += products[k][6];
    }
  }
}

constexpr RowKernels row_table() {
  return {set_name(HWY_TARGET),  kLanes,        &eliminate_rows, &pose_diagonal,
          &back_substitute_rows, &multiply_rows};
}

}  // namespace HWY_NAMESPACE
}  // namespace sheaf
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace sheaf {

const RowKernels& row_kernels(const char* simd_name) {
  if (std::string_view(simd_name) == "scalar") return reference_row_kernels();
  static constexpr RowKernels tables[] = SHEAF_TABLES(row_table);
  return table_named(tables, simd_name);
}

}  // namespace sheaf
#endif  // HWY_ONCE
