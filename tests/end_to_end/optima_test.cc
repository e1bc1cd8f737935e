// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

struct Optimum {
  const char* name;
  double initial_cost;
  double final_cost;
  double relative;  ///< how far above `final_cost` is still good
  const char* iterations;
};

class KnownOptima : public testing::TestWithParam<Optimum> {};

// Costs that other solvers and our own earlier runs have reached.
TEST_P(KnownOptima, AreReached) {
  const Optimum& known = GetParam();
  const std::string path = real_problem(known.name);
  if (path.empty()) GTEST_SKIP() << known.name << " is not in $SHEAF_DATA/bal";
  TemporaryFolder folder;
  const Outcome outcome =
      run_command({"solve", path, "-o", "o.txt", "--json", "o.json", "--tolerance", "1e-13",
                   "--max-iterations", known.iterations},
                  folder.path());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  const auto json = json_of(folder / "o.json");
  EXPECT_NEAR(json["initial_cost"].get<double>(), known.initial_cost, 1e-8 * known.initial_cost);
  EXPECT_LE(json["final_cost"].get<double>(), known.final_cost * (1 + known.relative));
  const double plain = json["plain_cost"]["after"];
  EXPECT_NEAR(plain, json["final_cost"].get<double>(), 1e-10 * plain);
}

INSTANTIATE_TEST_SUITE_P(
    RealData, KnownOptima,
    testing::Values(Optimum{"dubrovnik-16-22106-pre.txt", 4.185659518e6, 18033.9035, 1e-7, "50"},
                    Optimum{"trafalgar-21-11315-pre.txt", 4.413239314e6, 30378.636, 1e-6, "50"},
                    Optimum{"ladybug-49-7776-pre.txt", 8.509124607e5, 13345, 0, "100"}),
    [](const auto& info) {
      return std::string(info.param.name).substr(0, std::string(info.param.name).find('-'));
    });

TEST(RealData, ObservationsBehindTheirCameraAreCounted) {
  const std::string path = real_problem("ladybug-49-7776-pre.txt");
  if (path.empty()) GTEST_SKIP() << "ladybug-49 is not in $SHEAF_DATA/bal";
  TemporaryFolder folder;
  ASSERT_EQ(run_command({"solve", path, "--json", "o.json", "--max-iterations", "3"}, folder.path())
                .exit_code,
            0);
  EXPECT_EQ(json_of(folder / "o.json")["behind_camera"]["before"]["count"], 31);
}

}  // namespace
}  // namespace sheaf
