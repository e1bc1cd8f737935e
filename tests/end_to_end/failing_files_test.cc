// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#if defined(SHEAF_FAILING_FILES)
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

using Words = std::vector<std::string>;

/// A run and the one file that it writes.
struct Writing {
  Words command;
  std::string target;
};

// Every call that a run makes to open, write, keep or rename what it writes fails once: each of
// these runs ends with exit code 6 and one sentence, the target is the old file or the new one, and
// nothing else is left.
class FailingFiles : public testing::TestWithParam<Writing> {};

TEST_P(FailingFiles, EndWithSixAndTheOldFileOrTheNewOne) {
  const auto& [command, target] = GetParam();
  TemporaryFolder folder;
  ASSERT_EQ(run_command({"generate", "in.txt", "--points", "20"}, folder.path()).exit_code, 0);
  ASSERT_EQ(run_command(command, folder.path()).exit_code, 0);
  const std::string after = contents_of(folder / target);
  const Words names = folder.names();
  int failed = 0;
  for (long n = 1;; ++n) {
    ASSERT_LT(n, 1000);
    write_text(folder / target, "before");
    std::string words = "SHEAF_FAILING_FILE_CALL=" + std::to_string(n) + " " SHEAF_FAILING_FILES;
    for (const std::string& word : command) words += " " + word;
    const Outcome outcome = run_program("/bin/sh", {"-c", words}, folder.path());
    const std::string now = contents_of(folder / target);
    EXPECT_EQ(folder.names(), names) << "call " << n;
    if (outcome.exit_code == 0) {
      EXPECT_EQ(now, after);
      break;
    }
    ++failed;
    ASSERT_EQ(outcome.exit_code, 6) << "call " << n << ": " << outcome.err;
    EXPECT_TRUE(now == "before" || now == after) << "call " << n;
    EXPECT_NE(outcome.err.find(target), std::string::npos) << n << ": " << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
  EXPECT_GE(failed, 4);  // it is opened, written, kept and renamed at least
}

/// A folder's files, one after another.
std::string contents_of_model(const std::string& folder) {
  std::string out;
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"})
    out += contents_of(std::filesystem::path(folder) / name);
  return out;
}

/// Where the exchange of two folders fails, the files go one by one: exit code 0 then.
TEST(FailingFilesOfFolders, LeaveTheOldModelOrTheNewOne) {
  TemporaryFolder folder;
  for (const Words& command :
       {Words{"generate", "old", "--camera", "PINHOLE", "--points", "20"},
        Words{"generate", "in", "--camera", "PINHOLE", "--points", "30", "--seed", "3"},
        Words{"convert", "in", "out"}})
    ASSERT_EQ(run_command(command, folder.path()).exit_code, 0);
  const std::string before = contents_of_model(folder / "old"),
                    after = contents_of_model(folder / "out");
  const Words names = folder.names();
  int failed = 0, done = 0;
  for (int n = 1; n <= 24; ++n) {
    std::filesystem::remove_all(folder / "out");
    std::filesystem::copy(folder / "old", folder / "out", std::filesystem::copy_options::recursive);
    const Outcome outcome =
        run_program("/bin/sh",
                    {"-c", "SHEAF_FAILING_FILE_CALL=" + std::to_string(n) +
                               " " SHEAF_FAILING_FILES " convert in out --quiet"},
                    folder.path());
    const std::string now = contents_of_model(folder / "out");
    EXPECT_EQ(folder.names(), names) << "call " << n;
    ++(outcome.exit_code == 0 ? done : failed);
    if (outcome.exit_code == 0) {
      EXPECT_EQ(now, after) << "call " << n;
    } else {
      EXPECT_EQ(outcome.exit_code, 6) << "call " << n << ": " << outcome.err;
      EXPECT_TRUE(now == before || now == after) << "call " << n;
      EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    }
  }
  EXPECT_GE(failed, 8);
  EXPECT_GE(done, 4);  // there are fewer calls than 20
}

INSTANTIATE_TEST_SUITE_P(
    Command, FailingFiles,
    testing::Values(
        Writing{{"generate", "out.txt", "--points", "20", "--quiet"}, "out.txt"},
        Writing{{"perturb", "in.txt", "out.txt", "--seed", "3", "--quiet"}, "out.txt"},
        Writing{{"solve", "in.txt", "-o", "out.txt", "--threads", "1", "--quiet"}, "out.txt"},
        Writing{{"convert", "in.txt", "out.txt.gz", "--quiet"}, "out.txt.gz"},
        Writing{{"convert", "in.txt", "out.out", "--quiet"}, "out.out"},
        Writing{{"covariance", "in.txt", "--csv", "out.csv", "--threads", "1", "--quiet"},
                "out.csv"}));

}  // namespace
}  // namespace sheaf
#endif
