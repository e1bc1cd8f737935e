// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "residual/batches.h"

#include <algorithm>
#include <array>
#include <bit>

namespace sheaf {
namespace {

/// Observations listed by point, each point's by image.
struct ByPoint {
  std::vector<std::uint64_t> first;  ///< points + 1
  Buffer<std::uint64_t> observation;
  bool identity = false;  ///< the file's order is this order already; `observation` is then empty
  std::uint64_t at(std::uint64_t i) const { return identity ? i : observation[i]; }
};

bool sorted_by_point_and_image(const Problem& p) {
  for (std::size_t i = 1; i < p.num_observations(); ++i) {
    const std::uint32_t a = p.observation_point[i - 1], b = p.observation_point[i];
    if (a > b || (a == b && p.observation_image[i - 1] > p.observation_image[i])) return false;
  }
  return true;
}

/// Two counting sorts: by image, then stably by point.
ByPoint list_by_point(const Problem& p, const std::vector<std::uint8_t>& skip) {
  const auto used = [&](std::size_t i) { return skip.empty() || skip[i] == 0; };
  ByPoint out;
  out.first.assign(p.num_points() + 1, 0);
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    if (used(i)) ++out.first[p.observation_point[i] + 1];
  for (std::size_t i = 0; i < p.num_points(); ++i) out.first[i + 1] += out.first[i];
  if (skip.empty() && sorted_by_point_and_image(p)) {
    out.identity = true;
    return out;
  }
  std::vector<std::uint64_t> next(p.num_images() + 1, 0);
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    if (used(i)) ++next[p.observation_image[i] + 1];
  for (std::size_t i = 0; i < p.num_images(); ++i) next[i + 1] += next[i];
  Buffer<std::uint64_t> by_image(out.first.back());
  for (std::size_t i = 0; i < p.num_observations(); ++i)
    if (used(i)) by_image[next[p.observation_image[i]]++] = i;
  std::vector<std::uint64_t> place(out.first.begin(), out.first.end() - 1);
  out.observation.allocate(out.first.back());
  for (std::uint64_t i : by_image) out.observation[place[p.observation_point[i]]++] = i;
  return out;
}

/// Neighbours in the order in which points are visited should see the same images, so that their
/// records are still in cache: each image's place in a breadth-first walk from image to image by
/// the points that they share. Empty where the images' records fit into the cache in any order.
std::vector<std::uint32_t> rank_images(const Problem& p, const ByPoint& by_point) {
  constexpr std::size_t kFewImages = 1024, kObservations = std::size_t{1} << 22;
  const std::size_t images = p.num_images();
  if (images < kFewImages) return {};
  // A part of the points tells as much as all.
  const std::uint64_t stride = 1 + by_point.first.back() / kObservations;
  std::vector<std::uint64_t> first(images + 1, 0);
  const auto for_each_sample = [&](const auto& visit) {
    for (std::size_t j = 0; j < p.num_points(); j += stride)
      for (std::uint64_t i = by_point.first[j]; i < by_point.first[j + 1]; ++i)
        visit(p.observation_image[by_point.at(i)], static_cast<std::uint32_t>(j));
  };
  for_each_sample([&](std::uint32_t image, std::uint32_t) { ++first[image + 1]; });
  for (std::size_t i = 0; i < images; ++i) first[i + 1] += first[i];
  std::vector<std::uint64_t> next(first.begin(), first.end() - 1);
  Buffer<std::uint32_t> points(first.back());
  for_each_sample([&](std::uint32_t image, std::uint32_t point) { points[next[image]++] = point; });

  std::vector<std::uint32_t> walk, rank(images, UINT32_MAX);
  std::vector<bool> passed(p.num_points(), false);
  const auto reach = [&](std::uint32_t image) {
    if (rank[image] != UINT32_MAX) return;
    rank[image] = static_cast<std::uint32_t>(walk.size());
    walk.push_back(image);
  };
  std::size_t at = 0;
  for (std::uint32_t start = 0; start < images; ++start) {
    reach(start);
    for (; at < walk.size(); ++at)
      for (std::uint64_t k = first[walk[at]]; k < first[walk[at] + 1]; ++k) {
        const std::uint32_t point = points[k];
        if (passed[point]) continue;
        passed[point] = true;
        for (std::uint64_t i = by_point.first[point]; i < by_point.first[point + 1]; ++i)
          reach(p.observation_image[by_point.at(i)]);
      }
  }
  return rank;
}

struct KeyedPoint {
  std::uint64_t key;
  std::uint32_t point;
};

/// Least significant byte first; passes over bytes that are the same everywhere are skipped.
void radix_sort(Buffer<KeyedPoint>& items) {
  std::array<std::array<std::uint32_t, 256>, 8> counts{};
  for (const KeyedPoint& item : items)
    for (int b = 0; b < 8; ++b) ++counts[b][(item.key >> (8 * b)) & 255];
  Buffer<KeyedPoint> other(items.size());
  for (int b = 0; b < 8; ++b) {
    auto& count = counts[b];
    if (std::find(count.begin(), count.end(), items.size()) != count.end()) continue;
    std::uint32_t sum = 0;
    for (std::uint32_t& c : count) sum += std::exchange(c, sum);
    for (const KeyedPoint& item : items) other[count[(item.key >> (8 * b)) & 255]++] = item;
    std::swap(items, other);
  }
}

/// Points that are seen, by track length and then by as many leading images as fit in the key.
Buffer<KeyedPoint> order_points(const Problem& p, const ByPoint& by_point) {
  const int bits = std::max(1, static_cast<int>(std::bit_width(p.num_images() - 1)));
  constexpr int kLengthBits = 20;
  const int leading = std::max(1, (64 - kLengthBits) / bits);
  const std::vector<std::uint32_t> rank = rank_images(p, by_point);
  const auto place = [&](std::uint32_t image) { return rank.empty() ? image : rank[image]; };
  std::size_t seen = 0;
  for (std::size_t j = 0; j < p.num_points(); ++j)
    seen += by_point.first[j + 1] > by_point.first[j];
  Buffer<KeyedPoint> items(seen);
  seen = 0;
  for (std::size_t j = 0; j < p.num_points(); ++j) {
    const std::uint64_t begin = by_point.first[j], track = by_point.first[j + 1] - begin;
    if (track == 0) continue;
    std::uint64_t key = std::min<std::uint64_t>(track, (1u << kLengthBits) - 1);
    for (int o = 0; o < leading; ++o) {
      const bool has = static_cast<std::uint64_t>(o) < track;
      key = (key << bits) | (has ? place(p.observation_image[by_point.at(begin + o)]) : 0);
    }
    items[seen++] = {key, static_cast<std::uint32_t>(j)};
  }
  radix_sort(items);
  const auto track = [&](const KeyedPoint& k) {
    return by_point.first[k.point + 1] - by_point.first[k.point];
  };
  // Tracks beyond the key's range share one value: put these few in order of length.
  const auto beyond = std::find_if(items.begin(), items.end(), [&](const KeyedPoint& k) {
    return track(k) >= (1u << kLengthBits) - 1;
  });
  std::stable_sort(beyond, items.end(),
                   [&](const auto& a, const auto& b) { return track(a) < track(b); });
  return items;
}

void form_groups(const Buffer<KeyedPoint>& order, const ByPoint& by_point, Batches& out) {
  std::uint64_t batches = 0;
  const auto track = [&](std::size_t i) {
    return by_point.first[order[i].point + 1] - by_point.first[order[i].point];
  };
  out.groups.reserve(order.size() / 8 + 64);
  out.lane_point.reserve(order.size() + 512);
  for (std::size_t i = 0; i < order.size();) {
    const std::uint64_t k = track(i);
    std::uint32_t lanes = 0;
    while (lanes < 8 && i + lanes < order.size() && track(i + lanes) == k) ++lanes;
    for (std::uint32_t l = 0; l < 8; ++l)
      out.lane_point.push_back(order[i + (l < lanes ? l : 0)].point);
    out.groups.push_back({batches, static_cast<std::uint32_t>(k), lanes});
    out.longest_track = std::max(out.longest_track, static_cast<std::uint32_t>(k));
    batches += k;
    i += lanes;
  }
  out.image.allocate(8 * batches);
  out.uniform.allocate(batches);
  out.xy.allocate(16 * batches);
}

void fill_batches(const Problem& p, const ByPoint& by_point, Batches& out) {
  for (std::size_t g = 0; g < out.groups.size(); ++g) {
    const Batches::Group& group = out.groups[g];
    for (int l = 0; l < 8; ++l) {
      const std::uint64_t begin = by_point.first[out.lane_point[8 * g + l]];
      for (std::uint32_t o = 0; o < group.track; ++o) {
        const std::uint64_t i = by_point.at(begin + o), b = group.first_batch + o;
        out.image[8 * b + l] = p.observation_image[i];
        out.xy[16 * b + l] = p.observation_xy[2 * i];
        out.xy[16 * b + 8 + l] = p.observation_xy[2 * i + 1];
      }
    }
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
      const std::uint32_t* image = &out.image[8 * b];
      const bool same = std::all_of(image + 1, image + 8, [&](auto i) { return i == image[0]; });
      out.uniform[b] = same ? static_cast<std::int32_t>(image[0]) : -1;
    }
  }
}

}  // namespace

Batches arrange(const Problem& problem, const std::vector<std::uint8_t>& skip) {
  const ByPoint by_point = list_by_point(problem, skip);
  Batches out;
  out.observations = by_point.first.back();
  form_groups(order_points(problem, by_point), by_point, out);
  fill_batches(problem, by_point, out);
  return out;
}

}  // namespace sheaf
