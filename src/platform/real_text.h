// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <charconv>
#include <string>

namespace sheaf {

/// std::from_chars for doubles, which libc++ has only from its release 20 on: the longest decimal
/// number that [begin, end) starts with, rounded to the nearest double. A number beyond the range
/// of doubles is std::errc::result_out_of_range; "inf" and "nan" are what they say.
std::from_chars_result read_real(const char* begin, const char* end, double& value);

/// For people: at most so many digits that count.
std::string few_digits(double x, int digits);

}  // namespace sheaf
