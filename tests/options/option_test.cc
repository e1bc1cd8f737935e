// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/option.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

namespace sheaf {
namespace {

using Items = std::vector<std::string>;

OptionSpec spec_of(OptionKind kind, OptionRange range = {}) {
  OptionSpec spec{.name = "x", .range = range};
  spec.kind = kind;
  return spec;
}

std::string refusal(const OptionSpec& spec, const std::string& text) {
  const Result<OptionValue> value = parse(spec, text);
  if (value.ok()) return "accepted as " + text_of(value.value());
  EXPECT_EQ(value.error().code(), ErrorCode::usage);
  return value.error().what();
}

TEST(Option, NumbersAreReadWholeAndWithinTheirRange) {
  const OptionSpec whole = spec_of(OptionKind::whole, from(1));
  EXPECT_EQ(parse(whole, "17").value(), OptionValue(std::int64_t{17}));
  for (const char* text : {"0", "-1", "2.5", "many", "", " 3", "3 ", "99999999999999999999"})
    EXPECT_EQ(refusal(whole, text),
              std::string("expected a whole number from 1 up, not '") + text + "'");
  const OptionSpec real = spec_of(OptionKind::real, above(0));
  EXPECT_EQ(parse(real, "1e-9").value(), OptionValue(1e-9));
  for (const char* text : {"0", "-1e-8", "nan", "inf", "1e999", "1,5"})
    EXPECT_EQ(refusal(real, text), std::string("expected a number above 0, not '") + text + "'");
  EXPECT_EQ(refusal(spec_of(OptionKind::real, between(-1, 1)), "1.01"),
            "expected a number from -1 to 1, not '1.01'");
}

TEST(Option, MessagesSayUnitAndLimit) {
  OptionSpec spec = spec_of(OptionKind::whole, from(1));
  spec.unit = "px";
  spec.range.highest = std::numeric_limits<int>::max();
  EXPECT_EQ(refusal(spec, "0"), "expected a whole number of pixels from 1 up, not '0'");
  EXPECT_EQ(refusal(spec, "3000000000"),
            "expected a whole number of pixels from 1 to 2147483647, not '3000000000'");
}

TEST(Option, BytesHaveUnits) {
  const OptionSpec spec = spec_of(OptionKind::bytes, from(0));
  const auto bytes = [&](const char* text) {
    return std::get<std::int64_t>(parse(spec, text).value());
  };
  EXPECT_EQ(bytes("0"), 0);
  EXPECT_EQ(bytes("1000"), 1000);
  EXPECT_EQ(bytes("12b"), 12);
  for (const char* text : {"3k", "3K", "3kb", "3 KB", "3KiB", "3ki"}) EXPECT_EQ(bytes(text), 3072);
  EXPECT_EQ(bytes("500M"), 524288000);
  EXPECT_EQ(bytes("2G"), std::int64_t{1} << 31);
  EXPECT_EQ(bytes("7e"), std::int64_t{7} << 60);
  for (const char* text : {"", "G", "2X", "2gg", "1.5G", "-1", "8E", "2G3", "99999999999999999999"})
    EXPECT_NE(refusal(spec, text).find("as 500M or 2G"), std::string::npos) << text;
}

TEST(Option, NamesAreThoseOfTheChoices) {
  OptionSpec spec = spec_of(OptionKind::choice);
  spec.choices = {{"lm", "more damping"}, {"dogleg", ""}};
  EXPECT_EQ(parse(spec, "dogleg").value(), OptionValue(std::string("dogleg")));
  for (const char* text : {"", "LM", "dog"})
    EXPECT_EQ(refusal(spec, text), std::string("expected one of lm, dogleg, not '") + text + "'");
  spec.help = "what follows";
  EXPECT_EQ(help_text(spec), "what follows: lm (more damping) or dogleg");
}

TEST(Option, NothingIsSaidAsNone) {
  OptionSpec spec = spec_of(OptionKind::real, above(0));
  EXPECT_NE(refusal(spec, "none").find("above 0"), std::string::npos);
  spec.nothing = true;
  EXPECT_EQ(parse(spec, "none").value(), OptionValue());
  EXPECT_EQ(text_of(OptionValue()), "none");
  EXPECT_TRUE(accept(spec, {}).ok());
}

TEST(Option, ListsAreCutAtCommasThatNoBackslashKeeps) {
  const OptionSpec spec = spec_of(OptionKind::list);
  const OptionValue items = Items{"a", "b,c", "", "d\\"};
  EXPECT_EQ(parse(spec, "a,b\\,c,,d\\").value(), items);
  EXPECT_EQ(text_of(items), "a,b\\,c,,d\\");
}

TEST(Option, FormsAreAskedOfEachItem) {
  OptionSpec spec = spec_of(OptionKind::list);
  spec.wrong = [](const std::string& text) { return text == "b" ? "no b" : ""; };
  EXPECT_EQ(refusal(spec, "a,b"), "no b");
  spec.kind = OptionKind::text;
  EXPECT_EQ(refusal(spec, "b"), "no b");
  EXPECT_TRUE(parse(spec, "a,b").ok());
}

TEST(Option, ValuesOfAnotherKindAreRefused) {
  EXPECT_FALSE(accept(spec_of(OptionKind::whole, from(0)), 2.0).ok());
  EXPECT_FALSE(accept(spec_of(OptionKind::real, from(0)), std::int64_t{2}).ok());
  EXPECT_FALSE(accept(spec_of(OptionKind::flag), std::string("true")).ok());
  EXPECT_FALSE(accept(spec_of(OptionKind::text), OptionValue()).ok());
  EXPECT_EQ(parse(spec_of(OptionKind::flag), "true").value(), OptionValue(true));
  EXPECT_EQ(refusal(spec_of(OptionKind::flag), "1"), "expected true or false, not '1'");
}

TEST(Option, KeysEndWithTheUnit) {
  OptionSpec spec{.name = "time-limit", .unit = "s"};
  EXPECT_EQ(key_of(spec), "time_limit_s");
  EXPECT_EQ(identifier_of(spec), "time_limit");
  spec.key = "limit";
  EXPECT_EQ(key_of(spec), "limit");
}

}  // namespace
}  // namespace sheaf
