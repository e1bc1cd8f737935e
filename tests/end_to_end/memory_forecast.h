// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <string>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf::test {

// Sanitizers keep memory of their own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
inline constexpr bool kSanitized =
    __has_feature(address_sanitizer) || __has_feature(thread_sanitizer);
#else
inline constexpr bool kSanitized = false;
#endif

/// Huge pages given unasked make heaps and stacks larger than what is asked for.
inline bool huge_pages_unasked() {
  std::string text;
  std::ifstream file("/sys/kernel/mm/transparent_hugepage/enabled");
  std::getline(file, text);
  return text.find("[always]") != std::string::npos;
}

/// Runs the command and holds its forecast against the peak that it measures.
class MemoryForecast : public testing::Test {
 protected:
  void SetUp() override {
    if (kSanitized) GTEST_SKIP() << "sanitizers keep memory of their own";
    if (huge_pages_unasked()) GTEST_SKIP() << "this system gives huge pages unasked";
  }

  /// What is solved from then on; `name`: of the file or folder.
  void generate(const std::vector<std::string>& size, const std::string& name = "in.txt") {
    name_ = name;
    std::vector<std::string> words = {"generate", name};
    words.insert(words.end(), size.begin(), size.end());
    const Outcome outcome = run_command(words, folder_.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  }

  /// The document of a solve with so many threads.
  nlohmann::json solve(const std::string& threads, const std::vector<std::string>& options) {
    std::vector<std::string> words = {"solve",  name_,      "--threads", threads,
                                      "--json", "out.json", "--quiet"};
    words.insert(words.end(), options.begin(), options.end());
    const Outcome outcome = run_command(words, folder_.path());
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.exit_code == 0 ? json_of(folder_ / "out.json") : nlohmann::json();
  }

  static void expect_within_a_fifth(const nlohmann::json& memory, const std::string& what) {
    const double forecast = memory["forecast_bytes"], peak = memory["peak_bytes"];
    EXPECT_LT(forecast, 1.2 * peak) << what;
    EXPECT_GT(forecast, 0.8 * peak) << what;
  }

  /// Solves as far as the step that goes on in double, if there is one.
  void expect_within_a_fifth(const std::string& solver, const std::string& precision,
                             const std::string& threads,
                             const std::vector<std::string>& more = {}) {
    std::vector<std::string> options = {"--solver", solver, "--precision", precision};
    options.insert(options.end(), more.begin(), more.end());
    const nlohmann::json made = solve(threads, options);
    ASSERT_FALSE(made.is_null());
    expect_within_a_fifth(made["memory"],
                          name_ + ", " + solver + ", " + precision + ", " + threads + " threads");
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
  std::string name_;
};

}  // namespace sheaf::test
