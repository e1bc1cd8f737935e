// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/option.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "options/words.h"
#include "platform/real_text.h"

namespace sheaf {
namespace {

bool read_whole(std::string_view text, std::int64_t& out) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, out);
  return error == std::errc() && stop == end;
}

bool read_number(std::string_view text, double& out) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = read_real(text.data(), end, out);
  return error == std::errc() && stop == end;
}

std::string number_text(double value) {
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

bool is_number(OptionKind kind) {
  return kind == OptionKind::whole || kind == OptionKind::real || kind == OptionKind::bytes;
}

/// "2G", "500 MB", "1024": a whole number and a power of 1024.
bool read_bytes(std::string_view text, std::int64_t& out) {
  constexpr std::string_view kUnits = "kmgtpe";
  std::size_t end = text.find_last_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ");
  if (end == std::string_view::npos) return false;
  std::string unit(text.substr(end + 1));
  for (char& letter : unit) letter = static_cast<char>(letter | 0x20);
  text = text.substr(0, end + 1);
  text = text.substr(0, text.find_last_not_of(' ') + 1);
  if (!read_whole(text, out)) return false;
  if (unit.empty() || unit == "b") return true;
  const std::size_t power = kUnits.find(unit[0]);
  const std::string_view rest = std::string_view(unit).substr(1);
  if (power == std::string_view::npos ||
      (!rest.empty() && rest != "b" && rest != "i" && rest != "ib"))
    return false;
  const int shift = 10 * static_cast<int>(power + 1);
  const std::int64_t scaled = static_cast<std::int64_t>(static_cast<std::uint64_t>(out) << shift);
  if (scaled >> shift != out) return false;
  out = scaled;
  return true;
}

std::string unit_words(const std::string& unit) {
  if (unit == "s") return "seconds";
  if (unit == "px") return "pixels";
  if (unit == "rad") return "radians";
  if (unit == "deg") return "degrees";
  return unit;
}

std::string with_space(const std::string& words) { return words.empty() ? "" : " " + words; }

/// A type's own limit is no news, but where a value went beyond it.
std::string range_words(const OptionSpec& spec, bool with_limit) {
  constexpr double kLimitOfInt = std::numeric_limits<int>::max();
  const OptionRange& r = spec.range;
  if (r.lowest == OptionRange().lowest) return "";
  const std::string lowest = (r.above ? "above " : "from ") + number_text(r.lowest);
  if (r.highest < kLimitOfInt || with_limit)
    return lowest + (r.above ? " and at most " : " to ") + number_text(r.highest);
  return lowest + (r.above ? "" : " up");
}

std::string expected(const OptionSpec& spec, const OptionValue& value) {
  switch (spec.kind) {
    case OptionKind::flag:
      return "true or false";
    case OptionKind::choice: {
      std::vector<std::string> names;
      for (const OptionChoice& choice : spec.choices) names.push_back(choice.name);
      return "one of " + listed(names);
    }
    case OptionKind::whole:
    case OptionKind::real:
    case OptionKind::bytes: {
      const std::int64_t* whole = std::get_if<std::int64_t>(&value);
      const bool beyond = whole != nullptr && static_cast<double>(*whole) > spec.range.highest;
      return std::string(spec.kind == OptionKind::whole ? "a whole number" : "a number") +
             (spec.unit.empty() ? "" : " of " + unit_words(spec.unit)) +
             with_space(range_words(spec, beyond)) +
             (spec.kind == OptionKind::bytes ? ", as 500M or 2G" : "");
    }
    case OptionKind::text:
    case OptionKind::list:
      break;
  }
  return "text";
}

Error refusal(const OptionSpec& spec, const OptionValue& value, const std::string& text) {
  return {ErrorCode::usage, "expected " + expected(spec, value) + ", not '" + text + "'"};
}

bool read_flag(const std::string& text, bool& out) {
  out = text == "true";
  return out || text == "false";
}

/// Kind alone. False where the text is not of it.
bool read_value(const OptionSpec& spec, const std::string& text, OptionValue& out) {
  if (spec.nothing && text == "none") return out = OptionValue(), true;
  switch (spec.kind) {
    case OptionKind::flag:
      return read_flag(text, out.emplace<bool>());
    case OptionKind::whole:
      return read_whole(text, out.emplace<std::int64_t>());
    case OptionKind::bytes:
      return read_bytes(text, out.emplace<std::int64_t>());
    case OptionKind::real:
      return read_number(text, out.emplace<double>());
    case OptionKind::list:
      out = split_items(text);
      return true;
    case OptionKind::choice:
    case OptionKind::text:
      out = text;
      return true;
  }
  return false;
}

bool has_kind(const OptionSpec& spec, const OptionValue& value) {
  switch (spec.kind) {
    case OptionKind::flag:
      return std::holds_alternative<bool>(value);
    case OptionKind::whole:
    case OptionKind::bytes:
      return std::holds_alternative<std::int64_t>(value);
    case OptionKind::real:
      return std::holds_alternative<double>(value);
    case OptionKind::choice:
    case OptionKind::text:
      return std::holds_alternative<std::string>(value);
    case OptionKind::list:
      return std::holds_alternative<std::vector<std::string>>(value);
  }
  return false;
}

bool in_range(const OptionSpec& spec, const OptionValue& value) {
  if (const auto* whole = std::get_if<std::int64_t>(&value))
    return spec.range.has(static_cast<double>(*whole));
  if (const auto* real = std::get_if<double>(&value)) return spec.range.has(*real);
  if (spec.kind != OptionKind::choice) return true;
  const auto named = [&](const OptionChoice& c) { return c.name == std::get<std::string>(value); };
  return std::any_of(spec.choices.begin(), spec.choices.end(), named);
}

std::string wrong_form(const OptionSpec& spec, const OptionValue& value) {
  if (!spec.wrong) return "";
  if (spec.kind == OptionKind::text) return spec.wrong(std::get<std::string>(value));
  if (spec.kind != OptionKind::list) return "";
  for (const std::string& item : std::get<std::vector<std::string>>(value))
    if (std::string wrong = spec.wrong(item); !wrong.empty()) return wrong;
  return "";
}

/// The text is what is complained of.
Result<void> accept_as(const OptionSpec& spec, const OptionValue& value, const std::string& text) {
  if (spec.nothing && std::holds_alternative<std::monostate>(value)) return {};
  if (!has_kind(spec, value) || !in_range(spec, value)) return refusal(spec, value, text);
  if (std::string wrong = wrong_form(spec, value); !wrong.empty())
    return Error(ErrorCode::usage, wrong);
  return {};
}

}  // namespace

