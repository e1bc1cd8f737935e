// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <string>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

class EvaluateCommand : public testing::Test {
 protected:
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
#ifdef SHEAF_PYTHON
  void expect_independent_code_agrees(const std::string& estimate, const std::string& reference,
                                      bool raw) {
    std::vector<std::string> words = {"evaluate", estimate, reference, "--json",
                                      "e.json",   "--csv",  "e.csv"};
    if (raw) words.push_back("--no-align");
    const Outcome outcome = run(words);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::string said = folder_ / "said.txt";
    const std::string line =
        SHEAF_PYTHON " " SHEAF_SOURCE_DIR "/tests/end_to_end/independent_errors.py '" +
        folder_.path().string() + "/" + estimate + "' '" + folder_.path().string() + "/" +
        reference + "' '" + (folder_ / "e.json") + "' '" + (folder_ / "e.csv") + "'" +
        (raw ? " --raw" : "") + " > '" + said + "' 2>&1";
    EXPECT_EQ(std::system(line.c_str()), 0) << contents_of(said);
  }
  bool has_numpy() { return std::system(SHEAF_PYTHON " -c 'import numpy' 2>/dev/null") == 0; }
#endif
  TemporaryFolder folder_;
};

#ifdef SHEAF_PYTHON
TEST_F(EvaluateCommand, AgreesWithIndependentCode) {
  if (!has_numpy()) GTEST_SKIP() << "NumPy is not there";
  ASSERT_EQ(
      run({"generate", "start.txt", "--cameras", "30", "--points", "600", "--truth", "truth.txt"})
          .exit_code,
      0);
  ASSERT_EQ(run({"solve", "start.txt", "-o", "solved.txt"}).exit_code, 0);
  // Another place, scale and noise of every kind.
  ASSERT_EQ(run({"perturb", "truth.txt", "far.txt", "--normalize", "37", "--rotation", "0.3",
                 "--center", "4", "--point", "7"})
                .exit_code,
            0);
  for (const char* estimate : {"start.txt", "solved.txt", "far.txt"})
    for (const bool raw : {false, true}) expect_independent_code_agrees(estimate, "truth.txt", raw);
}

TEST_F(EvaluateCommand, AgreesWithIndependentCodeOnRealData) {
  const std::string path = real_problem("dubrovnik-16-22106-pre.txt");
  if (path.empty() || !has_numpy())
    GTEST_SKIP() << "no dubrovnik-16 in $SHEAF_DATA/bal, or no NumPy";
  std::filesystem::create_symlink(path, folder_ / "d.txt");
  ASSERT_EQ(run({"solve", "d.txt", "-o", "solved.txt"}).exit_code, 0);
  ASSERT_EQ(run({"perturb", "d.txt", "p.txt", "--protocol", "ceres", "--rotation", "0.1",
                 "--translation", "0.5", "--point", "0.5"})
                .exit_code,
            0);
  expect_independent_code_agrees("d.txt", "solved.txt", false);
  expect_independent_code_agrees("p.txt", "d.txt", false);
  expect_independent_code_agrees("p.txt", "d.txt", true);
}
#endif

TEST_F(EvaluateCommand, SaysTheCoursesWords) {
  ASSERT_EQ(run({"generate", "start.txt", "--points", "300", "--truth", "truth.txt"}).exit_code, 0);
  const Outcome outcome = run({"evaluate", "start.txt", "truth.txt", "--csv", "e.csv"});
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* words : {"Mean rot error", "Mean trans error", "camera centre", "point"})
    EXPECT_NE(outcome.out.find(words), std::string::npos) << outcome.out;
  const std::string csv = contents_of(folder_ / "e.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 17);
}

TEST_F(EvaluateCommand, AFileIsItselfWithoutError) {
  ASSERT_EQ(run({"generate", "s.txt", "--points", "300"}).exit_code, 0);
  ASSERT_EQ(run({"evaluate", "s.txt", "s.txt", "--no-align", "--json", "e.json"}).exit_code, 0);
  const nlohmann::json document = json_of(folder_ / "e.json");
  EXPECT_EQ(document["aligned"], false);
  EXPECT_EQ(document["scale"], 1);
  EXPECT_TRUE(document["alignment"].is_null());
  for (const char* kind : {"translation_error", "center_error", "point_error"})
    EXPECT_EQ(document[kind]["max"], 0) << kind;
  EXPECT_LT(document["rotation_error_rad"]["max"], 1e-15);
}

TEST_F(EvaluateCommand, RefusesOtherScenes) {
  ASSERT_EQ(run({"generate", "a.txt", "--points", "300"}).exit_code, 0);
  ASSERT_EQ(run({"generate", "b.txt", "--points", "301"}).exit_code, 0);
  const Outcome outcome = run({"evaluate", "a.txt", "b.txt"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("300 points"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace sheaf
