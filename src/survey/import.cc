// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <string_view>

#include "io/line_cursor.h"
#include "survey/constraint_files.h"

namespace sheaf {
namespace {

// What the programs that read these files suppose where they state nothing, metres.
constexpr double kControlSigma = 0.01, kControlHeightSigma = 0.1, kPositionSigma = 3;
// OpenSfM's pixel coordinates are (0, 0) in the middle of the first pixel, (0.5, 0.5) of models.
constexpr double kPixelMiddle = 0.5;

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return out;
}

/// The first line names the frame: WGS84, EPSG:4326 and +proj=longlat are longitude and latitude
/// there, all else is projected.
Result<WorldFrame> read_frame_line(LineCursor& lines) {
  if (!lines.next_record())
    return lines.refuse_as(
        "found the end of the text, expected a line that names the frame of the "
        "coordinates");
  WorldFrame frame;
  frame.name = std::string(lines.rest());
  const std::string name = lower(frame.name);
  const bool geodetic = name == "wgs84" || name == "epsg:4326" ||
                        name.find("+proj=longlat") != std::string::npos ||
                        name.find("+proj=latlong") != std::string::npos;
  const bool projected = name.starts_with("epsg:") || name.starts_with("+proj=") ||
                         name.starts_with("+init=") || name.starts_with("wgs84 utm");
  if (!geodetic && !projected)
    return lines.refuse_as("found " + sheaf::quoted(frame.name) +
                           ", expected the frame of the coordinates: EPSG:N, WGS84, WGS84 UTM N or "
                           "+proj=...");
  frame.kind = geodetic ? WorldKind::geodetic : WorldKind::projected;
  return frame;
}

/// x y z as these files have them: longitude first. A height of NaN is not known.
bool read_place(LineCursor& lines, const WorldFrame& frame, std::array<double, 3>& at,
                bool& height_known) {
  if (!lines.read_real(at[0]) || !lines.read_real(at[1])) return false;
  if (frame.kind == WorldKind::geodetic) std::swap(at[0], at[1]);
  LineCursor as_word = lines;
  std::string_view word;
  height_known = !(as_word.read_word(word) && lower(word) == "nan");
  if (height_known) return lines.read_real(at[2]);
  lines = as_word;
  at[2] = 0;
  return true;
}
bool on_earth(const WorldFrame& frame, const std::array<double, 3>& at) {
  return frame.kind != WorldKind::geodetic || (std::abs(at[0]) <= 90 && std::abs(at[1]) <= 360);
}
constexpr const char* kOnEarth =
    "found a longitude or latitude out of range, expected degrees, the longitude first";

Covariance3 diagonal(double horizontal, double vertical) {
  Covariance3 C{};
  C[0] = C[4] = horizontal * horizontal;
  C[8] = vertical * vertical;
  return C;
}

/// The fields of a line of CSV; quotes may stand around a field.
std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> out(1);
  bool in_quotes = false;
  for (const char c : line) {
    if (c == '"') {
      in_quotes = !in_quotes;
    } else if ((c == ',' || c == ';' || c == '\t') && !in_quotes) {
      out.emplace_back();
    } else {
      out.back() += c;
    }
  }
  for (std::string& field : out) {
    field.erase(0, field.find_first_not_of(' '));
    field.erase(field.find_last_not_of(' ') + 1);
  }
  return out;
}

enum Column { kLabel, kX, kY, kZ, kLon, kLat, kHeight, kAll, kAcross, kSx, kSy, kSz, kColumns };

