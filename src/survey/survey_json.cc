// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/rotation.h"
#include "io/json_reading.h"
#include "options/loss_option.h"
#include "scene/terms.h"
#include "survey/constraint_files.h"

namespace sheaf {
namespace {

using Kind = JsonValue::Kind;

constexpr double kRadians = std::numbers::pi / 180;

class Reading : JsonReading {
 public:
  explicit Reading(const std::string& name) : JsonReading(name) { out_.paths = {name}; }

  Result<Constraints> run(const JsonValue& root) {
    if (root.kind != Kind::object) return refuse(root, "an object: a survey"), *error_;
    known(root, "a survey",
          {"frame", "position_loss", "positions", "rotations", "gravity", "points", "scale_bars",
           "lenses"});
    if (const JsonValue* frame = root.find("frame")) read_frame(*frame);
    position_loss_ = loss(root, "position_loss", {});
    each(root, "positions", [this](const JsonValue& v) { read_position(v); });
    each(root, "rotations", [this](const JsonValue& v) { read_rotation(v); });
    each(root, "gravity", [this](const JsonValue& v) { read_gravity(v); });
    each(root, "points", [this](const JsonValue& v) { read_point(v); });
    each(root, "scale_bars", [this](const JsonValue& v) { read_scale_bar(v); });
    each(root, "lenses", [this](const JsonValue& v) { read_lens(v); });
    if (error_) return *error_;
    return std::move(out_);
  }

 private:
  /// One number for all axes, or one for each.
  std::array<double, 3> sigmas(const JsonValue& object, const std::string& key) {
    const JsonValue* value = need(object, key);
    if (value == nullptr) return {1, 1, 1};
    if (value->kind == Kind::number) {
      const double s = above_zero(object, key);
      return {s, s, s};
    }
    const auto out = numbers<3>(*value, key);
    for (std::size_t k = 0; k < 3 && !error_; ++k)
      if (!(out[k] > 0)) refuse(value->items[k], "\"" + key + "\" above 0");
    return out;
  }
  Covariance3 covariance(const JsonValue& object, const std::string& sigma, double unit) {
    if (const JsonValue* full = object.find("covariance")) {
      if (object.find(sigma) != nullptr)
        refuse(full->line, "\"" + sigma + "\" and \"covariance\"", "one of them");
      const auto C = numbers<9>(*full, "covariance");
      if (!error_ && !whitening(C))
        refuse(full->line, "a covariance that is not",
               "one that is symmetric and positive definite");
      return C;
    }
    const auto s = sigmas(object, sigma);
    Covariance3 C{};
    for (std::size_t k = 0; k < 3; ++k) C[4 * k] = unit * unit * s[k] * s[k];
    return C;
  }
  TermLoss loss(const JsonValue& object, const std::string& key, const TermLoss& otherwise) {
    const JsonValue* value = object.find(key);
    if (value == nullptr) return otherwise;
    const LossForm form{.unit = "sigmas", .automatic = false};
    const Result<Loss> parsed = parse_loss(form, value->kind == Kind::text ? value->text : "");
    if (parsed.ok()) return {parsed.value().kind, std::max(parsed.value().scale_px, 0.0)};
    refuse(*value, "\"" + key + "\": none or NAME:SCALE in sigmas, such as \"cauchy:3\"");
    return otherwise;
  }

  /// "xyz" in a Cartesian frame, "lat_lon_height" in a geodetic one.
  std::array<double, 3> coordinates(const JsonValue& object, const std::string& what) {
    const bool geodetic = out_.frame.kind == WorldKind::geodetic;
    const std::string own = geodetic ? "lat_lon_height" : "xyz";
    const std::string other = geodetic ? "xyz" : "lat_lon_height";
    if (const JsonValue* wrong = object.find(other)) {
      refuse(wrong->line, "\"" + other + "\" of " + what,
             "\"" + own + "\": coordinates of all are in the one frame that the survey states");
      return {};
    }
    const JsonValue* value = need(object, own);
    if (value == nullptr) return {};
    const auto at = numbers<3>(*value, own);
    if (geodetic) check_place(at, value->line);
    return at;
  }
  void check_place(const std::array<double, 3>& at, std::uint64_t line) {
    if (!(std::abs(at[0]) <= 90) || !(std::abs(at[1]) <= 360))
      refuse(line, "a latitude or longitude out of range",
             "degrees: -90 to 90, then -360 to 360, then the height in metres");
  }

  void read_frame(const JsonValue& frame) {
    if (!known(frame, "a frame", {"kind", "name", "origin"})) return;
    const std::string kind = text(frame, "kind");
    if (kind == "projected") {
      out_.frame.kind = WorldKind::projected;
    } else if (kind == "geodetic") {
      out_.frame.kind = WorldKind::geodetic;
    } else if (kind != "local" && !error_) {
      return refuse(*frame.find("kind"), "\"local\", \"projected\" or \"geodetic\"");
    }
    if (frame.find("name") != nullptr) out_.frame.name = text(frame, "name");
    const JsonValue* origin = frame.find("origin");
    if (origin == nullptr) return;
    if (out_.frame.kind == WorldKind::local)
      return refuse(origin->line, "an origin of a local frame", "none: it is 0");
    out_.frame.origin = numbers<3>(*origin, "origin");
    if (out_.frame.kind == WorldKind::geodetic) check_place(*out_.frame.origin, origin->line);
  }

