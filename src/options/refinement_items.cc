// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/refinement_items.h"

#include <fnmatch.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>
#include <optional>
#include <set>
#include <utility>

#include "options/words.h"
#include "platform/unicode.h"
#include "scene/rigs.h"

namespace sheaf {
namespace {

using Part = RefinementItem::Part;

// A plain array, so that nothing is allocated before main.
constexpr std::pair<std::string_view, Part> kParts[] = {
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
    {"principal-point", Part::principal_point},
    {"sensor_from_rig", Part::sensor},
};

const char kExpected[] =
    "points, poses, intrinsics, f (or focal), k (or distortion), pp (or principal-point), a "
    "parameter as fx or k1, sensor_from_rig (of rigs), each but points also as NAME=WHO, or "
    "image=WHO, pose=WHO, camera=WHO; "
    "WHO is an id, an image's name or a pattern of names";

/// Only of named ones, or only of all.
bool wrong_reach(std::string_view name, bool named) {
  if (name == "points" || name == "poses" || name == "intrinsics") return named;
  return !named && (name == "pose" || name == "image" || name == "camera");
}

bool is_parameter(std::string_view name) {
  for (std::size_t m = 0; m < kCameraModels; ++m) {
    const auto model = static_cast<CameraModel>(m);
    for (const std::string_view known : parameter_names(model))
      if (name == known && image_size(model) == 0) return true;
  }
  return false;
}

std::optional<RefinementItem> read_item(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string_view name = std::string_view(text).substr(0, equals);
  RefinementItem item;
  item.text = text;
  const bool named = equals != std::string::npos;
  if (named) item.who = text.substr(equals + 1);
  if (wrong_reach(name, named) || (named && item.who.empty())) return {};
  const auto part = std::find_if(std::begin(kParts), std::end(kParts),
                                 [&](const auto& known) { return known.first == name; });
  if (part != std::end(kParts)) {
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

Named by_name(const std::string& stated, const std::vector<std::string>& stated_names) {
  Named out;
  const std::string who = comparable_name(stated);
  std::vector<std::string> names;
  for (const std::string& name : stated_names) names.push_back(comparable_name(name));
  for (std::uint32_t j = 0; j < names.size(); ++j)
    if (names[j] == who) out.indices.push_back(j);
  if (!out.indices.empty() || who.find_first_of("*?[") == std::string::npos) return out;
  out.pattern = true;
  for (std::uint32_t j = 0; j < names.size(); ++j)
    if (fnmatch(who.c_str(), names[j].c_str(), 0) == 0) out.indices.push_back(j);
  return out;
}

/// "1, 2, 5 and 7 more"
std::string some_of(std::vector<std::string> words) {
  constexpr std::size_t kShown = 5;
  const std::size_t more = words.size() - std::min(words.size(), kShown);
  words.resize(words.size() - more);
  return listed(words) + (more > 0 ? " and " + std::to_string(more) + " more" : "");
}

std::string ids_text(const std::vector<std::uint32_t>& ids, std::size_t count) {
  if (count == 0) return "there are none";
  if (ids.empty()) return "they are numbered 0 to " + std::to_string(count - 1);
  std::vector<std::string> words;
  for (const std::uint32_t id : ids) words.push_back(std::to_string(id));
  return "there are " + some_of(std::move(words));
}

std::string names_text(const std::vector<std::string>& names) {
  return names.empty() ? std::string("the file does not name its images")
                       : "images are called " + some_of(names);
}

const SceneMetadata& metadata_of(const Problem& problem) {
  static const SceneMetadata kNone;
  return problem.metadata ? *problem.metadata : kNone;
}

}  // namespace

Result<RefinementItem> parse_item(const std::string& text, bool refine) {
  std::optional<RefinementItem> item = read_item(text);
  if (!item)
    return Error(ErrorCode::usage, std::string("expected a comma-separated list of ") + kExpected +
                                       "; not '" + text + "'");
  item->refine = refine;
  return *item;
}

Error refusal_of(const RefinementItem& item, const std::string& what) {
  return {ErrorCode::usage, (item.refine ? "--refine " : "--fix ") + item.text + ": " + what};
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
  return static_cast<std::uint16_t>(bits & ~unsigned{image_size(model)});
}

Result<Named> images_named(const RefinementItem& item, const Problem& problem) {
  const SceneMetadata& metadata = metadata_of(problem);
  Named named = by_name(item.who, metadata.image_names);
  if (!named.indices.empty()) return named;
  if (const auto index = index_of(item.who, metadata.image_ids, problem.num_images()))
    return Named{{*index}, false};
  std::uint32_t ignored = 0;
  if (parse_id(item.who, ignored) || metadata.image_names.empty())
    return refusal_of(item, "no image has the id or name " + item.who + "; of ids, " +
                                ids_text(metadata.image_ids, problem.num_images()) + "; " +
                                names_text(metadata.image_names));
  return refusal_of(item,
                    "no image is called " + item.who + "; " + names_text(metadata.image_names));
}

Result<Named> lenses_named(const RefinementItem& item, const Problem& problem) {
  const SceneMetadata& metadata = metadata_of(problem);
  if (const auto index = index_of(item.who, metadata.camera_ids, problem.cameras.size()))
    return Named{{*index}, false};
  Named named = by_name(item.who, metadata.image_names);
  if (named.indices.empty())
    return refusal_of(item, "no camera has the id " + item.who + ", and no image is called " +
                                item.who + "; of cameras, " +
                                ids_text(metadata.camera_ids, problem.cameras.size()) + "; " +
                                names_text(metadata.image_names));
  for (std::uint32_t& index : named.indices) index = problem.image_camera[index];
  std::sort(named.indices.begin(), named.indices.end());
  named.indices.erase(std::unique(named.indices.begin(), named.indices.end()), named.indices.end());
  return named;
}

Result<Named> sensors_named(const RefinementItem& item, const Problem& problem) {
  const SceneMetadata& metadata = metadata_of(problem);
  const Rigs& rigs = problem.rigs;
  if (rigs.num_sensors() == 0) return refusal_of(item, "there are no rigs");
  std::set<std::uint32_t> sensors;
  std::uint32_t id = 0;
  const bool is_id = parse_id(item.who, id);
  if (metadata.sensor_ids.empty()) {
    if (is_id && id < rigs.num_sensors()) sensors.insert(id);
  } else if (is_id) {
    for (std::uint32_t s = 0; s < metadata.sensor_ids.size(); ++s)
      if (metadata.sensor_ids[s] == id) sensors.insert(s);
  }
  Named named;
  if (sensors.empty()) {
    named = by_name(item.who, metadata.image_names);
    for (const std::uint32_t j : named.indices)
      if (in_rig(rigs, j)) sensors.insert(rigs.image_sensor[j]);
  }
  if (sensors.empty())
    return refusal_of(item, "no sensor of a rig has the id " + item.who +
                                ", and no image of a rig is called " + item.who + "; of sensors, " +
                                ids_text(metadata.sensor_ids, rigs.num_sensors()) + "; " +
                                names_text(metadata.image_names));
  std::erase_if(sensors, [&](std::uint32_t s) { return rigs.is_reference[s] != 0; });
  if (sensors.empty()) return refusal_of(item, "it is the reference of its rig, which never moves");
  return Named{{sensors.begin(), sensors.end()}, named.pattern};
}

}  // namespace sheaf
