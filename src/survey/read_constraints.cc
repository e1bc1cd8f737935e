// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
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
  for (int k = 0; k < 5; ++k)
    if (!(k == 2 ? records.read_word(word) : records.read_real(x))) return Form::geo;
  return records.read_word(word) ? Form::gcp_list : Form::geo;
}

/// Not yet checked: what one file lacks another may have.
Result<Constraints> parse_any(const std::string& text, const std::string& name) {
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
  const Result<JsonValue> root = parse_json(text, name);
  if (!root.ok()) return root.error();
  return is_opensfm_points(root.value()) ? parse_opensfm_points(root.value(), name)
                                         : parse_survey_json(root.value(), name);
}

/// The first bytes of a file; of a pipe, which is read once, none.
Result<std::string> head_of(const std::filesystem::path& path) {
  constexpr std::size_t kHead = 16;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return std::string();
  Result<RawBytes> bytes = RawBytes::open(path);
  if (!bytes.ok()) return bytes.error();
  std::string out(kHead, '\0');
  const Result<std::size_t> count = bytes.value().read(out.data(), out.size());
  if (!count.ok()) return count.error();
  out.resize(count.value());
  return out;
}

/// Folders, and files that are not text, are read where they lie.
Result<Constraints> read_any(const std::filesystem::path& path) {
  constexpr std::string_view kJpeg = "\xff\xd8\xff", kSqlite{"SQLite format 3\0", 16};
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return read_image_positions(path);
  const Result<std::string> head = head_of(path);
  if (!head.ok()) return head.error();
  if (head.value().starts_with(kJpeg)) return read_image_positions(path);
  if (head.value() == kSqlite) return read_pose_priors(path);
  const Result<std::string> text = read_text(path);
  if (!text.ok()) return text.error();
  return parse_any(text.value(), path.string());
}

Result<Constraints> checked(Result<Constraints> read) {
  if (!read.ok()) return read;
  if (const Result<void> good = check_constraints(read.value()); !good.ok()) return good.error();
  return read;
}

}  // namespace

Result<Constraints> parse_constraints(const std::string& text, const std::string& name) {
  return checked(parse_any(text, name));
}

Result<Constraints> read_constraints(const std::filesystem::path& path) {
  return checked(read_any(path));
}

Result<Constraints> read_constraints(const std::vector<std::filesystem::path>& paths) {
  std::vector<Constraints> parts;
  for (const std::filesystem::path& path : paths) {
    Result<Constraints> part = read_any(path);
    if (!part.ok()) return part.error();
    parts.push_back(std::move(part).value());
  }
  return checked(merge_constraints(std::move(parts)));
}

}  // namespace sheaf
