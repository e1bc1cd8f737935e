// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

#ifdef SHEAF_PYTHON
/// Solves and lets the script evaluate what was written.
void expect_costs_agree(const TemporaryFolder& folder, const std::string& input) {
  const Outcome outcome =
      run_command({"solve", input, "-o", "solved.txt", "--json", "solve.json"}, folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = json_of(folder / "solve.json");
  const std::string script =
      SHEAF_PYTHON " " SHEAF_SOURCE_DIR "/tests/end_to_end/independent_cost.py";
  for (const auto& [file, cost] : {std::pair{input, json["initial_cost"].dump()},
                                   std::pair{folder / "solved.txt", json["final_cost"].dump()}}) {
    const std::string said = folder / "said.txt";
    const int status =
        std::system((script + " '" + file + "' " + cost + " > '" + said + "' 2>&1").c_str());
    EXPECT_EQ(status, 0) << contents_of(said);
  }
}

TEST(IndependentCost, AgreesOnAGeneratedScene) {
  TemporaryFolder folder;
  ASSERT_EQ(
      run_command({"generate", "in.txt", "--cameras", "15", "--points", "2000"}, folder.path())
          .exit_code,
      0);
  expect_costs_agree(folder, folder / "in.txt");
}

TEST(IndependentCost, AgreesOnRealData) {
  for (const char* name : {"dubrovnik-16-22106-pre.txt", "ladybug-49-7776-pre.txt"}) {
    const std::string path = real_problem(name);
    if (path.empty()) GTEST_SKIP() << name << " is not in $SHEAF_DATA/bal";
    TemporaryFolder folder;
    expect_costs_agree(folder, path);
  }
}

TEST(IndependentCost, TellsAWrongClaim) {
  TemporaryFolder folder;
  ASSERT_EQ(run_command({"generate", "in.txt", "--points", "100"}, folder.path()).exit_code, 0);
  const std::string script =
      SHEAF_PYTHON " " SHEAF_SOURCE_DIR "/tests/end_to_end/independent_cost.py";
  EXPECT_NE(std::system((script + " '" + (folder / "in.txt") + "' 1.0 > /dev/null 2>&1").c_str()),
            0);
}
#endif

}  // namespace
}  // namespace sheaf
