// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/pattern.h"

#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>

namespace sheaf {
namespace {

using Range = std::pair<std::uint64_t, std::uint64_t>;

/// A range of scalars as a range of pixels, fractions included.
std::pair<double, double> on_pixels(const PatternAxis& axis, std::uint64_t begin,
                                    std::uint64_t end) {
  for (const PatternAxis::Band& band : axis.bands) {
    if (begin >= band.end) continue;
    const double scale = band.pixels / static_cast<double>(band.end - band.begin);
    return {band.first_pixel + scale * static_cast<double>(begin - band.begin),
            band.first_pixel + scale * static_cast<double>(end - band.begin)};
  }
  return {0, 0};
}

PatternAxis two_bands(std::uint64_t first, std::uint64_t second, int pixels, int first_pixels) {
  return {
      {{0, first, 0, first_pixels}, {first, first + second, first_pixels, pixels - first_pixels}}};
}

// The camera-side ranges of a point's observations, without repeats (a shared lens is one).
std::vector<Range> camera_ranges(const PatternColumns& columns, const Tracks& tracks,
                                 std::size_t point) {
  std::vector<Range> out;
  for (std::uint64_t k = tracks.begin[point]; k < tracks.begin[point + 1]; ++k)
    for (const Range& range : columns.of_image(columns.problem->observation_image[tracks.order[k]]))
      out.push_back(range);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace

PatternGrid::PatternGrid(PatternAxis rows, PatternAxis columns)
    : rows_(std::move(rows)),
      columns_(std::move(columns)),
      density_(std::size_t(rows_.pixels()) * std::size_t(columns_.pixels())) {}

void PatternGrid::add(std::uint64_t r0, std::uint64_t r1, std::uint64_t c0, std::uint64_t c1) {
  nonzeros_ += (r1 - r0) * (c1 - c0);
  const auto [top, bottom] = on_pixels(rows_, r0, r1);
  const auto [left, right] = on_pixels(columns_, c0, c1);
  const int last_row = std::min(rows_.pixels(), static_cast<int>(std::ceil(bottom)));
  const int last_column = std::min(columns_.pixels(), static_cast<int>(std::ceil(right)));
  for (int y = static_cast<int>(top); y < last_row; ++y) {
    const double high = std::min(bottom, y + 1.0) - std::max(top, double(y));
    double* line = &density_[std::size_t(y) * std::size_t(columns_.pixels())];
    for (int x = static_cast<int>(left); x < last_column; ++x)
      line[x] += std::max(0.0, high * (std::min(right, x + 1.0) - std::max(left, double(x))));
  }
}

PatternColumns::PatternColumns(const Problem& problem) : problem(&problem) {
  own_lenses = problem.cameras.size() == problem.num_images();
  for (std::size_t j = 0; own_lenses && j < problem.num_images(); ++j)
    own_lenses = problem.image_camera[j] == j;
  camera_side = 6 * problem.num_images() + 3 * problem.cameras.size();
  points = problem.points.size();
}

std::vector<Range> PatternColumns::of_image(std::uint32_t image) const {
  const std::uint64_t j = image;
  if (own_lenses) return {{9 * j, 9 * j + 9}};
  const std::uint64_t lens =
      6 * problem->num_images() + 3 * std::uint64_t(problem->image_camera[j]);
  return {{6 * j, 6 * j + 6}, {lens, lens + 3}};
}

PatternGrid jacobian_pattern(const Problem& problem, const Tracks& tracks, int height, int width,
                             int camera_width) {
  const PatternColumns columns(problem);
  const std::uint64_t rows = 2 * problem.num_observations();
  PatternGrid grid({{{0, rows, 0, height}}},
                   two_bands(columns.camera_side, columns.points, width, camera_width));
  std::uint64_t row = 0;
  for (std::size_t p = 0; p < problem.num_points(); ++p) {
    for (std::uint64_t k = tracks.begin[p]; k < tracks.begin[p + 1]; ++k, row += 2) {
      for (const auto& [begin, end] : columns.of_image(problem.observation_image[tracks.order[k]]))
        grid.add(row, row + 2, begin, end);
      grid.add(row, row + 2, columns.camera_side + 3 * p, columns.camera_side + 3 * p + 3);
    }
  }
  return grid;
}

PatternGrid hessian_pattern(const Problem& problem, const Tracks& tracks, int size,
                            int camera_size) {
  const PatternColumns columns(problem);
  const PatternAxis axis = two_bands(columns.camera_side, columns.points, size, camera_size);
  PatternGrid grid(axis, axis);
  std::vector<bool> seen(problem.cameras.size(), false);
  for (std::uint32_t j = 0; j < problem.num_images(); ++j) {
    const std::vector<Range> ranges = columns.of_image(j);
    for (const auto& [r0, r1] : ranges)
      for (const auto& [c0, c1] : ranges) {
        const bool lens_alone = ranges.size() == 2 && r0 == ranges[1].first && c0 == r0;
        if (lens_alone && seen[problem.image_camera[j]]) continue;
        if (lens_alone) seen[problem.image_camera[j]] = true;
        grid.add(r0, r1, c0, c1);
      }
  }
  for (std::size_t p = 0; p < problem.num_points(); ++p) {
    const std::uint64_t at = columns.camera_side + 3 * p;
    grid.add(at, at + 3, at, at + 3);
    for (const auto& [begin, end] : camera_ranges(columns, tracks, p)) {
      grid.add(begin, end, at, at + 3);
      grid.add(at, at + 3, begin, end);
    }
  }
  return grid;
}

ReducedPattern reduced_pattern(const Problem& problem, const Tracks& tracks, int most_pixels,
                               std::size_t most_links, std::vector<Link>& strongest) {
  const std::size_t n = problem.num_images();
  ReducedPattern out;
  out.size = static_cast<int>(std::min<std::size_t>(n, std::size_t(most_pixels)));
  const auto size = static_cast<std::size_t>(out.size);
  out.largest.assign(size * size, 0);
  const auto raise = [&](std::uint64_t a, std::uint64_t b, std::uint32_t points) {
    std::uint32_t& cell = out.largest[a * size / n * size + b * size / n];
    cell = std::max(cell, points);
  };
  out.observations.assign(n, 0);
  for (const std::uint32_t image : problem.observation_image) ++out.observations[image];
  for (std::size_t j = 0; j < n; ++j) raise(j, j, out.observations[j]);
  const auto stronger = [](const Link& x, const Link& y) {
    return x.points != y.points ? x.points > y.points : std::pair(x.a, x.b) < std::pair(y.a, y.b);
  };
  std::priority_queue<Link, std::vector<Link>, decltype(stronger)> best(stronger);
  for_each_link(problem, tracks, [&](std::uint32_t a, std::uint32_t b, std::uint32_t points) {
    ++out.links;
    out.strongest = std::max(out.strongest, points);
    raise(a, b, points);
    raise(b, a, points);
    best.push({a, b, points});
    if (best.size() > most_links) best.pop();
  });
  strongest.clear();
  for (; !best.empty(); best.pop()) strongest.push_back(best.top());
  return out;
}

}  // namespace sheaf
