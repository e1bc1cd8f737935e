// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "platform/real_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string_view>

namespace sheaf {
namespace {

struct ReadReal {
  std::string_view rest;
  std::errc error;
  double value = -7;  ///< kept where nothing is read
};

ReadReal read(std::string_view text) {
  ReadReal out;
  const char* end = text.data() + text.size();
  const auto [stop, error] = read_real(text.data(), end, out.value);
  out.rest = text.substr(static_cast<std::size_t>(stop - text.data()));
  out.error = error;
  return out;
}

TEST(RealText, ReadsTheLongestNumber) {
  const ReadReal whole = read("-12.5e-1"), part = read("0.1,2");
  EXPECT_EQ(whole.error, std::errc());
  EXPECT_EQ(whole.value, -1.25);
  EXPECT_EQ(whole.rest, "");
  EXPECT_EQ(part.error, std::errc());
  EXPECT_EQ(part.value, 0.1);
  EXPECT_EQ(part.rest, ",2");
}

TEST(RealText, RefusesWhatIsNoNumber) {
  for (const std::string_view text : {"", "x1", "+1", " 1", "-"}) {
    const ReadReal none = read(text);
    EXPECT_EQ(none.error, std::errc::invalid_argument) << text;
    EXPECT_EQ(none.value, -7) << text;
  }
}

TEST(RealText, TellsInfinityFromWhatIsTooLarge) {
  EXPECT_EQ(read("inf").error, std::errc());
  EXPECT_TRUE(std::isinf(read("-infinity").value));
  EXPECT_TRUE(std::isnan(read("nan").value));
  for (const std::string_view text : {"1e999", "-2e308"}) {
    const ReadReal large = read(text);
    EXPECT_EQ(large.error, std::errc::result_out_of_range) << text;
    EXPECT_EQ(large.value, -7) << text;
    EXPECT_EQ(large.rest, "") << text;
  }
}

}  // namespace
}  // namespace sheaf