/// Names of columns as people and Metashape write them, without case, blanks and units.
std::optional<Column> column_named(const std::string& field) {
  static const std::map<std::string, Column> kNames = {{"label", kLabel},
                                                       {"image", kLabel},
                                                       {"name", kLabel},
                                                       {"filename", kLabel},
                                                       {"x", kX},
                                                       {"easting", kX},
                                                       {"east", kX},
                                                       {"x/easting", kX},
                                                       {"x/east", kX},
                                                       {"y", kY},
                                                       {"northing", kY},
                                                       {"north", kY},
                                                       {"y/northing", kY},
                                                       {"y/north", kY},
                                                       {"z", kZ},
                                                       {"altitude", kZ},
                                                       {"alt", kZ},
                                                       {"z/altitude", kZ},
                                                       {"height", kZ},
                                                       {"up", kZ},
                                                       {"lon", kLon},
                                                       {"longitude", kLon},
                                                       {"x/longitude", kLon},
                                                       {"lat", kLat},
                                                       {"latitude", kLat},
                                                       {"y/latitude", kLat},
                                                       {"accuracy", kAll},
                                                       {"sigma", kAll},
                                                       {"accuracy_xyz", kAll},
                                                       {"accuracy_xy", kAcross},
                                                       {"sigma_xy", kAcross},
                                                       {"horizontal_accuracy", kAcross},
                                                       {"accuracy_x", kSx},
                                                       {"sigma_x", kSx},
                                                       {"accuracy_y", kSy},
                                                       {"sigma_y", kSy},
                                                       {"accuracy_z", kSz},
                                                       {"sigma_z", kSz},
                                                       {"vertical_accuracy", kSz}};
  std::string name = lower(field);
  name.erase(std::find(name.begin(), name.end(), '('), name.end());
  while (name.starts_with('#') || name.starts_with(' ')) name.erase(0, 1);
  while (name.ends_with('_') || name.ends_with(' ')) name.pop_back();
  std::replace(name.begin(), name.end(), ' ', '_');
  const auto found = kNames.find(name);
  if (found == kNames.end()) return {};
  return found->second;
}

/// Reads the lines of a table of positions.
class TableReading {
 public:
  TableReading(const std::string& text, const std::string& name) : lines_(text, name) {
    out_.paths = {name};
  }

  Result<Constraints> run() {
    if (auto e = read_header()) return *e;
    while (lines_.next_line()) {
      const std::string_view rest = lines_.rest();
      if (rest.empty() || rest.starts_with('#')) continue;
      if (auto e = read_row(fields_of(rest))) return *e;
    }
    return std::move(out_);
  }

 private:
  bool has(Column column) const { return place_[column] >= 0; }

  std::optional<Error> read_header() {
    place_.fill(-1);
    std::vector<std::string> names;
    while (lines_.next_line()) {
      names = fields_of(lines_.rest());
      const auto labels = [](const std::string& field) { return column_named(field) == kLabel; };
      if (std::any_of(names.begin(), names.end(), labels)) break;
    }
    for (std::size_t i = 0; i < names.size(); ++i)
      if (const auto column = column_named(names[i]); column && place_[*column] < 0)
        place_[*column] = static_cast<int>(i);
    const bool geodetic = has(kLon) && has(kLat);
    if (!has(kLabel) || !(geodetic || (has(kX) && has(kY))) || !has(kZ))
      return lines_.refuse_as(
          "found no columns of positions, expected a line that names them: "
          "label, x, y, z or longitude, latitude, altitude, and accuracies");
    if (!has(kAll) && !((has(kAcross) || (has(kSx) && has(kSy))) && has(kSz)))
      return lines_.refuse_as(
          "found no accuracies, expected columns accuracy, or accuracy_xy and "
          "accuracy_z, or accuracy_x, accuracy_y and accuracy_z");
    out_.frame.kind = geodetic ? WorldKind::geodetic : WorldKind::projected;
    return {};
  }

  std::optional<Error> number(const std::vector<std::string>& row, Column column, double& out) {
    const auto i = static_cast<std::size_t>(place_[column]);
    LineCursor field(i < row.size() ? std::string_view(row[i]) : std::string_view(), "");
    if (field.next_line() && field.read_real(out) && field.line_ended()) return {};
    return lines_.refuse_as("found " + sheaf::quoted(i < row.size() ? row[i] : "") + " in column " +
                            std::to_string(i + 1) + ", expected a finite number");
  }

  std::optional<Error> read_row(const std::vector<std::string>& row) {
    ImagePosition p;
    p.line = lines_.line_number();
    const auto label = static_cast<std::size_t>(place_[kLabel]);
    if (label < row.size()) p.image = row[label];
    if (p.image.empty()) return lines_.refuse_as("found no label, expected the name of an image");
    const bool geodetic = out_.frame.kind == WorldKind::geodetic;
    const std::array<Column, 3> at = geodetic ? std::array{kLat, kLon, kZ} : std::array{kX, kY, kZ};
    for (std::size_t k = 0; k < 3; ++k)
      if (auto e = number(row, at[k], p.at[k])) return e;
    if (!on_earth(out_.frame, p.at)) return lines_.refuse_as(kOnEarth);
    const bool across = has(kAcross) && !(has(kSx) && has(kSy));
    std::array<Column, 3> from{across ? kAcross : kSx, across ? kAcross : kSy, kSz};
    if (has(kAll) && !has(kSz)) from = {kAll, kAll, kAll};
    p.covariance = {};
    for (std::size_t k = 0; k < 3; ++k) {
      double sigma = 0;
      if (auto e = number(row, from[k], sigma)) return e;
      if (!(sigma > 0)) return lines_.refuse_as("found an accuracy of 0 or less, expected metres");
      p.covariance[4 * k] = sigma * sigma;
    }
    out_.positions.push_back(p);
    return {};
  }

