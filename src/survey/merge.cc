// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cctype>
#include <optional>

#include "survey/constraint_files.h"
#include "survey/file_place.h"

namespace sheaf {
namespace {

/// Of a survey without coordinates the frame says nothing.
bool has_coordinates(const Constraints& c) {
  return !c.positions.empty() ||
         std::any_of(c.points.begin(), c.points.end(),
                     [](const SurveyPoint& point) { return point.role != SurveyRole::tie; });
}

std::string text_of(const WorldFrame& frame) {
  const std::string kind = frame.kind == WorldKind::local       ? "local"
                           : frame.kind == WorldKind::projected ? "projected"
                                                                : "geodetic";
  return kind + (frame.name.empty() ? "" : " (" + frame.name + ")");
}

/// What two frames call themselves; a geodetic one is WGS84 however that is written.
bool same_name(const WorldFrame& a, const WorldFrame& b) {
  if (a.kind == WorldKind::geodetic || a.name.empty() || b.name.empty()) return true;
  return std::equal(a.name.begin(), a.name.end(), b.name.begin(), b.name.end(), [](char x, char y) {
    return std::tolower(static_cast<unsigned char>(x)) ==
           std::tolower(static_cast<unsigned char>(y));
  });
}

std::optional<Error> take_frame(const Constraints& part, const std::string& first,
                                WorldFrame& frame) {
  const WorldFrame& own = part.frame;
  const auto mixed = [&](const std::string& found, const std::string& expected) {
    return Error(ErrorCode::unreadable_input, paths_of(part) + ": found " + found + ", expected " +
                                                  expected + " as in " + first +
                                                  ": frames of the world are mixed");
  };
  if (own.kind != frame.kind || !same_name(own, frame))
    return mixed("coordinates of a frame that is " + text_of(own), "one that is " + text_of(frame));
  if (own.origin && frame.origin && own.origin != frame.origin)
    return mixed("another origin", "the same");
  if (!frame.origin) frame.origin = own.origin;
  if (frame.name.empty()) frame.name = own.name;
  return {};
}

template <class Entry>
void append(const std::vector<Entry>& from, std::uint32_t files, std::vector<Entry>& to) {
  for (const Entry& entry : from) {
    to.push_back(entry);
    to.back().file += files;
  }
}

void append(const Constraints& part, Constraints& out) {
  const auto files = static_cast<std::uint32_t>(out.paths.size());
  const std::size_t points = out.points.size();
  append(part.positions, files, out.positions);
  append(part.rotations, files, out.rotations);
  append(part.gravities, files, out.gravities);
  append(part.points, files, out.points);
  append(part.scale_bars, files, out.scale_bars);
  append(part.lenses, files, out.lenses);
  for (std::size_t i = points; i < out.points.size(); ++i)
    for (SurveyMark& mark : out.points[i].marks) mark.file += files;
  out.paths.insert(out.paths.end(), part.paths.begin(), part.paths.end());
  out.notes.insert(out.notes.end(), part.notes.begin(), part.notes.end());
}

}  // namespace

Result<Constraints> merge_constraints(std::vector<Constraints> parts) {
  if (parts.size() == 1) return std::move(parts.front());
  Constraints out;
  std::string first;  // whose frame it is
  for (const Constraints& part : parts) {
    if (has_coordinates(part) && first.empty()) {
      first = paths_of(part);
      out.frame = part.frame;
    } else if (has_coordinates(part)) {
      if (auto e = take_frame(part, first, out.frame)) return *e;
    }
    append(part, out);
  }
  if (first.empty() && !parts.empty()) out.frame = parts.front().frame;
  return out;
}

}  // namespace sheaf
