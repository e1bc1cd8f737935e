// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if defined(SHEAF_STARVED)
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

using Words = std::vector<std::string>;

// Any one allocation may fail: the run then ends with exit code 5 and one sentence, or does
// without. Every n is too slow for a test: these are a hundred of the parsing of options, and every
// so many of what comes after it.
class Starved : public testing::TestWithParam<Words> {};

TEST_P(Starved, EndsWithFiveAndOneSentence) {
  TemporaryFolder folder;
  ASSERT_EQ(run_command({"generate", "in.txt", "--points", "20"}, folder.path()).exit_code, 0);
  int failed = 0;
  for (long n = 1, over = 0; n < 1000000 && over < 3; n += n < 24000 ? 1 + n / 10 : 67) {
    std::string words = "SHEAF_FAILING_ALLOCATION=" + std::to_string(n) + " " SHEAF_STARVED;
    for (const std::string& word : GetParam()) words += " " + word;
    const Outcome outcome = run_program("/bin/sh", {"-c", words}, folder.path());
    over = outcome.exit_code == 0 ? over + 1 : 0;
    if (outcome.exit_code == 0) continue;
    ++failed;
    ASSERT_EQ(outcome.exit_code, 5) << "allocation " << n << ": " << outcome.err;
    ASSERT_NE(outcome.err.find("memory"), std::string::npos) << n << ": " << outcome.err;
    ASSERT_EQ(outcome.err.find("terminate called"), std::string::npos) << n;
  }
  EXPECT_GT(failed, 20);
}

INSTANTIATE_TEST_SUITE_P(Command, Starved,
                         testing::Values(Words{"info", "in.txt", "--quiet"},
                                         Words{"convert", "in.txt", "model/"},
                                         Words{"solve", "in.txt", "--quiet", "--threads", "1"}));

}  // namespace
}  // namespace sheaf
#endif
