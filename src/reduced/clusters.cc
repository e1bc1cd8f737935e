// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/clusters.h"

#include <algorithm>
#include <map>
#include <queue>
#include <utility>

#include "platform/cancel.h"
#include "platform/shared_word.h"

namespace sheaf {

Covisibility::Covisibility(const Batches& batches, std::size_t images, Threads& threads)
    : first_(images + 1, 0) {
  count(
      batches, images, [](std::uint32_t i) { return i; }, threads);
}

Covisibility::Covisibility(const Batches& batches, const std::vector<std::uint32_t>& number,
                           std::size_t count_of_numbers, Threads& threads)
    : first_(count_of_numbers + 1, 0) {
  count(
      batches, count_of_numbers, [&](std::uint32_t i) { return number[i]; }, threads);
}

template <class Number>
void Covisibility::count(const Batches& batches, std::size_t images, const Number& number,
                         Threads& threads) {
  std::uint64_t pairs = 0;
  for (const Batches::Group& group : batches.groups)
    for (std::uint32_t step = 1; step < group.track; step *= 2)
      pairs += std::uint64_t(group.track - step) * group.lanes;
  const std::uint64_t stride = 1 + pairs / std::min(kPairsPerImage * images, kMostPairs);
  const auto visit = [&](const auto& pair) {
    for (std::size_t g = 0; g < batches.groups.size(); ++g) {
      const Batches::Group& group = batches.groups[g];
      for (std::uint32_t l = 0; l < group.lanes; ++l) {
        if ((((8 * g + l) * 0x9e3779b97f4a7c15u) >> 32) % stride != 0) continue;
        const std::uint32_t* image = &batches.image[8 * group.first_batch + l];
        for (std::uint32_t step = 1; step < group.track; step *= 2)
          for (std::uint32_t o = step; o < group.track; ++o)
            if (const std::uint32_t a = number(image[8 * o]), b = number(image[8 * (o - step)]);
                a != b && a < images && b < images)
              pair(a, b);
      }
    }
  };
  visit([&](std::uint32_t a, std::uint32_t b) { ++first_[a + 1], ++first_[b + 1]; });
  for (std::size_t i = 0; i < images; ++i) first_[i + 1] += first_[i];
  std::vector<std::uint32_t> others(first_.back());
  std::vector<std::uint64_t> next(first_.begin(), first_.end() - 1);
  visit([&](std::uint32_t a, std::uint32_t b) {
    others[next[a]++] = b;
    others[next[b]++] = a;
  });
  merge(others, threads);
}

void Covisibility::merge(std::vector<std::uint32_t>& others, Threads& threads) {
  constexpr std::size_t kImages = 64;
  threads.for_ranges(first_.size() - 1, kImages, [&](std::size_t i, std::size_t end) {
    for (; i < end; ++i) std::sort(others.begin() + first_[i], others.begin() + first_[i + 1]);
  });
  std::vector<std::uint64_t> first{0};
  for (std::size_t i = 0; i + 1 < first_.size(); ++i) {
    for (std::uint64_t k = first_[i]; k < first_[i + 1]; ++k) {
      if (neighbours_.size() > first.back() && neighbours_.back().image == others[k])
        ++neighbours_.back().weight;
      else
        neighbours_.push_back({others[k], 1});
    }
    first.push_back(neighbours_.size());
  }
  first_ = std::move(first);
  neighbours_.push_back({0, 0});  // so that every end has an address
}

namespace {

class Growth {
 public:
  Growth(const Covisibility& graph, const Columns& columns)
      : graph_(graph), columns_(columns), weight_(columns.num_images(), 0) {
    out_.of_image.assign(columns.num_images(), Clusters::kNone);
  }

  Clusters run(std::size_t images_each) {
    std::vector<std::size_t> sizes;
    for (std::uint32_t seed; next_seed(seed);) {
      sizes.push_back(grow(seed, images_each));
      ++out_.count;
    }
    join_remnants(sizes, std::max<std::size_t>(1, images_each / 3));
    return std::move(out_);
  }

 private:
  using Candidate = std::pair<std::uint64_t, std::uint32_t>;  ///< weight, ~image: lowest first

  bool open(std::uint32_t i) const {
    return out_.of_image[i] == Clusters::kNone && columns_.image(i)[0] != Columns::kFixed;
  }

  /// Beside the clusters so far where possible: a front leaves no gaps.
  bool next_seed(std::uint32_t& seed) {
    while (!front_.empty()) {
      seed = front_.front();
      front_.pop();
      if (open(seed)) return true;
    }
    for (; first_open_ < columns_.num_images(); ++first_open_)
      if (open(first_open_)) {
        seed = first_open_;
        return true;
      }
    return false;
  }

