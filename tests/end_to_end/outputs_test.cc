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

TEST_F(Outputs, OfImagesAreNoInputs) {
  ASSERT_EQ(run({"generate", "images", "--photometric", "--points", "50"}).exit_code, 0);
  fs::create_directory_symlink("images", folder_ / "link");
  expect_refused({"photometric", "images", "-o", "link/"}, "-o names link/");
  expect_refused({"photometric", "link", "-o", "images"}, "-o names images");
  expect_refused({"photometric", "images", "--json", "link/0.png"}, "--json names link/0.png");
  expect_refused({"photometric", "images", "--ply", "images/poses.txt"},
                 "--ply names images/poses");
  expect_refused({"photometric", "images", "--pictures", "./images"}, "--pictures names ./images");
  expect_refused({"photometric", "images", "--images", "model", "--json", "model/images.bin"},
                 "--json names model/images.bin");
}

// A model of the other form, or a file, is in the way: known before anything is computed.
TEST_F(Outputs, FoldersThatCannotBeReplacedAreKnownBeforeTheSolve) {
  const auto expect_in_the_way = [&](const std::string& out, const std::string& words) {
    const Outcome outcome = run({"solve", "model", "-o", out});
    EXPECT_EQ(outcome.exit_code, 6) << words;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(outcome.err.find("iteration"), std::string::npos) << outcome.err;
  };
  ASSERT_EQ(run({"convert", "model", "text", "--format", "colmap-text"}).exit_code, 0);
  expect_in_the_way("text", "cameras.txt");
  fs::create_directory(folder_ / "rigs");
  write_text(folder_ / "rigs/rigs.bin", "of another model");
  expect_in_the_way("rigs/", "rigs.bin");
  write_text(folder_ / "file", "precious");
  expect_in_the_way("file", "no folder");
  EXPECT_EQ(contents_of(folder_ / "file"), "precious");
}

// Into a folder that is there: all of the model, and what else is in it stays.
TEST_F(Outputs, OntoAFolderReplaceItWhole) {
  fs::create_directory(folder_ / "out");
  write_text(folder_ / "out/notes.txt", "mine");
  for (int i = 0; i < 2; ++i) {
    const Outcome outcome = run({"solve", "model", "-o", "out/", "--max-iterations", "2"});
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    EXPECT_EQ(contents_of(folder_ / "out/notes.txt"), "mine");
    EXPECT_EQ(run({"info", "out"}).exit_code, 0);
  }
  EXPECT_EQ(folder_.names(), (std::vector<std::string>{"in.txt", "model", "out"}));
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