std::string identifier_of(const OptionSpec& spec) {
  std::string out = spec.name;
  std::replace(out.begin(), out.end(), '-', '_');
  return out;
}

std::string key_of(const OptionSpec& spec) {
  if (!spec.key.empty()) return spec.key;
  return identifier_of(spec) + (spec.unit.empty() ? "" : "_" + spec.unit);
}

std::string range_text(const OptionSpec& spec) {
  return is_number(spec.kind) ? range_words(spec, false) : "";
}

std::string help_text(const OptionSpec& spec) {
  std::vector<std::string> names;
  for (const OptionChoice& choice : spec.choices)
    names.push_back(choice.name + (choice.meaning.empty() ? "" : " (" + choice.meaning + ")"));
  std::string out = spec.help;
  if (!names.empty()) out += ": " + listed(names, " or ");
  std::vector<std::string> limits;
  if (is_number(spec.kind) && !spec.unit.empty()) limits.push_back(unit_words(spec.unit));
  if (const std::string range = range_text(spec); !range.empty()) limits.push_back(range);
  return limits.empty() ? out : out + " (" + listed(limits) + ")";
}

std::string text_of(const OptionValue& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag ? "true" : "false";
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return std::to_string(*whole);
  if (const auto* real = std::get_if<double>(&value)) return number_text(*real);
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  const auto* items = std::get_if<std::vector<std::string>>(&value);
  if (items == nullptr) return "none";
  std::string out;
  for (const std::string& item : *items) {
    out += out.empty() ? "" : ",";
    for (const char c : item) out += c == ',' ? std::string("\\,") : std::string(1, c);
  }
  return out;
}

Result<OptionValue> parse(const OptionSpec& spec, const std::string& text) {
  OptionValue value;
  if (!read_value(spec, text, value)) return refusal(spec, OptionValue(), text);
  if (Result<void> good = accept_as(spec, value, text); !good.ok()) return good.error();
  return value;
}

Result<void> accept(const OptionSpec& spec, const OptionValue& value) {
  return accept_as(spec, value, text_of(value));
}

std::vector<std::string> split_items(const std::string& list) {
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

}  // namespace sheaf
