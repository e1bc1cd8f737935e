// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/options_page.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

namespace sheaf {
namespace {

TEST(OptionsPage, IsTheDocument) {
  std::ifstream file(std::string(SHEAF_SOURCE_DIR) + "/docs/options.md");
  const std::string document((std::istreambuf_iterator<char>(file)), {});
  EXPECT_TRUE(document == options_page())
      << "docs/options.md is not what the tables say: sheaf --options > docs/options.md";
}

}  // namespace
}  // namespace sheaf
