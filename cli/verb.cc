// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "verb.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "platform/real_text.h"

namespace sheaf {
namespace {

std::from_chars_result read_number(const char* begin, const char* end, long long& out) {
  return std::from_chars(begin, end, out);
}
std::from_chars_result read_number(const char* begin, const char* end, double& out) {
  return read_real(begin, end, out);
}

template <class Number>
bool parse(const std::string& text, Number& out) {
  const char* end = text.data() + text.size();
  const auto [stop, error] = read_number(text.data(), end, out);
  return error == std::errc() && stop == end;
}

std::string refusal(const std::string& what, const std::string& text) {
  return fmt::format("expected {}, not '{}'", what, text);
}

}  // namespace

CLI::Validator whole_number_from(long long lowest, const std::string& what) {
  return CLI::Validator(
      [=](std::string& text) {
        long long number = 0;
        return parse(text, number) && number >= lowest ? std::string() : refusal(what, text);
      },
      "");
}

CLI::Validator number_in(double lowest, double highest, bool lowest_too, const std::string& what) {
  return CLI::Validator(
      [=](std::string& text) {
        double number = 0;
        const bool good = parse(text, number) && number <= highest &&
                          (lowest_too ? number >= lowest : number > lowest);
        return good ? std::string() : refusal(what, text);
      },
      "");
}

CLI::Validator one_of(const std::vector<std::string>& names) {
  return CLI::Validator(
      [=](std::string& text) {
        const bool known = std::find(names.begin(), names.end(), text) != names.end();
        return known ? std::string()
                     : refusal("one of " + fmt::format("{}", fmt::join(names, ", ")), text);
      },
      "");
}

void add_common_options(CLI::App& verb, CommonOptions& options) {
  verb.add_option("--json", options.json, "also write the result as JSON (docs/json.md)")
      ->type_name("FILE");
  verb.add_option("--threads", options.threads,
                  "threads to compute with, 0 for all; the result does not depend on it")
      ->type_name("N")
      ->check(whole_number_from(0, "a whole number from 0 up"))
      ->capture_default_str();
  verb.add_flag("--quiet", options.quiet, "no progress on stderr");
}

}  // namespace sheaf
