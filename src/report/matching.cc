// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/matching.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <type_traits>
#include <unordered_map>

#include "platform/unicode.h"

namespace sheaf {
namespace {

using Pair = Matching::Pair;
constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// A list of the metadata, or null where it is not known for every entry.
template <class List>
const List* known(const Problem& problem, List SceneMetadata::*member, std::size_t count) {
  if (problem.metadata == nullptr) return nullptr;
  const List& list = (*problem.metadata).*member;
  return list.size() == count ? &list : nullptr;
}

std::vector<Pair> by_order(std::size_t count) {
  std::vector<Pair> out(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = {i, i};
  return out;
}

template <class Name>
std::vector<Pair> by_name(const std::vector<Name>& estimate, const std::vector<Name>& reference) {
  if (estimate == reference) return by_order(reference.size());
  std::unordered_map<Name, std::size_t> place;
  for (std::size_t i = 0; i < estimate.size(); ++i) place[estimate[i]] = i;
  std::vector<Pair> out;
  for (std::size_t i = 0; i < reference.size(); ++i)
    if (const auto found = place.find(reference[i]); found != place.end())
      out.push_back({found->second, i});
  return out;
}

/// The first entry that occurs a second time.
template <class Name>
std::optional<std::size_t> repeated(const std::vector<Name>& names) {
  std::unordered_map<Name, std::size_t> place;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (!place.emplace(names[i], i).second) return i;
  return {};
}

template <class Name>
Result<void> match_images(const std::vector<Name>& estimate, const std::vector<Name>& reference,
                          const char* kind, Matching& out) {
  if (estimate != reference)
    for (const auto* names : {&estimate, &reference})
      if (const auto twice = repeated(*names)) {
        std::string name;
        if constexpr (std::is_same_v<Name, std::string>)
          name = (*names)[*twice];
        else
          name = std::to_string((*names)[*twice]);
        return Error(ErrorCode::usage,
                     std::string(names == &estimate ? "the estimate" : "the reference") +
                         " has two images of the " + kind + " " + name +
                         ": it does not tell which one is meant");
      }
  out.images = by_name(estimate, reference);
  return {};
}

Error other_counts(const Problem& estimate, const Problem& reference) {
  return Error(ErrorCode::usage,
               "the estimate has " + std::to_string(estimate.num_images()) + " images and " +
                   std::to_string(estimate.num_points()) + " points, the reference " +
                   std::to_string(reference.num_images()) + " and " +
                   std::to_string(reference.num_points()) +
                   ", and not both state names that would tell which are the same");
}

/// A feature of an image of the reference: its number there, or where no numbers are known the
/// bits of its pixel.
using Feature = std::array<std::uint64_t, 3>;

/// Of each point the features of common images that observe it, sorted. `images` is, for each image
/// of the problem, the reference's, or kNone.
std::vector<std::vector<Feature>> features_of(const Problem& problem,
                                              const std::vector<std::size_t>& images,
                                              bool numbered) {
  std::vector<std::vector<Feature>> out(problem.num_points());
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::size_t image = images[problem.observation_image[i]];
    if (image == kNone) continue;
    Feature feature{image, 0, 0};
    if (numbered) {
      feature[1] = problem.metadata->observation_feature[i];
    } else {
      feature[1] = std::bit_cast<std::uint64_t>(problem.observation_xy[2 * i]);
      feature[2] = std::bit_cast<std::uint64_t>(problem.observation_xy[2 * i + 1]);
    }
    out[problem.observation_point[i]].push_back(feature);
  }
  for (auto& features : out) std::sort(features.begin(), features.end());
  return out;
}

std::vector<Pair> with_the_same_features(const Problem& estimate, const Problem& reference,
                                         const std::vector<Pair>& images,
                                         const std::vector<Pair>& points) {
  const auto numbered = [](const Problem& problem) {
    return known(problem, &SceneMetadata::observation_feature, problem.num_observations());
  };
  const bool numbers = numbered(estimate) != nullptr && numbered(reference) != nullptr;
  std::vector<std::size_t> of_estimate(estimate.num_images(), kNone);
  std::vector<std::size_t> of_reference(reference.num_images(), kNone);
  for (const Pair& pair : images) {
    of_estimate[pair.estimate] = pair.reference;
    of_reference[pair.reference] = pair.reference;
  }
  const auto have = features_of(estimate, of_estimate, numbers);
  const auto want = features_of(reference, of_reference, numbers);
  std::vector<Pair> out;
  for (const Pair& pair : points)
    if (!want[pair.reference].empty() && have[pair.estimate] == want[pair.reference])
      out.push_back(pair);
  return out;
}

void match_points(const Problem& estimate, const Problem& reference, Matching& out) {
  const std::size_t n = reference.num_points();
  const auto* have = known(estimate, &SceneMetadata::point_ids, estimate.num_points());
  const auto* want = known(reference, &SceneMetadata::point_ids, n);
  const bool ids = have != nullptr && want != nullptr;
  const bool alike =
      out.only_in_estimate.empty() && out.only_in_reference.empty() && estimate.num_points() == n;
  if (alike) {
    out.points = ids ? by_name(*have, *want) : by_order(n);
    if (out.points.size() == n) return;
  }
  if (ids)
    out.points = with_the_same_features(estimate, reference, out.images, by_name(*have, *want));
  out.has_points = !out.points.empty();
}

/// Fills in what is not in common.
void list_the_others(const Problem& estimate, const Problem& reference, Matching& out) {
  std::vector<char> in_estimate(estimate.num_images(), 0);
  std::vector<char> in_reference(reference.num_images(), 0);
  for (const Pair& pair : out.images) in_estimate[pair.estimate] = in_reference[pair.reference] = 1;
  for (std::size_t j = 0; j < in_estimate.size(); ++j)
    if (in_estimate[j] == 0) out.only_in_estimate.push_back(j);
  for (std::size_t j = 0; j < in_reference.size(); ++j)
    if (in_reference[j] == 0) out.only_in_reference.push_back(j);
}

Problem part_of(const Problem& problem, const Matching& matching, std::size_t Pair::*side) {
  Problem out;
  out.cameras = problem.cameras;
  for (const Pair& pair : matching.images)
    out.add_image(problem.poses[pair.*side], problem.image_camera[pair.*side]);
  out.rigs = problem.rigs;
  if (!out.rigs.empty()) {
    out.rigs.image_frame.resize(matching.images.size());
    out.rigs.image_sensor.resize(matching.images.size());
    for (std::size_t k = 0; k < matching.images.size(); ++k) {
      out.rigs.image_frame[k] = problem.rigs.image_frame[matching.images[k].*side];
      out.rigs.image_sensor[k] = problem.rigs.image_sensor[matching.images[k].*side];
    }
  }
  for (const Pair& pair : matching.points) {
    const double* X = &problem.points[3 * (pair.*side)];
    out.add_point(X[0], X[1], X[2]);
  }
  return out;
}

std::vector<std::string> comparable(const std::vector<std::string>& names) {
  std::vector<std::string> out;
  for (const std::string& name : names) out.push_back(comparable_name(name));
  return out;
}

bool same_index(const std::vector<Pair>& pairs) {
  return std::all_of(pairs.begin(), pairs.end(),
                     [](const Pair& pair) { return pair.estimate == pair.reference; });
}

}  // namespace

Result<Matching> match_models(const Problem& estimate, const Problem& reference) {
  const std::size_t m = estimate.num_images(), n = reference.num_images();
  const auto* names = known(estimate, &SceneMetadata::image_names, m);
  const auto* their_names = known(reference, &SceneMetadata::image_names, n);
  const auto* ids = known(estimate, &SceneMetadata::image_ids, m);
  const auto* their_ids = known(reference, &SceneMetadata::image_ids, n);
  Matching out;
  Result<void> matched;
  if (names != nullptr && their_names != nullptr) {
    out.by = Matching::By::names;
    matched = match_images(comparable(*names), comparable(*their_names), "name", out);
  } else if (names == nullptr && their_names == nullptr && ids != nullptr && their_ids != nullptr) {
    out.by = Matching::By::ids;
    matched = match_images(*ids, *their_ids, "id", out);
  } else {
    if (m != n || estimate.num_points() != reference.num_points())
      return other_counts(estimate, reference);
    out.images = by_order(n);
  }
  if (!matched.ok()) return matched.error();
  list_the_others(estimate, reference, out);
  if (out.images.size() < 3 && !(out.only_in_estimate.empty() && out.only_in_reference.empty()))
    return Error(ErrorCode::usage, "the two models have " + std::to_string(out.images.size()) +
                                       " images in common, told by their " +
                                       (out.by == Matching::By::names ? "names" : "ids") +
                                       "; it takes three to compare them");
  match_points(estimate, reference, out);
  out.points_only_in_estimate = estimate.num_points() - out.points.size();
  out.points_only_in_reference = reference.num_points() - out.points.size();
  out.in_order = out.complete() && same_index(out.images) && same_index(out.points);
  return out;
}

std::string called(const Problem& problem, std::size_t image, Matching::By by) {
  if (by == Matching::By::names) return problem.metadata->image_names[image];
  return std::to_string(by == Matching::By::ids ? problem.metadata->image_ids[image] : image);
}

Problem common_of_estimate(const Problem& estimate, const Matching& matching) {
  return part_of(estimate, matching, &Pair::estimate);
}

Problem common_of_reference(const Problem& reference, const Matching& matching) {
  return part_of(reference, matching, &Pair::reference);
}

}  // namespace sheaf
