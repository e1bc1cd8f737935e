// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "platform/real_text.h"

#include <fast_float/fast_float.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace sheaf {

std::from_chars_result read_real(const char* begin, const char* end, double& value) {
  double read = 0;
  const auto [stop, error] = fast_float::from_chars(begin, end, read);
  if (error != std::errc()) return {stop, error};
  // Old releases of fast_float read what is too large as infinity.
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  if (std::isinf(read) && std::any_of(begin, stop, is_digit))
    return {stop, std::errc::result_out_of_range};
  value = read;
  return {stop, error};
}

std::string few_digits(double x, int digits) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, x);
  return text;
}

}  // namespace sheaf
