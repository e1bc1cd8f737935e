// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <metis.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <utility>

#include "pieces/split_scene.h"

namespace sheaf {
namespace {

/// An image of a long track is paired with so many of those that follow in it: enough to hold the
/// track together, and no quadratic number of edges.
constexpr std::size_t kPairs = 12;

/// The images that see each point, one after the other.
struct Tracks {
  std::vector<std::uint64_t> first;
  std::vector<std::uint32_t> image;
};

Tracks tracks_of(const Problem& problem) {
  Tracks out;
  out.first.assign(problem.num_points() + 1, 0);
  for (const std::uint32_t p : problem.observation_point) ++out.first[p + 1];
  std::partial_sum(out.first.begin(), out.first.end(), out.first.begin());
  out.image.resize(problem.num_observations());
  std::vector<std::uint64_t> next(out.first.begin(), out.first.end() - 1);
  for (std::size_t i = 0; i < out.image.size(); ++i)
    out.image[next[problem.observation_point[i]]++] = problem.observation_image[i];
  return out;
}

/// The camera graph in METIS's form: neighbours of each image with the points they share.
struct CameraGraph {
  std::vector<idx_t> first, neighbour, shared, weight;
};

/// Neighbours are counted image by image, from the points that each sees, so that no list of all
/// pairs of all tracks is ever held.
CameraGraph graph_of(const Problem& problem) {
  const std::size_t images = problem.num_images();
  const Tracks tracks = tracks_of(problem);
  std::vector<std::uint64_t> seen_first(images + 1, 0);
  for (const std::uint32_t i : problem.observation_image) ++seen_first[i + 1];
  std::partial_sum(seen_first.begin(), seen_first.end(), seen_first.begin());
  // Where each image stands in each of its tracks.
  std::vector<std::uint64_t> place(problem.num_observations());
  std::vector<std::uint64_t> next(seen_first.begin(), seen_first.end() - 1);
  std::vector<std::uint32_t> track_of(problem.num_observations());
  for (std::uint32_t p = 0; p < problem.num_points(); ++p)
    for (std::uint64_t k = tracks.first[p]; k < tracks.first[p + 1]; ++k) {
      const std::uint64_t at = next[tracks.image[k]]++;
      place[at] = k;
      track_of[at] = p;
    }
  CameraGraph out;
  out.first.push_back(0);
  std::vector<idx_t> count(images, 0);
  std::vector<std::uint32_t> touched;
  for (std::uint32_t i = 0; i < images; ++i) {
    for (std::uint64_t s = seen_first[i]; s < seen_first[i + 1]; ++s) {
      const std::uint64_t begin = tracks.first[track_of[s]], end = tracks.first[track_of[s] + 1];
      const std::uint64_t from = place[s] - begin > kPairs ? place[s] - kPairs : begin;
      for (std::uint64_t k = from; k < std::min(end, place[s] + kPairs + 1); ++k) {
        const std::uint32_t other = tracks.image[k];
        if (other == i) continue;
        if (count[other]++ == 0) touched.push_back(other);
      }
    }
    std::sort(touched.begin(), touched.end());
    for (const std::uint32_t other : touched) {
      out.neighbour.push_back(static_cast<idx_t>(other));
      out.shared.push_back(std::exchange(count[other], 0));
    }
    touched.clear();
    out.first.push_back(static_cast<idx_t>(out.neighbour.size()));
    out.weight.push_back(std::max<idx_t>(1, static_cast<idx_t>(seen_first[i + 1] - seen_first[i])));
  }
  return out;
}

}  // namespace

Result<std::vector<std::uint32_t>> partition_images(const Problem& problem, std::uint32_t pieces) {
  const std::size_t images = problem.num_images();
  if (pieces < 1 || pieces > images)
    return Error(ErrorCode::usage, "found " + std::to_string(pieces) + " pieces, expected 1 to " +
                                       std::to_string(images) + ", the number of images");
  if (pieces == 1) return std::vector<std::uint32_t>(images, 0);
  CameraGraph graph = graph_of(problem);
  idx_t vertices = static_cast<idx_t>(images), constraints = 1, parts = static_cast<idx_t>(pieces),
        cut = 0;
  std::vector<idx_t> options(METIS_NOPTIONS), part(images, 0);
  METIS_SetDefaultOptions(options.data());
  options[METIS_OPTION_SEED] = 1;
  options[METIS_OPTION_UFACTOR] = 30;  // 3 % more than the mean at most
  if (METIS_PartGraphKway(&vertices, &constraints, graph.first.data(), graph.neighbour.data(),
                          graph.weight.data(), nullptr, graph.shared.data(), &parts, nullptr,
                          nullptr, options.data(), &cut, part.data()) != METIS_OK)
    return Error(ErrorCode::memory_limit, "the camera graph could not be partitioned");
  // A piece that METIS leaves empty takes an image of the largest one.
  std::vector<std::size_t> sizes(pieces, 0);
  for (const idx_t p : part) ++sizes[static_cast<std::size_t>(p)];
  for (std::uint32_t p = 0; p < pieces; ++p) {
    if (sizes[p] > 0) continue;
    const auto most = std::max_element(sizes.begin(), sizes.end()) - sizes.begin();
    *std::find(part.begin(), part.end(), static_cast<idx_t>(most)) = static_cast<idx_t>(p);
    --sizes[static_cast<std::size_t>(most)];
    ++sizes[p];
  }
  return std::vector<std::uint32_t>(part.begin(), part.end());
}

}  // namespace sheaf
