// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <string_view>

#include "io/byte_source.h"
#include "io/line_cursor.h"
#include "survey/constraint_files.h"

namespace sheaf {
namespace {

enum class Form { json, table, gcp_list, geo };

/// A brace begins JSON, commas or semicolons a table; else the second line begins with a coordinate
/// or with the name of an image.
Form form_of(const std::string& text, const std::string& name) {
  LineCursor lines(text, name);
  if (!lines.next_line()) return Form::json;
  while (lines.rest().empty())
    if (!lines.next_line()) return Form::json;
  if (lines.rest().front() == '{' || lines.rest().front() == '[') return Form::json;
  if (lines.line().find_first_of(",;") != std::string_view::npos) return Form::table;
  LineCursor records(text, name);
  double x = 0;
  std::string_view word;
  if (!records.next_record() || !records.next_record()) return Form::geo;
  if (!records.read_real(x)) return Form::geo;
  for (int k = 0; k < 4; ++k)
    if (!records.read_real(x)) return Form::geo;
  return records.read_word(word) ? Form::gcp_list : Form::geo;
}

Error refuse(const Constraints& c, std::uint64_t line, const std::string& words) {
  return Error(ErrorCode::unreadable_input, c.path + ":" + std::to_string(line) + ": " + words);
}

Result<void> check_images(const Constraints& c) {
  std::map<std::string, std::uint64_t> seen;
  for (const ImagePosition& p : c.positions)
    if (const auto [at, is_new] = seen.try_emplace(p.image, p.line); !is_new)
      return refuse(c, p.line,
                    "found a second position of image " + sheaf::quoted(p.image) +
                        ", expected one (line " + std::to_string(at->second) + ")");
  return {};
}

Result<void> check_marks(const Constraints& c, const SurveyPoint& point) {
  std::map<std::string, std::uint64_t> seen;
  for (const SurveyMark& mark : point.marks)
    if (const auto [at, is_new] = seen.try_emplace(mark.image, mark.line); !is_new)
      return refuse(c, mark.line,
                    "found a second mark of point " + sheaf::quoted(point.id) + " in image " +
                        sheaf::quoted(mark.image) + ", expected one (line " +
                        std::to_string(at->second) + ")");
  return {};
}

}  // namespace

Result<void> check_constraints(const Constraints& c) {
  if (Result<void> good = check_images(c); !good.ok()) return good;
  std::map<std::string, std::uint64_t> points;
  for (const SurveyPoint& point : c.points) {
    if (const auto [at, is_new] = points.try_emplace(point.id, point.line); !is_new)
      return refuse(c, point.line,
                    "found the id " + sheaf::quoted(point.id) +
                        " a second time, expected ids of their own (line " +
                        std::to_string(at->second) + ")");
    if (Result<void> good = check_marks(c, point); !good.ok()) return good;
  }
  for (const ScaleBar& bar : c.scale_bars) {
    for (const std::string& id : {bar.first, bar.second})
      if (!points.contains(id))
        return refuse(c, bar.line,
                      "found a scale bar at point " + sheaf::quoted(id) +
                          ", expected the id of one of the points");
    if (bar.first == bar.second)
      return refuse(c, bar.line,
                    "found a scale bar from point " + sheaf::quoted(bar.first) +
                        " to itself, expected two points");
  }
  return {};
}

Result<Constraints> parse_constraints(const std::string& text, const std::string& name) {
  Result<Constraints> out = [&] {
    switch (form_of(text, name)) {
      case Form::table:
        return parse_position_table(text, name);
      case Form::gcp_list:
        return parse_gcp_list(text, name);
      case Form::geo:
        return parse_geo_txt(text, name);
      case Form::json:
        break;
    }
    return parse_survey_json(text, name);
  }();
  if (!out.ok()) return out;
  if (const Result<void> good = check_constraints(out.value()); !good.ok()) return good.error();
  return out;
}

Result<Constraints> read_constraints(const std::filesystem::path& path) {
  const Result<std::string> text = read_text(path);
  if (!text.ok()) return text.error();
  return parse_constraints(text.value(), path.string());
}

}  // namespace sheaf
