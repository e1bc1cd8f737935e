// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "chart/number_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace sheaf {
namespace {

constexpr const char *kMinus = "\xe2\x88\x92", *kUnknown = "\xe2\x80\x93", *kDot = "\xc2\xb7";
constexpr const char* kReplacement = "\xef\xbf\xbd";

/// Independent of the locale, as numbers of a drawing have to be.
std::string fixed_text(double x, int places) {
  std::array<char, 400> text;
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), x, std::chars_format::fixed, places);
  return {text.data(), end.ptr};
}

std::string raised(int exponent) {
  static constexpr std::array<const char*, 10> kDigits = {
      "\xe2\x81\xb0", "\xc2\xb9",     "\xc2\xb2",     "\xc2\xb3",     "\xe2\x81\xb4",
      "\xe2\x81\xb5", "\xe2\x81\xb6", "\xe2\x81\xb7", "\xe2\x81\xb8", "\xe2\x81\xb9"};
  std::string out;
  for (const char c : std::to_string(exponent))
    out += c == '-' ? "\xe2\x81\xbb" : kDigits[std::size_t(c - '0')];
  return out;
}

std::string spaced(const std::string& whole) {
  if (whole.size() < 5) return whole;
  std::string out;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (i > 0 && (whole.size() - i) % 3 == 0) out += kThinSpace;
    out += whole[i];
  }
  return out;
}

/// A number without sign, thousands apart.
std::string spaced_fixed(double size, int places) {
  const std::string text = fixed_text(size, places);
  const std::size_t point = text.find('.');
  return point == std::string::npos ? spaced(text)
                                    : spaced(text.substr(0, point)) + text.substr(point);
}

int exponent_of(double size) { return static_cast<int>(std::floor(std::log10(size))); }

std::string without_zeros(std::string text) {
  if (text.find('.') == std::string::npos) return text;
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

/// Length of the UTF-8 character that a text begins with; 0 where it begins with none.
std::size_t character_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return 1;
  const std::size_t length = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < length) return 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((byte(i) & 0xc0) != 0x80) return 0;
  const unsigned char second = byte(1);
  const bool overlong = (lead == 0xe0 && second < 0xa0) || (lead == 0xf0 && second < 0x90);
  const bool outside = (lead == 0xed && second >= 0xa0) || (lead == 0xf4 && second >= 0x90);
  return overlong || outside ? 0 : length;
}

/// U+0080 to U+009F, and what turns the direction of writing round.
bool is_control(std::string_view character) {
  if (character.size() == 1)
    return static_cast<unsigned char>(character[0]) < 0x20 || character[0] == 0x7f;
  if (character.size() == 2)
    return character[0] == '\xc2' && static_cast<unsigned char>(character[1]) < 0xa0;
  if (character.size() != 3 || character[0] != '\xe2') return false;
  const auto second = static_cast<unsigned char>(character[1]);
  const auto third = static_cast<unsigned char>(character[2]);
  return (second == 0x80 && ((third >= 0xa8 && third <= 0xae) || third == 0x8e || third == 0x8f)) ||
         (second == 0x81 && third >= 0xa6 && third <= 0xa9);
}

}  // namespace

std::string grouped(std::int64_t number) {
  const std::string text = std::to_string(number);
  return number < 0 ? kMinus + spaced(text.substr(1)) : spaced(text);
}

std::string digits(double x, int significant) {
  if (!std::isfinite(x)) return kUnknown;
  if (x == 0) return "0";
  const std::string sign = x < 0 ? kMinus : "";
  double size = std::abs(x);
  int exponent = exponent_of(size);
  const double unit = std::pow(10.0, exponent - significant + 1);
  // Rounding may reach the next power of ten: 9.996 has three digits as 10.0.
  if (unit > 0 && std::isfinite(unit) &&
      std::round(size / unit) * unit >= std::pow(10.0, exponent + 1))
    ++exponent;
  if (exponent >= 6 || exponent < -4) {
    const double mantissa = size / std::pow(10.0, exponent);
    return sign + fixed_text(mantissa, significant - 1) + kThinSpace + kDot + kThinSpace + "10" +
           raised(exponent);
  }
  const int places = significant - 1 - exponent;
  if (places < 0) size = std::round(size * std::pow(10.0, places)) / std::pow(10.0, places);
  return sign + spaced_fixed(size, std::max(0, places));
}

std::string decimals(double x, int places) {
  if (!std::isfinite(x)) return kUnknown;
  if (std::abs(x) >= 1e12) return digits(x);
  const std::string text = spaced_fixed(std::abs(x), places);
  const bool zero = text.find_first_of("123456789") == std::string::npos;
  return (x < 0 && !zero ? kMinus : "") + text;
}

std::string tick_text(double x) {
  if (!std::isfinite(x)) return kUnknown;
  if (x == 0) return "0";
  const std::string sign = x < 0 ? kMinus : "";
  const double size = std::abs(x);
  if (size >= 0.999e5 || size < 0.999e-3) {
    const int exponent = static_cast<int>(std::floor(std::log10(size) + 1e-9));
    const double mantissa = size / std::pow(10.0, exponent);
    const std::string power = "10" + raised(exponent);
    if (std::abs(mantissa - 1) < 1e-6) return sign + power;
    return sign + without_zeros(fixed_text(mantissa, 2)) + kDot + power;
  }
  const std::string text = without_zeros(fixed_text(size, 5));
  const std::size_t point = text.find('.');
  return sign + (point == std::string::npos ? spaced(text)
                                            : spaced(text.substr(0, point)) + text.substr(point));
}

std::string with_unit(double x, const char* unit, int significant) {
  return digits(x, significant) + kThinSpace + unit;
}

std::string percent(double share, int significant) {
  return digits(100 * share, significant) + kThinSpace + "%";
}

std::string seconds_text(double seconds) {
  if (seconds < 1) return with_unit(1000 * seconds, "ms", seconds < 0.1 ? 2 : 3);
  return with_unit(seconds, "s");
}

std::string count_text(std::uint64_t count, const char* one, const char* many) {
  return grouped(static_cast<std::int64_t>(count)) + " " + (count == 1 ? one : many);
}

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = character_length(text);
    const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
    text.remove_prefix(character.size());
    if (length == 0 || is_control(character))
      out += kReplacement;
    else if (character == "&")
      out += "&amp;";
    else if (character == "<")
      out += "&lt;";
    else if (character == ">")
      out += "&gt;";
    else if (character == "\"")
      out += "&quot;";
    else if (character == "'")
      out += "&#39;";
    else
      out += character;
  }
  return out;
}

std::string coordinate(double x) {
  if (!std::isfinite(x)) return "0";
  const double held = std::clamp(x, -1e6, 1e6);
  const std::string text = without_zeros(fixed_text(held, 1));
  return text == "-0" ? "0" : text;
}

}  // namespace sheaf
