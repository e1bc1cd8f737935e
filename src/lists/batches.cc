// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "lists/batches.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <utility>

#include "lists/by_point.h"
#include "platform/cancel.h"
#include "platform/parallel.h"
#include "scene/terms.h"

namespace sheaf {
namespace {

/// Parts of a pass over points or groups that one thread takes at a time.
constexpr std::size_t kPoints = 4096, kGroups = 256;

/// Neighbours in the order in which points are visited should see the same images, so that their
/// records are still in cache: each image's place in a breadth-first walk from image to image by
/// the points that they share. Empty where the images' records fit into the cache in any order.
std::vector<std::uint32_t> rank_images(const Problem& p, const ByPoint& by_point) {
  constexpr std::size_t kFewImages = 1024, kSampled = std::size_t{1} << 22;
  const std::size_t images = p.num_images();
  if (images < kFewImages) return {};
  // A part of the points tells as much as all.
  const std::uint64_t stride = 1 + by_point.first[p.num_points()] / kSampled;
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

/// Least significant digit first; digits that are the same everywhere are skipped. Stable, so the
/// parts that threads take do not show in the result.
class RadixSort {
 public:
  RadixSort(Buffer<KeyedPoint>& items, Threads& threads)
      : items_(items),
        threads_(threads),
        each_(std::max<std::size_t>(kFewest, (items.size() + kMostParts - 1) / kMostParts)) {}

  void run() {
    const std::uint64_t differs = differing_bits();
    if (differs == 0) return;
    other_.allocate(items_.size());
    counts_.resize((items_.size() + each_ - 1) / each_);
    for (int shift = 0; shift < 64; shift += kDigitBits)
      if (((differs >> shift) & (kDigits - 1)) != 0) pass(shift);
  }

 private:
  static constexpr int kDigitBits = 8;
  static constexpr std::size_t kDigits = 1 << kDigitBits, kMostParts = 64, kFewest = 16384;

  std::uint64_t differing_bits() {
    std::atomic<std::uint64_t> differs{0};
    threads_.for_ranges(items_.size(), each_, [&](std::size_t i, std::size_t end) {
      poll_cancelled();
      std::uint64_t bits = 0;
      for (; i < end; ++i) bits |= items_[i].key ^ items_[0].key;
      differs.fetch_or(bits, std::memory_order_relaxed);
    });
    return differs;
  }

  void pass(int shift) {
    const auto digit = [&](const KeyedPoint& item) { return (item.key >> shift) & (kDigits - 1); };
    threads_.for_ranges(items_.size(), each_, [&](std::size_t i, std::size_t end) {
      poll_cancelled();
      std::array<std::uint32_t, kDigits>& count = counts_[i / each_];
      count.fill(0);
      for (; i < end; ++i) ++count[digit(items_[i])];
    });
    std::uint32_t sum = 0;
    for (std::size_t d = 0; d < kDigits; ++d)
      for (auto& count : counts_) sum += std::exchange(count[d], sum);
    threads_.for_ranges(items_.size(), each_, [&](std::size_t i, std::size_t end) {
      poll_cancelled();
      std::array<std::uint32_t, kDigits>& to = counts_[i / each_];
      for (; i < end; ++i) other_[to[digit(items_[i])]++] = items_[i];
    });
    std::swap(items_, other_);
  }

  Buffer<KeyedPoint>& items_;
  Threads& threads_;
  const std::size_t each_;
  Buffer<KeyedPoint> other_;
  std::vector<std::array<std::uint32_t, kDigits>> counts_;  ///< of each part
};

/// Points that are seen, in order, each with its track length and as many leading images as fit.
Buffer<KeyedPoint> key_points(const Problem& p, const ByPoint& by_point, int length_bits,
                              Threads& threads) {
  const int bits = std::max(1, static_cast<int>(std::bit_width(p.num_images() - 1)));
  const int leading = std::max(1, (64 - length_bits) / bits);
  const std::uint64_t longest = (std::uint64_t(1) << length_bits) - 1;
  const std::vector<std::uint32_t> rank = rank_images(p, by_point);
  const auto place = [&](std::uint32_t image) { return rank.empty() ? image : rank[image]; };
  std::vector<std::size_t> first((p.num_points() + kPoints - 1) / kPoints + 1, 0);
  threads.for_ranges(p.num_points(), kPoints, [&](std::size_t j, std::size_t end) {
    std::size_t& seen = first[j / kPoints + 1];
    for (; j < end; ++j) seen += by_point.track(j) > 0;
  });
  for (std::size_t part = 1; part < first.size(); ++part) first[part] += first[part - 1];
  Buffer<KeyedPoint> items(first.back());
  threads.for_ranges(p.num_points(), kPoints, [&](std::size_t j, std::size_t end) {
    poll_cancelled();
    std::size_t at = first[j / kPoints];
    for (; j < end; ++j) {
      const std::uint64_t begin = by_point.first[j], track = by_point.track(j);
      if (track == 0) continue;
      std::uint64_t key = std::min(track, longest);
      for (int o = 0; o < leading; ++o) {
        const bool has = static_cast<std::uint64_t>(o) < track;
        key = (key << bits) | (has ? place(p.observation_image[by_point.at(begin + o)]) : 0);
      }
      items[at++] = {key, static_cast<std::uint32_t>(j)};
    }
  });
  return items;
}

/// Points that are seen, by track length and then by their leading images.
Buffer<KeyedPoint> order_points(const Problem& p, const ByPoint& by_point, Threads& threads) {
  constexpr int kLengthBits = 20;
  Buffer<KeyedPoint> items = key_points(p, by_point, kLengthBits, threads);
  RadixSort(items, threads).run();
  // Tracks beyond the key's range share one value: put these few in order of length.
  const auto track = [&](const KeyedPoint& k) { return by_point.track(k.point); };
  const auto beyond = std::partition_point(items.begin(), items.end(), [&](const KeyedPoint& k) {
    return track(k) < (1u << kLengthBits) - 1;
  });
  std::stable_sort(beyond, items.end(),
                   [&](const auto& a, const auto& b) { return track(a) < track(b); });
  return items;
}

/// Eight points of one track length at a time.
void form_groups(const Buffer<KeyedPoint>& order, const ByPoint& by_point, Batches& out,
                 Threads& threads) {
  out.groups.reserve(order.size() / 8 + 64);
  out.lane_point.reserve(order.size() + 512);
  std::uint64_t batches = 0;
  for (const KeyedPoint* from = order.begin(); from != order.end();) {
    const std::uint64_t k = by_point.track(from->point);
    const KeyedPoint* end = std::partition_point(
        from, order.end(), [&](const KeyedPoint& item) { return by_point.track(item.point) == k; });
    const std::size_t count = static_cast<std::size_t>(end - from), first = out.groups.size();
    const std::size_t groups = (count + 7) / 8;
    out.groups.resize(first + groups);
    out.lane_point.resize(8 * (first + groups));
    threads.for_ranges(groups, kGroups, [&](std::size_t g, std::size_t last) {
      for (; g < last; ++g) {
        const std::size_t lanes = std::min<std::size_t>(8, count - 8 * g);
        out.groups[first + g] = {batches + k * g, static_cast<std::uint32_t>(k),
                                 static_cast<std::uint32_t>(lanes)};
        for (std::size_t l = 0; l < 8; ++l)
          out.lane_point[8 * (first + g) + l] = from[8 * g + (l < lanes ? l : 0)].point;
      }
    });
    out.longest_track = std::max(out.longest_track, static_cast<std::uint32_t>(k));
    batches += k * groups;
    from = end;
  }
  out.image.allocate(8 * batches);
  out.uniform.allocate(batches);
  out.xy.allocate(16 * batches);
}

/// The points' own rows. They are few, so that most groups have none.
void fill_priors(const Problem& p, Batches& out) {
  if (p.terms.points.empty()) return;
  std::vector<const PointPrior*> of_point(p.num_points(), nullptr);
  for (const PointPrior& prior : p.terms.points) of_point[prior.point] = &prior;
  out.prior.allocate(kPointPrior * out.groups.size());
  out.prior.fill(0);
  for (std::size_t g = 0; g < out.groups.size(); ++g)
    for (std::uint32_t l = 0; l < out.groups[g].lanes; ++l) {
      const PointPrior* prior = of_point[out.lane_point[8 * g + l]];
      if (prior == nullptr) continue;
      double* to = &out.prior[kPointPrior * g + l];
      const std::array<double, 9> U = *whitening(prior->covariance);
      const std::array<double, 6> upper{U[0], U[1], U[2], U[4], U[5], U[8]};
      for (int i = 0; i < 6; ++i) to[point_prior::root(i)] = upper[static_cast<std::size_t>(i)];
      for (int i = 0; i < 3; ++i)
        to[point_prior::mean(i)] = prior->position[static_cast<std::size_t>(i)];
    }
}

void fill_group(const Problem& p, const ByPoint& by_point, std::size_t g, Batches& out) {
  const Batches::Group& group = out.groups[g];
  for (int l = 0; l < 8; ++l) {
    const std::uint64_t begin = by_point.first[out.lane_point[8 * g + l]];
    for (std::uint32_t o = 0; o < group.track; ++o) {
      const std::uint64_t i = by_point.at(begin + o), b = group.first_batch + o;
      out.image[8 * b + l] = p.observation_image[i];
      out.xy[16 * b + l] = p.observation_xy[2 * i];
      out.xy[16 * b + 8 + l] = p.observation_xy[2 * i + 1];
      if (!p.observation_sigma.empty()) out.inverse_sigma[8 * b + l] = 1 / p.observation_sigma[i];
    }
  }
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const std::uint32_t* image = &out.image[8 * b];
    const bool same = std::all_of(image + 1, image + 8, [&](auto i) { return i == image[0]; });
    out.uniform[b] = same ? static_cast<std::int32_t>(image[0]) : -1;
  }
}

}  // namespace

Batches arrange(const Problem& problem, const std::vector<std::uint8_t>& skip, Threads& threads) {
  const ByPoint by_point = list_by_point(problem, skip, threads);
  poll_cancelled();
  Batches out;
  out.observations = by_point.first[problem.num_points()];
  form_groups(order_points(problem, by_point, threads), by_point, out, threads);
  if (!problem.observation_sigma.empty()) out.inverse_sigma.allocate(8 * out.num_batches());
  threads.for_ranges(out.groups.size(), kGroups, [&](std::size_t g, std::size_t end) {
    poll_cancelled();
    for (; g < end; ++g) fill_group(problem, by_point, g, out);
  });
  fill_priors(problem, out);
  return out;
}

Batches arrange(const Problem& problem, const std::vector<std::uint8_t>& skip) {
  Threads alone(1);
  return arrange(problem, skip, alone);
}

}  // namespace sheaf
