// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "sheaf/error.h"

namespace sheaf {

/// What an option is set to. Nothing (std::monostate, "none") is no limit, or not asked for.
using OptionValue =
    std::variant<std::monostate, bool, std::int64_t, double, std::string, std::vector<std::string>>;

/// Which of these it is, and how it is written.
enum class OptionKind {
  flag,    ///< bool: given or not
  whole,   ///< std::int64_t
  real,    ///< double
  bytes,   ///< std::int64_t; as text also with a unit, a power of 1024: 2G
  choice,  ///< std::string: the name of one of the choices
  text,    ///< std::string, of whatever form `wrong` takes
  list,    ///< strings of whatever form `wrong` takes; as text, comma-separated
};

/// The numbers that an option takes.
struct OptionRange {
  double lowest = std::numeric_limits<double>::lowest();
  double highest = std::numeric_limits<double>::max();
  bool above = false;  ///< without the lowest itself
  bool has(double value) const {
    return (above ? value > lowest : value >= lowest) && value <= highest;
  }
};
constexpr OptionRange from(double lowest) { return {.lowest = lowest}; }
constexpr OptionRange above(double lowest) { return {.lowest = lowest, .above = true}; }
constexpr OptionRange between(double lowest, double highest) {
  return {.lowest = lowest, .highest = highest};
}

/// A name that an option takes.
struct OptionChoice {
  std::string name;
  std::string meaning{};  ///< or nothing, where the name says it
};

/// Who can set an option.
enum class OptionReach {
  verb,        ///< a verb of the command has it, and its JSON says what it was set to
  every_verb,  ///< all have it, and their JSON says what came of it
  library,     ///< a field of the struct that no verb has
};

/// One option: all that the command's parser, its help, the documents, the checks of the library
/// and bindings know of it. Where its value lives is another matter (OptionField).
struct OptionSpec {
  std::string name;           ///< as the command has it after "--": "time-limit"
  std::string placeholder{};  ///< what stands for the value in a line of help: "SECONDS"
  std::string unit{};         ///< "s", "px", ... or none; keys end with it: "time_limit_s"
  OptionRange range{};        ///< of a number
  bool nothing = false;       ///< "none" is a value too
  std::string help{};         ///< one line, no full stop; choices and range are said by themselves
  std::string short_name{};   ///< "o" for -o too
  OptionReach reach = OptionReach::verb;
  std::vector<std::string> needs{}, excludes{};  ///< names of other options
  std::string key{};                             ///< where it is not made of name and unit
  OptionKind kind = OptionKind::text;            ///< set by what makes a field
  std::vector<OptionChoice> choices{};           ///< likewise
  /// What is wrong with a text, or "".
  std::function<std::string(const std::string&)> wrong{};
};

/// "time_limit_s": the key in JSON, and the field in messages of the library.
std::string key_of(const OptionSpec& spec);

/// "time_limit": the argument's name in languages where a dash is a minus.
std::string identifier_of(const OptionSpec& spec);

/// "from 0 up", "above 0", "from 1 to 6"; "" of what is no number.
std::string range_text(const OptionSpec& spec);

/// The whole line of help: choices with their meanings, unit and range behind the words.
std::string help_text(const OptionSpec& spec);

/// As `parse` reads it, every digit of a double.
std::string text_of(const OptionValue& value);

/// Errors: ErrorCode::usage, "expected a whole number from 0 up, not '-1'".
Result<OptionValue> parse(const OptionSpec& spec, const std::string& text);

/// Kind, range, choices, form. Errors: as of `parse`.
Result<void> accept(const OptionSpec& spec, const OptionValue& value);

/// Cut at commas; a comma behind a backslash belongs to an item.
std::vector<std::string> split_items(const std::string& list);

}  // namespace sheaf
