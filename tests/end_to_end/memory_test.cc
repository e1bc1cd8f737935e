// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "end_to_end/memory_forecast.h"

namespace sheaf {
namespace {

using test::MemoryForecast;

TEST_F(MemoryForecast, OfASmallSceneIsWithinAFifthOfThePeak) {
  generate({"--cameras", "12", "--points", "2000"});
  expect_all_within_a_fifth();
}

TEST_F(MemoryForecast, OfACollectionIsWithinAFifthOfThePeak) {
  generate({"--cameras", "70", "--points", "20000", "--family", "collection"});
  expect_all_within_a_fifth();
}

TEST_F(MemoryForecast, OfAStreetIsWithinAFifthOfThePeak) {
  generate({"--cameras", "200", "--points", "15000", "--family", "street"});
  expect_all_within_a_fifth();
}

TEST_F(MemoryForecast, HoldsWithALossAndWithPointsHeld) {
  generate({"--cameras", "70", "--points", "20000"});
  expect_within_a_fifth("auto", "auto", "2", {"--loss", "huber"});
  expect_within_a_fifth("auto", "auto", "2", {"--fix", "points"});
  expect_within_a_fifth("iterative-implicit", "mixed", "2", {"--loss", "cauchy:2"});
}

TEST_F(MemoryForecast, OfImagesIsWithinAFifthOfThePeak) {
  struct Case {
    std::vector<std::string> scene, options;
  };
  const std::vector<Case> cases = {
      {{"--points", "2000"}, {}},
      {{"--points", "20000", "--cameras", "10"}, {"--threads", "1"}},
      {{"--points", "20000", "--cameras", "4"}, {"--points", "xyz"}},
      {{"--points", "5000"}, {"--levels", "3", "--pattern", "9x9", "--threads", "2"}}};
  for (const Case& of : cases) {
    std::vector<std::string> make = {"generate", "images", "--photometric"};
    make.insert(make.end(), of.scene.begin(), of.scene.end());
    ASSERT_EQ(run_command(make, folder_.path()).exit_code, 0);
    std::vector<std::string> words = {"photometric", "images",           "--json", "out.json",
                                      "--quiet",     "--max-iterations", "5"};
    words.insert(words.end(), of.options.begin(), of.options.end());
    const Outcome outcome = run_command(words, folder_.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const nlohmann::json memory = json_of(folder_ / "out.json")["memory"];
    expect_within_a_fifth(memory, of.scene[1] + " points");
  }
}

}  // namespace
}  // namespace sheaf
