// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <map>

#include "io/line_cursor.h"
#include "survey/constraint_files.h"
#include "survey/file_place.h"

namespace sheaf {
namespace {

template <class Entry>
Error refuse(const Constraints& c, const Entry& entry, const std::string& words) {
  return Error(ErrorCode::unreadable_input, place_of(c, entry) + ": " + words);
}

Result<void> check_positions(const Constraints& c) {
  std::map<std::string, const ImagePosition*> seen;
  for (const ImagePosition& p : c.positions)
    if (const auto [at, is_new] = seen.try_emplace(p.image, &p); !is_new)
      return refuse(c, p,
                    "found a second position of image " + sheaf::quoted(p.image) +
                        ", expected one (" + place_beside(c, *at->second, p) + ")");
  return {};
}

Result<void> check_marks(const Constraints& c, const SurveyPoint& point) {
  std::map<std::string, const SurveyMark*> seen;
  for (const SurveyMark& mark : point.marks)
    if (const auto [at, is_new] = seen.try_emplace(mark.image, &mark); !is_new)
      return refuse(c, mark,
                    "found a second mark of point " + sheaf::quoted(point.id) + " in image " +
                        sheaf::quoted(mark.image) + ", expected one (" +
                        place_beside(c, *at->second, mark) + ")");
  return {};
}

Result<void> check_points(const Constraints& c) {
  std::map<std::string, const SurveyPoint*> points;
  for (const SurveyPoint& point : c.points) {
    if (const auto [at, is_new] = points.try_emplace(point.id, &point); !is_new)
      return refuse(c, point,
                    "found the id " + sheaf::quoted(point.id) +
                        " a second time, expected ids of their own (" +
                        place_beside(c, *at->second, point) + ")");
    if (Result<void> good = check_marks(c, point); !good.ok()) return good;
  }
  for (const ScaleBar& bar : c.scale_bars) {
    for (const std::string& id : {bar.first, bar.second})
      if (!points.contains(id))
        return refuse(c, bar,
                      "found a scale bar at point " + sheaf::quoted(id) +
                          ", expected the id of one of the points");
    if (bar.first == bar.second)
      return refuse(c, bar,
                    "found a scale bar from point " + sheaf::quoted(bar.first) +
                        " to itself, expected two points");
  }
  return {};
}

}  // namespace

Result<void> check_constraints(const Constraints& c) {
  if (Result<void> good = check_positions(c); !good.ok()) return good;
  return check_points(c);
}

}  // namespace sheaf