  LineCursor lines_;
  Constraints out_;
  std::array<int, kColumns> place_{};
};

/// What the first line says.
Result<Constraints> begin_list(LineCursor& lines, const std::string& name) {
  const Result<WorldFrame> frame = read_frame_line(lines);
  if (!frame.ok()) return frame.error();
  Constraints out;
  out.paths = {name};
  out.frame = frame.value();
  return out;
}

}  // namespace

Result<Constraints> parse_gcp_list(const std::string& text, const std::string& name) {
  LineCursor lines(text, name);
  Result<Constraints> begun = begin_list(lines, name);
  if (!begun.ok()) return begun;
  Constraints& out = begun.value();
  std::map<std::string, std::size_t> by_id;
  std::map<std::array<double, 3>, std::string> id_of_place;
  while (lines.next_record()) {
    std::array<double, 3> at;
    SurveyMark mark;
    mark.line = lines.line_number();
    std::string_view image, id;
    bool height_known = true;
    if (!read_place(lines, out.frame, at, height_known) || !lines.read_real(mark.pixel[0]) ||
        !lines.read_real(mark.pixel[1]))
      return lines.refuse("x y z, then a pixel x y: finite numbers");
    if (!on_earth(out.frame, at)) return lines.refuse_as(kOnEarth);
    if (!lines.read_word(image)) return lines.refuse("the name of an image behind its pixel");
    mark.image = std::string(image);
    for (double& x : mark.pixel) x += kPixelMiddle;
    // Points without a name are told by where they are.
    std::string& unnamed =
        id_of_place.try_emplace(at, "point " + std::to_string(id_of_place.size() + 1))
            .first->second;
    const std::string key = lines.read_word(id) ? std::string(id) : unnamed;
    const auto [found, is_new] = by_id.try_emplace(key, out.points.size());
    if (is_new) {
      SurveyPoint& point = out.points.emplace_back();
      point.id = key;
      point.at = at;
      point.sigma = {kControlSigma, kControlSigma,
                     height_known ? kControlHeightSigma : kUnknownHeightSigma};
      point.line = lines.line_number();
    } else if (out.points[found->second].at != at) {
      return lines.refuse_as("found other coordinates of point " + sheaf::quoted(key) +
                             " than in line " + std::to_string(out.points[found->second].line) +
                             ", expected the same");
    }
    out.points[found->second].marks.push_back(mark);
  }
  return begun;
}

Result<Constraints> parse_geo_txt(const std::string& text, const std::string& name) {
  LineCursor lines(text, name);
  Result<Constraints> begun = begin_list(lines, name);
  if (!begun.ok()) return begun;
  Constraints& out = begun.value();
  bool angles = false;
  while (lines.next_record()) {
    ImagePosition p;
    p.line = lines.line_number();
    std::string_view image;
    if (!lines.read_word(image)) return lines.refuse("the name of an image");
    p.image = std::string(image);
    bool height_known = true;
    if (!read_place(lines, out.frame, p.at, height_known))
      return lines.refuse("three finite coordinates");
    if (!on_earth(out.frame, p.at)) return lines.refuse_as(kOnEarth);
    double angle = 0, horizontal = kPositionSigma, vertical = kPositionSigma;
    for (int k = 0; k < 3 && !lines.line_ended(); ++k) {
      if (!lines.read_real(angle)) return lines.refuse("three angles in degrees");
      angles = true;
    }
    if (!lines.line_ended()) {
      if (!lines.read_real(horizontal) || !lines.read_real(vertical) || !(horizontal > 0) ||
          !(vertical > 0))
        return lines.refuse("a horizontal and a vertical accuracy above 0, metres");
    }
    p.covariance = diagonal(horizontal, height_known ? vertical : kUnknownHeightSigma);
    out.positions.push_back(p);
  }
  if (angles) out.notes.push_back("angles of geo.txt are not used");
  return begun;
}

Result<Constraints> parse_position_table(const std::string& text, const std::string& name) {
  return TableReading(text, name).run();
}

}  // namespace sheaf
