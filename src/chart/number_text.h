// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace sheaf {

/// Between a number and its unit, and between thousands: narrow, and no line breaks there.
inline constexpr const char* kThinSpace = "\xe2\x80\xaf";

/// A whole number, thousands apart from five digits on: "9999", "10 000".
std::string grouped(std::int64_t number);

/// For reading: so many digits that count, with a true minus, "2.50·10⁶" where zeros would have to
/// be counted; "–" for what is not finite.
std::string digits(double x, int significant = 3);

/// For columns: always so many decimals; "–" for what is not finite.
std::string decimals(double x, int places);

/// For axes: no digit that says nothing, "10⁵" and "2·10⁵" from there on and below 10⁻³.
std::string tick_text(double x);

/// digits() with a unit behind it.
std::string with_unit(double x, const char* unit, int significant = 3);
/// A share of 1, in per cent.
std::string percent(double share, int significant = 2);
/// Seconds, in ms below one.
std::string seconds_text(double seconds);
/// "1 lens", "2 lenses", "10 000 lenses".
std::string count_text(std::uint64_t count, const char* one, const char* many);

/// As text of HTML and SVG, between tags and in quoted attributes: marks are escaped; control
/// characters and bytes that are no UTF-8 become U+FFFD.
std::string escaped(std::string_view text);

/// A length in a drawing: one decimal at most, no exponent; what is not finite is 0.
std::string coordinate(double x);

}  // namespace sheaf
