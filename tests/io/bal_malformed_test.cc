// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "io/bal.h"
#include "io/bytes.h"

namespace sheaf {
namespace {

/// 18 lines: the header, two observations (2, 3), nine camera values (4 to 12), two points (13 to
/// 18) with a value on each line.
std::string tiny(std::size_t changed_line = 0, const std::string& replacement = "") {
  const std::vector<std::string> lines{"1 2 2",
                                       "0 0 -385.99 387.12",
                                       "0 1 3.838800e+02 -15.3",
                                       "0.1",
                                       "0.2",
                                       "0.3",
                                       "1",
                                       "2",
                                       "-3",
                                       "500",
                                       "-1e-7",
                                       "1e-13",
                                       "1",
                                       "2",
                                       "3",
                                       "4",
                                       "5",
                                       "6"};
  std::string text;
  for (std::size_t i = 0; i < lines.size(); ++i)
    text += (i + 1 == changed_line ? replacement : lines[i]) + "\n";
  return text;
}

std::string first_lines(std::size_t count) {
  const std::string text = tiny();
  std::size_t end = 0;
  for (std::size_t i = 0; i < count; ++i) end = text.find('\n', end) + 1;
  return text.substr(0, end);
}

struct Malformed {
  std::string name;
  std::string text;
  std::string message;  ///< how the message begins
};

const std::string kHeader = ", expected the number of ";

std::vector<Malformed> malformed() {
  const std::string zero(1, '\0');
  return {
      {"word for cameras", tiny(1, "ply 2 2"), "f:1: found 'ply', expected the number of cameras"},
      {"no cameras", tiny(1, "0 2 2"), "f:1: found '0', expected the number of cameras (1 to"},
      {"no points", tiny(1, "1 0 2"),
       "f:1: found '2', expected the number of observations (0 to 0"},
      {"no observations", tiny(1, "1 2 0"), "f:11: found '-1e-7', expected the end of the file"},
      {"negative count", tiny(1, "1 -2 2"), "f:1: found '-2', expected the number of points"},
      {"fractional count", tiny(1, "1.0 2 2"), "f:1: found '1.0', expected the number of cameras"},
      {"count with exponent", tiny(1, "1 2 2e0"), "f:1: found '2e0', expected the number of obs"},
      {"count over 64 bits", tiny(1, "1 2 18446744073709551616"),
       "f:1: found '18446744073709551616', expected the number of observations"},
      {"64-bit count", tiny(1, "1 2 18446744073709551615"),
       "f:1: found '18446744073709551615', expected the number of observations (0 to 720"},
      {"33-bit cameras", tiny(1, "4294967296 2 2"), "f:1: found '4294967296', expected the number"},
      {"more than the file holds", tiny(1, "1 2 2000000"),
       "f:1: found '2000000', expected counts that a file of "},
      {"far more than it holds", tiny(1, "1 4294967294 72057594037927936"),
       "f:1: found '72057594037927936', expected counts that a file of "},
      {"header over lines", tiny(1, "\n1\n2\n\nx"), "f:5: found 'x', expected the number of obs"},
      {"header only", "1 1 1\n", "f:1: found '1', expected counts that a file of 6 bytes"},
      {"half a header", "16 22106\n", "f:1: found the end of the file, expected the number of obs"},
      {"white space only", "\n\n \n", "f:3: found the end of the file, expected the number of cam"},
      {"camera index too large", tiny(3, "1 1 3 4"),
       "f:3: found '1', expected the camera index of observation 1 (of 2), 0 to 0"},
      {"camera index negative", tiny(2, "-1 0 3 4"),
       "f:2: found '-1', expected the camera index of observation 0 (of 2), 0 to 0"},
      {"point index too large", tiny(3, "0 2 3 4"),
       "f:3: found '2', expected the point index of observation 1 (of 2), 0 to 1"},
      {"point index over 32 bits", tiny(3, "0 4294967297 3 4"),
       "f:3: found '4294967297', expected the point index of observation 1 (of 2), 0 to 1"},
      {"point index fractional", tiny(3, "0 1. 3 4"), "f:3: found '1.', expected the point index"},
      {"nan", tiny(2, "0 0 nan 4"),
       "f:2: found 'nan', expected a finite number, x of observation 0 (of 2)"},
      {"inf", tiny(3, "0 1 3 inf"),
       "f:3: found 'inf', expected a finite number, y of observation 1 (of 2)"},
      {"minus infinity", tiny(4, "-infinity"),
       "f:4: found '-infinity', expected a finite number, angle-axis x of camera 0 (of 1)"},
      {"overflow", tiny(9, "1e400"),
       "f:9: found '1e400', expected a finite number, translation z of camera 0 (of 1)"},
      {"overflow by digits", tiny(10, std::string(400, '9')),
       "f:10: found '" + std::string(40, '9') + "...', expected a finite number, focal length of"},
      {"unit behind", tiny(10, "500px"), "f:10: found '500px', expected a finite number, focal"},
      {"comma", tiny(11, "1,5"), "f:11: found '1,5', expected a finite number, k1 of camera 0"},
      {"hexadecimal", tiny(12, "0x1p3"), "f:12: found '0x1p3', expected a finite number, k2 of"},
      {"two signs", tiny(13, "+-1"), "f:13: found '+-1', expected a finite number, X of point 0"},
      {"sign only", tiny(14, "-"),
       "f:14: found '-', expected a finite number, Y of point 0 (of 2)"},
      {"point only", tiny(15, "."),
       "f:15: found '.', expected a finite number, Z of point 0 (of 2)"},
      {"exponent missing", tiny(16, "4e"),
       "f:16: found '4e', expected a finite number, X of point 1"},
      {"exponent of Fortran", tiny(17, "4D0"), "f:17: found '4D0', expected a finite number, Y of"},
      {"angle overflows", tiny(6, "1e200"),
       "f:6: found '1e200', expected an angle below 1e150 rad"},
      {"one value more", tiny() + "7\n", "f:19: found '7', expected the end of the file behind"},
      {"word behind", tiny() + "\n\n  end", "f:21: found 'end', expected the end of the file"},
      {"one value too few", first_lines(17),
       "f:17: found the end of the file, expected a finite number, Z of point 1 (of 2)"},
      {"cut in a number", first_lines(17) + "-",
       "f:18: found '-', expected a finite number, Z of point 1 (of 2)"},
      {"cut in cameras", first_lines(9) + std::string(60, '\n'),
       "f:69: found the end of the file, expected a finite number, focal length of camera 0"},
      {"zero byte", tiny(8, zero), "f:8: found binary data (byte 0x00), expected a finite number"},
      {"byte order mark", "\xef\xbb\xbf" + tiny(),
       "f:1: found binary data (byte 0xef), expected the"},
      {"binary behind a digit", tiny(7, "1\x01"), "f:7: found '1\\x01', expected a finite number"},
      {"old line ends count as white space", tiny(14, "2\r3 x"), "f:14: found 'x', expected a fin"},
  };
}

TEST(BalMalformed, NamesLineFoundAndExpected) {
  EXPECT_GE(malformed().size(), 25u);
  // Windows of 48 bytes slide within numbers and white space of every kind.
  for (const std::size_t window : {TokenReader::kWindowBytes, std::size_t{48}})
    for (const Malformed& m : malformed()) {
      if (window == 48 && m.name == "overflow by digits") continue;  // longer than that window
      const Result<Problem> result = parse_bal(m.text, "f", window);
      ASSERT_FALSE(result.ok()) << m.name;
      EXPECT_EQ(result.error().code(), ErrorCode::unreadable_input) << m.name;
      EXPECT_EQ(std::string(result.error().what()).substr(0, m.message.size()), m.message)
          << m.name << " with a window of " << window;
    }
}

TEST(BalMalformed, SaysTheSameOfCompressedText) {
  for (const Malformed& m : malformed()) {
    if (m.message.find("counts that") != std::string::npos) continue;
    for (const std::string& bytes : {test::gzip(m.text), test::bzip2(m.text)}) {
      const Result<Problem> result = parse_bal(bytes, "f");
      ASSERT_FALSE(result.ok()) << m.name;
      EXPECT_EQ(std::string(result.error().what()).substr(0, m.message.size()), m.message);
    }
  }
}

TEST(BalMalformed, TheUnchangedTextIsRead) {
  for (const std::size_t window : {TokenReader::kWindowBytes, std::size_t{48}, std::size_t{24}}) {
    const Result<Problem> result = parse_bal(tiny(), "f", window);
    ASSERT_TRUE(result.ok()) << result.error().what();
    EXPECT_EQ(result.value().points, (std::vector<double>{1, 2, 3, 4, 5, 6}));
  }
}

TEST(BalMalformed, EveryCutOfTheTextIsRefused) {
  const std::string text = tiny();
  // The last line may miss its end of line; anything shorter misses a value.
  for (std::size_t size = 0; size + 2 < text.size(); ++size) {
    const Result<Problem> result = parse_bal(text.substr(0, size), "f", 48);
    ASSERT_FALSE(result.ok()) << size;
    EXPECT_EQ(result.error().code(), ErrorCode::unreadable_input);
  }
  EXPECT_TRUE(parse_bal(text.substr(0, text.size() - 1), "f").ok());
}

TEST(BalMalformed, ANumberLongerThanTheWindowIsRefused) {
  const std::string text = tiny(18, "6." + std::string(300000, '0'));
  const Result<Problem> result = parse_bal(text, "f");
  ASSERT_FALSE(result.ok());
  EXPECT_STREQ(
      result.error().what(),
      "f:18: found a value of more than 262144 bytes, expected a finite number, Z of point "
      "1 (of 2)");
}

}  // namespace
}  // namespace sheaf
