// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/covisibility.h"

#include <algorithm>

namespace sheaf {
namespace {

// Numbers of the entries with each key, in order: a counting sort.
void sort_by(const std::vector<std::uint32_t>& keys, std::size_t size, Tracks& out) {
  out.begin.assign(size + 1, 0);
  for (const std::uint32_t key : keys) ++out.begin[key + 1];
  for (std::size_t k = 0; k < size; ++k) out.begin[k + 1] += out.begin[k];
  out.order.resize(keys.size());
  std::vector<std::uint64_t> next(out.begin.begin(), out.begin.end() - 1);
  for (std::uint64_t i = 0; i < keys.size(); ++i) out.order[next[keys[i]]++] = i;
}

// Ascending by image, those of one image in their order. Nearly every track is short, and a stable
// sort of the library asks for memory each time.
void sort_by_image(const Problem& problem, std::uint64_t* first, std::uint64_t* end) {
  constexpr std::ptrdiff_t kShort = 32;
  const std::vector<std::uint32_t>& image = problem.observation_image;
  if (end - first > kShort) {
    std::stable_sort(first, end,
                     [&](std::uint64_t a, std::uint64_t b) { return image[a] < image[b]; });
    return;
  }
  for (std::uint64_t* at = first; at != end; ++at) {
    const std::uint64_t moved = *at;
    std::uint64_t* place = at;
    for (; place != first && image[moved] < image[place[-1]]; --place) *place = place[-1];
    *place = moved;
  }
}

using EachLink = std::function<void(std::uint32_t, std::uint32_t, std::uint32_t)>;

// Counts of all pairs at once, a row for each image.
void for_each_link_of_few(const Problem& problem, const Tracks& tracks, const EachLink& link) {
  const std::size_t images = problem.num_images();
  std::vector<std::uint32_t> shared(images * images, 0), seeing;
  for (std::size_t p = 0; p < problem.num_points(); ++p) {
    seeing.clear();
    for (std::uint64_t k = tracks.begin[p]; k < tracks.begin[p + 1]; ++k) {
      const std::uint32_t image = problem.observation_image[tracks.order[k]];
      if (seeing.empty() || seeing.back() != image) seeing.push_back(image);
    }
    for (std::size_t a = 0; a < seeing.size(); ++a)
      for (std::size_t b = a + 1; b < seeing.size(); ++b) ++shared[images * seeing[a] + seeing[b]];
  }
  for (std::uint32_t a = 0; a < images; ++a)
    for (std::uint32_t b = a + 1; b < images; ++b)
      if (shared[images * a + b] > 0) link(a, b, shared[images * a + b]);
}

}  // namespace

Tracks tracks_of(const Problem& problem) {
  Tracks out;
  sort_by(problem.observation_point, problem.num_points(), out);
  for (std::size_t p = 0; p < problem.num_points(); ++p)
    sort_by_image(problem, out.order.data() + out.begin[p], out.order.data() + out.begin[p + 1]);
  return out;
}

void for_each_link(const Problem& problem, const Tracks& tracks,
                   const std::function<void(std::uint32_t, std::uint32_t, std::uint32_t)>& link) {
  constexpr std::size_t kFew = 1024;  // their table has 4 MB
  const std::size_t images = problem.num_images();
  if (images <= kFew) return for_each_link_of_few(problem, tracks, link);
  Tracks by_image;
  sort_by(problem.observation_image, images, by_image);
  std::vector<std::uint32_t> shared(images, 0), seen, points;
  std::vector<std::uint64_t> stamped(images, 0);  // a point may be seen twice in one image
  std::uint64_t stamp = 0;
  for (std::uint32_t a = 0; a < images; ++a) {
    points.clear();
    for (std::uint64_t k = by_image.begin[a]; k < by_image.begin[a + 1]; ++k)
      points.push_back(problem.observation_point[by_image.order[k]]);
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    seen.clear();
    for (const std::uint32_t p : points) {
      ++stamp;
      for (std::uint64_t i = tracks.begin[p]; i < tracks.begin[p + 1]; ++i) {
        const std::uint32_t b = problem.observation_image[tracks.order[i]];
        if (b <= a || stamped[b] == stamp) continue;
        stamped[b] = stamp;
        if (shared[b]++ == 0) seen.push_back(b);
      }
    }
    std::sort(seen.begin(), seen.end());
    for (const std::uint32_t b : seen) {
      link(a, b, shared[b]);
      shared[b] = 0;
    }
  }
}

}  // namespace sheaf
