// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "matching_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace sheaf {
namespace {

constexpr std::size_t kMostListed = 10, kMostSaid = 3;

std::vector<std::string> first_names(const Problem& problem, const std::vector<std::size_t>& images,
                                     Matching::By by, std::size_t most) {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < std::min(images.size(), most); ++k)
    out.push_back(called(problem, images[k], by));
  return out;
}

const char* word(Matching::By by) {
  switch (by) {
    case Matching::By::names:
      return "names";
    case Matching::By::ids:
      return "ids";
    case Matching::By::order:
      return "order";
  }
  return "";
}

std::string others_text(const Problem& problem, const std::vector<std::size_t>& images,
                        Matching::By by, const std::string& whose) {
  if (images.empty()) return {};
  const auto names = first_names(problem, images, by, kMostSaid);
  return fmt::format("left out    {} image{} that only the {} has: {}{}\n", images.size(),
                     images.size() == 1 ? "" : "s", whose, fmt::join(names, ", "),
                     names.size() < images.size() ? ", ..." : "");
}

}  // namespace

Json matching_json(const Matching& matching, const Problem& estimate, const Problem& reference,
                   const std::string& first, const std::string& second) {
  const auto list = [&](const Problem& problem, const std::vector<std::size_t>& images) {
    return Json{{"count", images.size()},
                {"first", first_names(problem, images, matching.by, kMostListed)}};
  };
  return {{"by", word(matching.by)},
          {"images", matching.images.size()},
          {"points", matching.has_points ? Json(matching.points.size()) : Json()},
          {"images_only_in_" + first, list(estimate, matching.only_in_estimate)},
          {"images_only_in_" + second, list(reference, matching.only_in_reference)},
          {"points_only_in_" + first, matching.points_only_in_estimate},
          {"points_only_in_" + second, matching.points_only_in_reference}};
}

std::string matching_text(const Matching& matching, const Problem& estimate,
                          const Problem& reference, const std::string& first,
                          const std::string& second) {
  if (matching.complete()) return {};
  std::string out = fmt::format(
      "common      {} of the {} images of the {} and the {} of the {}, told by their {}; ",
      matching.images.size(), estimate.num_images(), first, reference.num_images(), second,
      word(matching.by));
  out += matching.has_points ? fmt::format("{} of {} and {} points\n", matching.points.size(),
                                           estimate.num_points(), reference.num_points())
                             : "which points are the same is not known\n";
  out += others_text(estimate, matching.only_in_estimate, matching.by, first);
  out += others_text(reference, matching.only_in_reference, matching.by, second);
  return out;
}

}  // namespace sheaf
