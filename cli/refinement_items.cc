// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "refinement_items.h"

#include <fmt/format.h>
#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <optional>

#include "sheaf/error.h"

namespace sheaf {
namespace {

using Part = RefinementItem::Part;

const std::map<std::string, Part, std::less<>> kParts = {
    {"points", Part::points},
    {"poses", Part::poses},
    {"pose", Part::poses},
    {"image", Part::image},
    {"intrinsics", Part::lens},
    {"camera", Part::lens},
    {"f", Part::focal},
    {"focal", Part::focal},
    {"k", Part::distortion},
    {"distortion", Part::distortion},
    {"pp", Part::principal_point},
    {"principal-point", Part::principal_point}};

const char kExpected[] =
    "points, poses, intrinsics, f (or focal), k (or distortion), pp (or principal-point), a "
    "parameter as fx or k1, each but points also as NAME=WHO, or image=WHO, pose=WHO, camera=WHO; "
    "WHO is an id, an image's name or a pattern of names";

/// Only of named ones, or only of all.
bool wrong_reach(std::string_view name, bool named) {
  if (name == "points" || name == "poses" || name == "intrinsics") return named;
  return !named && (name == "pose" || name == "image" || name == "camera");
}

bool is_parameter(std::string_view name) {
  for (std::size_t m = 0; m < kCameraModels; ++m)
    for (const std::string_view known : parameter_names(static_cast<CameraModel>(m)))
      if (name == known) return true;
  return false;
}

std::optional<RefinementItem> parse_item(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string_view name = std::string_view(text).substr(0, equals);
  RefinementItem item;
  item.text = text;
  const bool named = equals != std::string::npos;
  if (named) item.who = text.substr(equals + 1);
  if (wrong_reach(name, named) || (named && item.who.empty())) return {};
  if (const auto part = kParts.find(name); part != kParts.end()) {
    item.part = part->second;
  } else {
    if (!is_parameter(name)) return {};
    item.part = Part::parameter;
    item.parameter = name;
  }
  return item;
}

Part kind_of(std::string_view parameter) {
  if (parameter == "f" || parameter == "fx" || parameter == "fy") return Part::focal;
  return parameter == "cx" || parameter == "cy" ? Part::principal_point : Part::distortion;
}

bool parse_id(const std::string& text, std::uint32_t& id) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, id);
  return error == std::errc() && stop == end;
}

/// Index of an id; a problem without ids counts from 0.
std::optional<std::uint32_t> index_of(const std::string& who, const std::vector<std::uint32_t>& ids,
                                      std::size_t count) {
  std::uint32_t id = 0;
  if (!parse_id(who, id)) return {};
  if (ids.empty()) return id < count ? std::optional(id) : std::nullopt;
  const auto found = std::find(ids.begin(), ids.end(), id);
  if (found == ids.end()) return {};
  return static_cast<std::uint32_t>(found - ids.begin());
}

Named by_name(const std::string& who, const std::vector<std::string>& names) {
  Named out;
  for (std::uint32_t j = 0; j < names.size(); ++j)
    if (names[j] == who) out.indices.push_back(j);
  if (!out.indices.empty() || who.find_first_of("*?[") == std::string::npos) return out;
  out.pattern = true;
  for (std::uint32_t j = 0; j < names.size(); ++j)
    if (fnmatch(who.c_str(), names[j].c_str(), 0) == 0) out.indices.push_back(j);
  return out;
}

/// "1, 2, 5 and 7 more"
template <class Entries>
std::string some_of(const Entries& entries) {
  constexpr std::size_t kShown = 5;
  std::string out;
  for (std::size_t i = 0; i < std::min(entries.size(), kShown); ++i)
    out += fmt::format("{}{}", i == 0 ? "" : ", ", entries[i]);
  if (entries.size() > kShown) out += fmt::format(" and {} more", entries.size() - kShown);
  return out;
}

std::string ids_text(const std::vector<std::uint32_t>& ids, std::size_t count) {
  if (count == 0) return "there are none";
  return ids.empty() ? fmt::format("they are numbered 0 to {}", count - 1)
                     : "there are " + some_of(ids);
}

std::string names_text(const std::vector<std::string>& names) {
  return names.empty() ? std::string("the file does not name its images")
                       : "images are called " + some_of(names);
}

[[noreturn]] void refuse(const RefinementItem& item, const std::string& what) {
  throw Error(ErrorCode::usage,
              fmt::format("{} {}: {}", item.refine ? "--refine" : "--fix", item.text, what));
}

const SceneMetadata& metadata_of(const Problem& problem) {
  static const SceneMetadata kNone;
  return problem.metadata ? *problem.metadata : kNone;
}

}  // namespace

std::vector<std::string> split_items(std::string_view list) {
  std::vector<std::string> out(1);
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (list[i] == '\\' && i + 1 < list.size() && list[i + 1] == ',') {
      out.back() += list[++i];
    } else if (list[i] == ',') {
      out.emplace_back();
    } else {
      out.back() += list[i];
    }
  }
  return out;
}

std::string parse_items(const std::string& list, bool refine, std::vector<RefinementItem>& out) {
  for (const std::string& text : split_items(list)) {
    std::optional<RefinementItem> item = parse_item(text);
    if (!item)
      return fmt::format("expected a comma-separated list of {}; not '{}'", kExpected, text);
    item->refine = refine;
    out.push_back(std::move(*item));
  }
  return "";
}

std::uint16_t parameters_of(const RefinementItem& item, CameraModel model) {
  const std::vector<std::string_view> names = parameter_names(model);
  unsigned bits = 0;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const bool single = item.part == Part::parameter &&
                        // SIMPLE_RADIAL's k is the first radial coefficient.
                        (names[k] == item.parameter || (names[k] == "k" && item.parameter == "k1"));
    const bool whole = item.part == Part::lens || item.part == Part::image;
    if (single || whole || item.part == kind_of(names[k])) bits |= 1u << k;
  }
  return static_cast<std::uint16_t>(bits);
}

Named images_named(const RefinementItem& item, const Problem& problem) {
  const SceneMetadata& metadata = metadata_of(problem);
  Named named = by_name(item.who, metadata.image_names);
  if (!named.indices.empty()) return named;
  if (const auto index = index_of(item.who, metadata.image_ids, problem.num_images()))
    return {{*index}, false};
  std::uint32_t ignored = 0;
  if (parse_id(item.who, ignored) || metadata.image_names.empty())
    refuse(item, fmt::format("no image has the id or name {}; of ids, {}; {}", item.who,
                             ids_text(metadata.image_ids, problem.num_images()),
                             names_text(metadata.image_names)));
  refuse(item,
         fmt::format("no image is called {}; {}", item.who, names_text(metadata.image_names)));
}

Named lenses_named(const RefinementItem& item, const Problem& problem) {
  const SceneMetadata& metadata = metadata_of(problem);
  if (const auto index = index_of(item.who, metadata.camera_ids, problem.cameras.size()))
    return {{*index}, false};
  Named named = by_name(item.who, metadata.image_names);
  if (named.indices.empty())
    refuse(item, fmt::format("no camera has the id {0}, and no image is called {0}; of cameras, "
                             "{1}; {2}",
                             item.who, ids_text(metadata.camera_ids, problem.cameras.size()),
                             names_text(metadata.image_names)));
  for (std::uint32_t& index : named.indices) index = problem.image_camera[index];
  std::sort(named.indices.begin(), named.indices.end());
  named.indices.erase(std::unique(named.indices.begin(), named.indices.end()), named.indices.end());
  return named;
}

}  // namespace sheaf
