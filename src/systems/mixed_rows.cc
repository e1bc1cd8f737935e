// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/mixed_rows.h"

#include <algorithm>

#include "eliminate/kernels.h"
#include "rows/row_layout.h"

namespace sheaf {
namespace {

/// visit(batch, lane, point) of every observation.
template <class Visit>
void for_each_lane(const Batches& batches, const Visit& visit) {
  for (std::size_t g = 0; g < batches.groups.size(); ++g) {
    const Batches::Group& group = batches.groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      for (std::uint32_t l = 0; l < group.lanes; ++l) visit(b, l, batches.lane_point[8 * g + l]);
  }
}

}  // namespace

MixedRows::MixedRows(const PatchScene& scene, const PatchBlocks& blocks, const Batches& patches,
                     int pairs, const Anchor& anchor, std::size_t points, int lanes)
    : scene_(scene), anchor_(anchor), pairs_(pairs), lanes_(lanes) {
  const auto count = static_cast<std::uint64_t>(pairs);
  patch_pairs_ = 8 * count * patches.num_batches();
  Problem shell;
  shell.poses.resize(blocks.count());
  shell.points.resize(3 * points);
  std::vector<std::uint64_t> sources;
  const auto observe = [&](std::uint32_t block, std::uint32_t point, std::uint64_t source) {
    shell.observation_image.push_back(block);
    shell.observation_point.push_back(point);
    // Its number comes back with it from where it is arranged.
    shell.observation_xy.push_back(static_cast<double>(sources.size()));
    shell.observation_xy.push_back(0);
    sources.push_back(source);
  };
  for_each_lane(patches, [&](std::uint64_t b, std::uint32_t l, std::uint32_t point) {
    for (std::uint64_t k = 0; k < count; ++k)
      observe(patches.image[8 * b + l], point, 8 * (count * b + k) + l);
  });
  for (std::size_t m = 0; m < anchor.measurements.size(); ++m) {
    const Measurement& of = anchor.measurements[m];
    observe(blocks.of(scene, {of.point, of.image}), of.point, patch_pairs_ + m);
  }
  batches_ = arrange(shell);
  source_.assign(8 * batches_.num_batches(), 0);
  place_.assign(points, 0);
  for_each_lane(batches_, [&](std::uint64_t b, std::uint32_t l, std::uint32_t) {
    source_[8 * b + l] = sources[static_cast<std::size_t>(batches_.xy[16 * b + l])];
  });
  for (std::size_t g = 0; g < batches_.groups.size(); ++g)
    for (std::uint32_t l = 0; l < batches_.groups[g].lanes; ++l)
      place_[batches_.lane_point[8 * g + l]] = 8 * g + l;
}

void MixedRows::spread_points(const Batches& patches, const double* points,
                              double* patch_points) const {
  for (std::size_t g = 0; g < patches.groups.size(); ++g)
    for (std::size_t l = 0; l < 8; ++l) {
      const std::uint64_t at = place_[patches.lane_point[8 * g + l]];
      for (std::size_t d = 0; d < 3; ++d)
        patch_points[kPointGroup * g + 8 * d + l] = points[kPointGroup * (at / 8) + 8 * d + at % 8];
    }
}

/// One lane's 26 fields to `to`, its first.
void MixedRows::copy_rows(const double* patch_rows, std::uint64_t pair, int lane,
                          double* to) const {
  const double* from = patch_rows + kRowBatch * pair + first_row_field(lanes_, lane);
  for (int f = 0; f < row_field::kCount; ++f) to[lanes_ * f] = from[lanes_ * f];
}

AnchorRow MixedRows::measure(const State& state, std::size_t group, std::uint64_t batch, int lane,
                             const Measurement& of) const {
  const double* X = state.points + kPointGroup * group + lane;
  const double* view =
      state.views + kViewRecord * batches_.image[8 * batch + static_cast<std::size_t>(lane)];
  const double xy[2] = {of.x, of.y};
  if (scene_.has_rays())
    return anchor_row(anchor_, scene_.camera, view, &scene_.rays[3 * std::size_t(of.point)], X[0],
                      true, xy);
  const double d[3] = {X[0], X[8], X[16]};
  return anchor_row(anchor_, scene_.camera, view, d, 1, false, xy);
}

MixedRows::Totals MixedRows::gather(const State& state, std::uint32_t first, std::uint32_t end,
                                    double* rows) const {
  Totals totals;
  for (std::uint32_t g = first; g < end; ++g) {
    const Batches::Group& group = batches_.groups[g];
    double* const measured = state.measured_costs + 8 * std::size_t(g);
    std::fill_n(measured, 8, 0.0);
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
      std::fill_n(rows + kRowBatch * b, kRowBatch, 0.0);
      for (int l = 0; l < static_cast<int>(group.lanes); ++l) {
        const std::uint64_t source = source_[8 * b + static_cast<std::size_t>(l)];
        double* to = rows + kRowBatch * b + first_row_field(lanes_, l);
        if (source < patch_pairs_) {
          copy_rows(state.patch_rows, source / 8, static_cast<int>(source % 8), to);
          continue;
        }
        const AnchorRow row = measure(state, g, b, l, anchor_.measurements[source - patch_pairs_]);
        totals.cost += row.cost;
        measured[l] += row.cost;
        totals.square_sum += row.square;
        for (int r = 0; r < 2; ++r) {
          to[lanes_ * row_field::residual(r)] = row.residual[r];
          for (int k = 0; k < 6; ++k) to[lanes_ * row_field::camera(r, k)] = row.camera[r][k];
          for (int k = 0; k < 3; ++k) to[lanes_ * row_field::point(r, k)] = row.point[r][k];
        }
      }
    }
  }
  return totals;
}

}  // namespace sheaf
