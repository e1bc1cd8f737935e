// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Forecasts of problems with lenses of any model: own lenses, a shared one, several, one and two
// blocks each.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "end_to_end/memory_forecast.h"

namespace sheaf {
namespace {

class LensMemoryForecast : public test::MemoryForecast {
 protected:
  /// A scene of so many images for each kind of lenses in turn, and every solver's forecast.
  void expect_all_within_a_fifth(const std::string& images, const std::string& points,
                                 const std::vector<std::string>& threads) {
    const std::vector<std::vector<std::string>> lenses = {{"OPENCV"},
                                                          {"OPENCV", "--shared"},
                                                          {"OPENCV_FISHEYE"},
                                                          {"OPENCV_FISHEYE", "--lenses", "3"},
                                                          {"FULL_OPENCV", "--shared"},
                                                          {"PINHOLE"}};
    for (std::size_t i = 0; i < lenses.size(); ++i) {
      std::vector<std::string> words = {"--cameras", images, "--points", points, "--camera"};
      words.insert(words.end(), lenses[i].begin(), lenses[i].end());
      generate(words, "model" + std::to_string(i));
      for (const std::string& count : threads) expect_solvers(count);
    }
  }

  void expect_solvers(const std::string& threads) {
    // Where conjugate gradients go on in double is beyond these steps.
    const std::vector<std::string> few = {"--max-iterations", "4"};
    for (const char* solver : {"dense", "sparse", "iterative-explicit", "iterative-implicit"})
      expect_within_a_fifth(solver, "double", threads, few);
    expect_within_a_fifth("iterative-implicit", "mixed", threads, few);
  }
};

TEST_F(LensMemoryForecast, OfASmallModelIsWithinAFifthOfThePeak) {
  expect_all_within_a_fifth("12", "2000", {"1", "2"});
}

TEST_F(LensMemoryForecast, OfALargerModelIsWithinAFifthOfThePeak) {
  expect_all_within_a_fifth("70", "16000", {"2"});
}

TEST_F(LensMemoryForecast, OfManyImagesWithTheirOwnLensesIsWithinAFifthOfThePeak) {
  generate({"--cameras", "130", "--points", "16000", "--camera", "OPENCV"}, "model");
  expect_solvers("2");
}

TEST_F(LensMemoryForecast, HoldsWithALossWithPointsHeldAndByDefault) {
  for (bool shared : {true, false}) {
    std::vector<std::string> words = {"--cameras", "70", "--points", "16000", "--camera", "OPENCV"};
    if (shared) words.push_back("--shared");
    generate(words, shared ? "shared" : "own");
    for (const std::vector<std::string>& options :
         std::vector<std::vector<std::string>>{{"--loss", "huber"},
                                               {"--fix", "points"},
                                               {"--fix", "intrinsics"},
                                               {"--fix", "poses"},
                                               {}})
      expect_within_a_fifth("auto", "auto", "2", options);
  }
}

TEST_F(LensMemoryForecast, ALimitLeadsToTheImplicitSolver) {
  generate({"--cameras", "70", "--points", "16000", "--camera", "OPENCV", "--shared"}, "model");
  const nlohmann::json free = solve("2", {"--max-iterations", "2"});
  ASSERT_NE(free["solver"]["name"], "iterative-implicit");
  const std::uint64_t needed = free["memory"]["forecast_bytes"], limit = needed * 3 / 4;
  const nlohmann::json lean =
      solve("2", {"--max-iterations", "2", "--memory-limit", std::to_string(limit)});
  EXPECT_EQ(lean["solver"]["name"], "iterative-implicit");
  const std::string reason = lean["solver"]["reason"];
  EXPECT_NE(reason.find("over the limit"), std::string::npos) << reason;
  EXPECT_LE(lean["memory"]["peak_bytes"].get<std::uint64_t>(), limit);
  expect_within_a_fifth(lean["memory"], "under a limit");
  const Outcome refused = run_command(
      {"solve", "model", "--quiet", "--memory-limit", std::to_string(needed / 8)}, folder_.path());
  EXPECT_EQ(refused.exit_code, 5);
  EXPECT_NE(refused.err.find("over the limit"), std::string::npos) << refused.err;
}

}  // namespace
}  // namespace sheaf