  void read_position(const JsonValue& v) {
    if (!known(v, "a position",
               {"image", "xyz", "lat_lon_height", "sigma", "covariance", "lever_arm", "loss"}))
      return;
    ImagePosition& p = out_.positions.emplace_back();
    p.line = v.line;
    p.image = name(v, "image");
    p.at = coordinates(v, "a position");
    p.covariance = covariance(v, "sigma", 1);
    if (const JsonValue* lever = v.find("lever_arm")) p.lever_arm = numbers<3>(*lever, "lever_arm");
    p.loss = loss(v, "loss", position_loss_);
  }
  void read_rotation(const JsonValue& v) {
    if (!known(v, "a rotation", {"image", "rotation", "sigma_deg", "loss"})) return;
    ImageRotation& r = out_.rotations.emplace_back();
    r.line = v.line;
    r.image = name(v, "image");
    if (const JsonValue* rotation = need(v, "rotation")) {
      r.rotation = numbers<4>(*rotation, "rotation");
      double norm2 = 0;
      for (const double q : r.rotation) norm2 += q * q;
      if (!error_ && !(norm2 > 1e-12))
        refuse(rotation->line, "a quaternion of no direction", "a rotation w, x, y, z");
      r.rotation = normalized(r.rotation);
    }
    r.covariance = covariance(v, "sigma_deg", kRadians);
    r.loss = loss(v, "loss", {});
  }
  void read_gravity(const JsonValue& v) {
    if (!known(v, "a direction of gravity", {"image", "down", "sigma_deg", "loss"})) return;
    ImageGravity& g = out_.gravities.emplace_back();
    g.line = v.line;
    g.image = name(v, "image");
    if (const JsonValue* down = need(v, "down")) {
      g.down = numbers<3>(*down, "down");
      const double norm = std::hypot(g.down[0], g.down[1], g.down[2]);
      if (!error_ && !(norm > 0)) refuse(down->line, "a vector of length 0", "a direction");
      for (double& x : g.down) x /= norm;
    }
    g.sigma_rad = kRadians * above_zero(v, "sigma_deg");
    g.loss = loss(v, "loss", {});
  }
  void read_point(const JsonValue& v) {
    if (!known(v, "a point",
               {"id", "role", "xyz", "lat_lon_height", "sigma", "model_point", "marks"}))
      return;
    SurveyPoint& p = out_.points.emplace_back();
    p.line = v.line;
    p.id = name(v, "id");
    const std::string role = v.find("role") == nullptr ? "control" : text(v, "role");
    if (role == "check") {
      p.role = SurveyRole::check;
    } else if (role == "tie") {
      p.role = SurveyRole::tie;
    } else if (role != "control" && !error_) {
      refuse(*v.find("role"), "\"control\", \"check\" or \"tie\"");
    }
    if (p.role != SurveyRole::tie) {
      p.at = coordinates(v, "a point");
      p.sigma = sigmas(v, "sigma");
    }
    read_model_point(v, p);
    if (const JsonValue* marks = v.find("marks")) {
      if (marks->kind != Kind::list) return refuse(*marks, "\"marks\": a list");
      for (const JsonValue& mark : marks->items) read_mark(mark, p);
    }
  }
  void read_model_point(const JsonValue& v, SurveyPoint& p) {
    if (v.find("model_point") == nullptr) {
      if (v.find("marks") == nullptr) need(v, "marks");
      return;
    }
    const double id = number(v, "model_point");
    if (!error_ && (id < 0 || id != std::floor(id) || id > 9e15))
      refuse(*v.find("model_point"), "the id of a point of the model");
    if (v.find("marks") != nullptr)
      refuse(v.find("marks")->line, "\"marks\" beside \"model_point\"",
             "one of them: a point of the model has its observations");
    if (!error_) p.model_point = static_cast<std::uint64_t>(id);
  }
  void read_mark(const JsonValue& v, SurveyPoint& p) {
    if (!known(v, "a mark", {"image", "pixel", "sigma_px"})) return;
    SurveyMark& mark = p.marks.emplace_back();
    mark.line = v.line;
    mark.image = name(v, "image");
    if (const JsonValue* pixel = need(v, "pixel")) mark.pixel = numbers<2>(*pixel, "pixel");
    if (v.find("sigma_px") != nullptr) mark.sigma_px = above_zero(v, "sigma_px");
  }
  void read_scale_bar(const JsonValue& v) {
    if (!known(v, "a scale bar", {"first", "second", "distance", "sigma", "loss"})) return;
    ScaleBar& bar = out_.scale_bars.emplace_back();
    bar.line = v.line;
    bar.first = name(v, "first");
    bar.second = name(v, "second");
    bar.distance = above_zero(v, "distance");
    bar.sigma = above_zero(v, "sigma");
    bar.loss = loss(v, "loss", {});
  }
  void read_lens(const JsonValue& v) {
    if (!known(v, "a value of a lens",
               {"image", "parameter", "value", "sigma", "loss", "min", "max"}))
      return;
    LensValue& lens = out_.lenses.emplace_back();
    lens.line = v.line;
    lens.image = name(v, "image");
    lens.parameter = text(v, "parameter");
    if (v.find("min") != nullptr) lens.lower = number(v, "min");
    if (v.find("max") != nullptr) lens.upper = number(v, "max");
    if (!error_ && !(lens.lower <= lens.upper))
      refuse(v.find("max")->line, "\"max\" below \"min\"", "an interval");
    const bool bounded = std::isfinite(lens.lower) || std::isfinite(lens.upper);
    if (bounded && v.find("value") == nullptr && v.find("sigma") == nullptr) return;
    lens.value = number(v, "value");
    lens.sigma = above_zero(v, "sigma");
    lens.loss = loss(v, "loss", {});
  }

  Constraints out_;
  TermLoss position_loss_{};
};

}  // namespace

Result<Constraints> parse_survey_json(const JsonValue& root, const std::string& name) {
  return Reading(name).run(root);
}

}  // namespace sheaf
