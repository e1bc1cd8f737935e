// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/json_lines.h"

#include <gtest/gtest.h>

#include <string>

namespace sheaf {
namespace {

// So many that to count each one's lines from the beginning would take many seconds.
TEST(JsonLines, EachOfManyValuesKnowsItsLine) {
  constexpr std::size_t kValues = 50000;
  std::string text = "{\"list\": [";
  for (std::size_t i = 0; i < kValues; ++i) text += (i == 0 ? "\n" : ",\n") + std::to_string(i);
  const JsonValue root = parse_json(text + "]\n}", "j").value();
  const JsonValue* list = root.find("list");
  ASSERT_NE(list, nullptr);
  ASSERT_EQ(list->items.size(), kValues);
  for (std::size_t i = 0; i < kValues; ++i) EXPECT_EQ(list->items[i].line, i + 2);
  const Result<JsonValue> broken = parse_json(text + "}", "j");
  ASSERT_FALSE(broken.ok());
  EXPECT_TRUE(std::string(broken.error().what()).starts_with("j:50001: found '}'"))
      << broken.error().what();
}

}  // namespace
}  // namespace sheaf