  std::size_t grow(std::uint32_t seed, std::size_t images_each) {
    std::priority_queue<Candidate> candidates;
    std::vector<std::uint32_t> touched{seed};
    candidates.push({0, ~seed});
    std::size_t size = 0;
    while (size < images_each && !candidates.empty()) {
      const std::uint32_t i = ~candidates.top().second;
      const bool stale = candidates.top().first != weight_[i];
      candidates.pop();
      if (stale || !open(i)) continue;
      out_.of_image[i] = out_.count;
      ++size;
      for (const Covisibility::Neighbour* n = graph_.begin(i); n != graph_.end(i); ++n) {
        if (!open(n->image)) continue;
        if (weight_[n->image] == 0) touched.push_back(n->image);
        weight_[n->image] += n->weight;
        candidates.push({weight_[n->image], ~n->image});
      }
    }
    for (std::uint32_t i : touched) {
      weight_[i] = 0;
      if (open(i)) front_.push(i);
    }
    return size;
  }

  void join_remnants(std::vector<std::size_t>& sizes, std::size_t smallest) {
    std::vector<std::int32_t> renamed(out_.count);
    for (std::int32_t c = 0; c < out_.count; ++c) renamed[c] = c;
    std::vector<std::map<std::int32_t, std::uint64_t>> shared(out_.count);
    for (std::uint32_t i = 0; i < out_.of_image.size(); ++i) {
      const std::int32_t c = out_.of_image[i];
      if (c == Clusters::kNone || sizes[c] >= smallest) continue;
      for (const Covisibility::Neighbour* n = graph_.begin(i); n != graph_.end(i); ++n)
        if (const std::int32_t other = out_.of_image[n->image]; other >= 0 && other != c)
          shared[c][other] += n->weight;
    }
    for (std::int32_t c = 0; c < out_.count; ++c) {
      std::uint64_t most = 0;
      for (const auto& [other, weight] : shared[c])
        if (sizes[other] >= smallest && weight > most) most = weight, renamed[c] = other;
    }
    std::vector<std::int32_t> number(out_.count, 0);
    std::int32_t count = 0;
    for (std::int32_t c = 0; c < out_.count; ++c)
      if (renamed[c] == c) number[c] = count++;
    for (std::int32_t& c : out_.of_image)
      if (c != Clusters::kNone) c = number[renamed[c]];
    out_.count = count;
  }

  const Covisibility& graph_;
  const Columns& columns_;
  std::vector<std::uint64_t> weight_;  ///< to the cluster that grows
  std::queue<std::uint32_t> front_;
  std::uint32_t first_open_ = 0;
  Clusters out_;
};

/// The clusters that see a point.
void list_clusters(const Batches& batches, const Batches::Group& group, std::uint32_t lane,
                   const Clusters& clusters, std::vector<std::int32_t>& touched) {
  touched.clear();
  const std::uint32_t* image = &batches.image[8 * group.first_batch + lane];
  for (std::uint32_t o = 0; o < group.track; ++o) {
    const std::int32_t c = clusters.of_rows()[image[8 * o]];
    if (c == Clusters::kNone || (!touched.empty() && touched.back() == c)) continue;
    if (std::find(touched.begin(), touched.end(), c) == touched.end()) touched.push_back(c);
  }
}

}  // namespace

std::vector<std::int32_t> number_cluster_pairs(const Batches& batches, const Clusters& clusters,
                                               Threads& threads, std::size_t stride) {
  constexpr std::size_t kGroups = 256;
  std::vector<std::int32_t> number(cluster_pair(clusters.count, 0), -1);
  if (clusters.count == 0) return number;
  const auto mark = [&](std::int32_t a, std::int32_t b) {
    // Most are marked already: reading first keeps the line shared among threads.
    std::int32_t& at = number[cluster_pair(a, b)];
    if (load_shared(at) != 0) store_shared(at, 0);
  };
  const std::size_t looked_at = (batches.groups.size() + stride - 1) / stride;
  threads.for_ranges(looked_at, kGroups, [&](std::size_t first, std::size_t end) {
    poll_cancelled();
    std::vector<std::int32_t> touched;
    for (std::size_t g = first * stride; g < std::min(batches.groups.size(), end * stride);
         g += stride)
      for (std::uint32_t l = 0; l < batches.groups[g].lanes; ++l) {
        list_clusters(batches, batches.groups[g], l, clusters, touched);
        for (std::int32_t a : touched)
          for (std::int32_t b : touched)
            if (a >= b) mark(a, b);
      }
  });
  for (std::int32_t c = 0; c < clusters.count; ++c) number[cluster_pair(c, c)] = 0;
  std::int32_t next = 0;
  for (std::int32_t& n : number)
    if (n == 0) n = next++;
  return number;
}

std::uint64_t count_cluster_pairs(const std::vector<std::int32_t>& numbers) {
  return static_cast<std::uint64_t>(
      std::count_if(numbers.begin(), numbers.end(), [](std::int32_t n) { return n >= 0; }));
}

Clusters cluster_images(const Covisibility& graph, const Columns& columns,
                        std::size_t images_each) {
  return Growth(graph, columns).run(std::max<std::size_t>(1, images_each));
}

}  // namespace sheaf
