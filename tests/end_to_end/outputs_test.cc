// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "end_to_end/command.h"

// What a verb writes is never what it reads, whatever it is called, and what cannot be written is
// known before anything is computed.
namespace sheaf {
namespace {

namespace fs = std::filesystem;

class Outputs : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run({"generate", "in.txt", "--points", "200"}).exit_code, 0);
    ASSERT_EQ(run({"generate", "model", "--camera", "OPENCV", "--points", "200"}).exit_code, 0);
    before_ = contents_of(folder_ / "in.txt");
  }
  Outcome run(const std::vector<std::string>& arguments) {
    return run_command(arguments, folder_.path());
  }
  void expect_refused(const std::vector<std::string>& arguments, const std::string& words) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << words;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.out, "") << words;
    EXPECT_EQ(contents_of(folder_ / "in.txt"), before_);
  }
  TemporaryFolder folder_;
  std::string before_;
};

TEST_F(Outputs, AreNoInputs) {
  expect_refused({"solve", "in.txt", "--json", "in.txt"}, "--json names in.txt");
  expect_refused({"solve", "in.txt", "-o", "./in.txt"}, "-o names ./in.txt");
  expect_refused({"convert", "in.txt", "in.txt"}, "OUT names in.txt");
  expect_refused({"perturb", "in.txt", "in.txt"}, "OUT names in.txt");
  expect_refused({"evaluate", "model", "in.txt", "--csv", "in.txt"}, "--csv names in.txt");
  expect_refused({"info", "in.txt", "--json", "in.txt"}, "--json names in.txt");
  expect_refused({"check", "in.txt", "--json", "in.txt"}, "--json names in.txt");
  expect_refused({"covariance", "in.txt", "--csv", "in.txt"}, "--csv names in.txt");
  expect_refused({"compare", "in.txt", "--json", "in.txt"}, "--json names in.txt");
  expect_refused({"align", "model", "-o", "out", "--reference", "in.txt", "--json", "in.txt"},
                 "--json names in.txt");
}

TEST_F(Outputs, AreNoInputsByOtherNames) {
  fs::create_symlink("in.txt", folder_ / "link.txt");
  fs::create_hard_link(folder_ / "in.txt", folder_ / "hard.txt");
  fs::create_directory_symlink(".", folder_ / "here");
  for (const char* name : {"link.txt", "hard.txt", "here/in.txt", "model/../in.txt"})
    expect_refused({"solve", "in.txt", "-o", name}, std::string("-o names ") + name);
  expect_refused({"solve", "link.txt", "--ply", "in.txt"}, "--ply names in.txt");
}

TEST_F(Outputs, AreNoFilesOfAnInputFolder) {
  expect_refused({"solve", "model", "-o", "model/"}, "-o names model/");
  expect_refused({"solve", "model", "--json", "model/cameras.bin"},
                 "--json names model/cameras.bin");
  const Outcome beside = run({"solve", "model", "-o", "out/", "--json", "model/summary.json"});
  EXPECT_EQ(beside.exit_code, 0) << beside.err;
}

TEST_F(Outputs, ThatNothingNamesAreRefused) {
  expect_refused({"solve", "in.txt", "-o", ""}, "found an empty text");
  expect_refused({"solve", "in.txt", "--json", ""}, "found an empty text");
}

TEST_F(Outputs, ThatCannotHoldTheLensesAreRefusedBeforeTheSolve) {
  expect_refused({"solve", "model", "-o", "out.nvm"}, "NVM");
  expect_refused({"solve", "model", "-o", "out.txt"}, "bal cannot hold");
  expect_refused({"solve", "model", "-o", "out.problem"}, "libmv");
  EXPECT_FALSE(fs::exists(folder_ / "out.nvm"));
}

TEST_F(Outputs, CountsBeyondReasonAreClamped) {
  const Outcome outcome = run({"solve", "in.txt", "--threads", "100000"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("100000 threads are more than the most, 512"), std::string::npos)
      << outcome.out;
}

}  // namespace
}  // namespace sheaf
