// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "io/json_reading.h"
#include "survey/constraint_files.h"

namespace sheaf {
namespace {

using Kind = JsonValue::Kind;

// What OpenSfM supposes of control points, metres.
constexpr double kSigma = 0.01, kHeightSigma = 0.1;

/// Keys that are not asked for are passed over, as OpenSfM does: its versions add some.
class Reading : JsonReading {
 public:
  explicit Reading(const std::string& name) : JsonReading(name) {
    out_.paths = {name};
    out_.frame = {WorldKind::geodetic, "WGS84", {}};
  }

  Result<Constraints> run(const JsonValue& root) {
    each(root, "points", [this](const JsonValue& v) { read_point(v); });
    if (error_) return *error_;
    return std::move(out_);
  }

 private:
  void read_point(const JsonValue& v) {
    if (v.kind != Kind::object) return refuse(v, "a point: an object");
    SurveyPoint& point = out_.points.emplace_back();
    point.line = v.line;
    point.id = name(v, "id");
    point.role = SurveyRole::tie;
    const JsonValue* position = v.find("position");
    if (position != nullptr && position->kind != Kind::null) read_position(*position, point);
    const JsonValue* observations = need(v, "observations");
    if (observations == nullptr) return;
    each(v, "observations", [&](const JsonValue& mark) { read_mark(mark, point); });
  }

  void read_position(const JsonValue& v, SurveyPoint& point) {
    if (v.kind != Kind::object)
      return refuse(v, "\"position\": an object of latitude, longitude and altitude");
    point.role = SurveyRole::control;
    point.at = {number(v, "latitude"), number(v, "longitude"), 0};
    if (!error_ && (!(std::abs(point.at[0]) <= 90) || !(std::abs(point.at[1]) <= 360)))
      refuse(v.line, "a latitude or longitude out of range", "degrees");
    const JsonValue* height = v.find("altitude");
    const bool known = height != nullptr && height->kind != Kind::null;
    if (known) point.at[2] = number(v, "altitude");
    point.sigma = {kSigma, kSigma, known ? kHeightSigma : kUnknownHeightSigma};
  }

  void read_mark(const JsonValue& v, SurveyPoint& point) {
    if (v.kind != Kind::object) return refuse(v, "an observation: an object");
    SurveyMark& mark = point.marks.emplace_back();
    mark.line = v.line;
    mark.image = text(v, "shot_id");
    mark.normalised = true;
    if (const JsonValue* at = need(v, "projection")) mark.pixel = numbers<2>(*at, "projection");
  }

  Constraints out_;
};

}  // namespace

bool is_opensfm_points(const JsonValue& root) {
  const JsonValue* points = root.kind == Kind::object ? root.find("points") : nullptr;
  if (points == nullptr || points->kind != Kind::list) return false;
  return std::any_of(points->items.begin(), points->items.end(), [](const JsonValue& point) {
    return point.kind == Kind::object && point.find("observations") != nullptr;
  });
}

Result<Constraints> parse_opensfm_points(const JsonValue& root, const std::string& name) {
  return Reading(name).run(root);
}

}  // namespace sheaf
