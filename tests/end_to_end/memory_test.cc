// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

// Sanitizers keep memory of their own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#elif defined(__has_feature)
constexpr bool kSanitized = __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
constexpr bool kSanitized = false;
#endif

/// Huge pages given unasked make heaps and stacks larger than what is asked for.
bool huge_pages_unasked() {
  std::string text;
  std::ifstream file("/sys/kernel/mm/transparent_hugepage/enabled");
  std::getline(file, text);
  return text.find("[always]") != std::string::npos;
}

class MemoryForecast : public testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "sanitizers keep memory of their own";
    if (huge_pages_unasked()) GTEST_SKIP() << "this system gives huge pages unasked";
  }

  void generate(const std::vector<std::string>& size) {
    std::vector<std::string> words = {"generate", "in.txt"};
    words.insert(words.end(), size.begin(), size.end());
    const Outcome outcome = run_command(words, folder_.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }

  /// Solves as far as the step that goes on in double, if there is one.
  void expect_within_a_fifth(const std::string& solver, const std::string& precision,
                             const std::string& threads,
                             const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"solve",       "in.txt",   "--solver",  solver,
                                      "--precision", precision,  "--threads", threads,
                                      "--json",      "out.json", "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run_command(words, folder_.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const nlohmann::json memory = json_of(folder_ / "out.json")["memory"];
    const double forecast = memory["forecast_bytes"], peak = memory["peak_bytes"];
    const std::string what = solver + ", " + precision + ", " + threads + " threads: forecast " +
                             std::to_string(forecast) + ", peak " + std::to_string(peak);
    EXPECT_LT(forecast, 1.2 * peak) << what;
    EXPECT_GT(forecast, 0.8 * peak) << what;
  }

  void expect_all_within_a_fifth() {
    for (const char* threads : {"1", "2"}) {
      expect_within_a_fifth("dense", "double", threads);
      expect_within_a_fifth("sparse", "double", threads);
      for (const char* precision : {"double", "mixed"}) {
        expect_within_a_fifth("iterative-explicit", precision, threads);
        expect_within_a_fifth("iterative-implicit", precision, threads);
      }
    }
  }

  TemporaryFolder folder_;
};

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
    const double forecast = memory["forecast_bytes"], peak = memory["peak_bytes"];
    const std::string what = of.scene[1] + " points: forecast " + std::to_string(forecast) +
                             ", peak " + std::to_string(peak);
    EXPECT_LT(forecast, 1.2 * peak) << what;
    EXPECT_GT(forecast, 0.8 * peak) << what;
  }
}

}  // namespace
}  // namespace sheaf
