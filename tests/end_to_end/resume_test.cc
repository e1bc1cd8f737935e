// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <signal.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

using Words = std::vector<std::string>;

/// Killed at any step, so that nothing of its own runs any more, and gone on with by another
/// process: the bytes of the run that was not stopped.
TEST(Resume, AKilledRunEndsWithTheBytesOfAWholeOne) {
  TemporaryFolder folder;
  const auto run = [&](const Words& words) { return run_command(words, folder.path()); };
  ASSERT_EQ(
      run({"generate", "in.txt", "--family", "street", "--cameras", "150", "--points", "6000"})
          .exit_code,
      0);
  const Words solve = {"solve", "in.txt", "--tolerance", "1e-12", "--loss", "huber:auto"};
  const auto with = [&](Words more) {
    Words words = solve;
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  ASSERT_EQ(run(with({"-o", "whole.txt"})).exit_code, 0);
  const std::string whole = bytes_of(folder / "whole.txt");
  for (const char* step : {"iteration 2:", "iteration 5:", "iteration 9:"}) {
    SCOPED_TRACE(step);
    RunningCommand killed(
        with({"-o", "out.txt", "--checkpoint", "run.checkpoint", "--checkpoint-every", "0"}),
        folder.path());
    ASSERT_TRUE(killed.wait_for_stderr(step));
    killed.send(SIGKILL);
    ASSERT_EQ(killed.wait().exit_code, 1000 + SIGKILL);
    const Outcome resumed =
        run(with({"-o", "out.txt", "--resume", "run.checkpoint", "--threads", "1", "--checkpoint",
                  "run.checkpoint", "--json", "resumed.json"}));
    ASSERT_EQ(resumed.exit_code, 0) << resumed.err;
    EXPECT_NE(resumed.out.find("resumed     after step"), std::string::npos) << resumed.out;
    EXPECT_TRUE(bytes_of(folder / "out.txt") == whole);
    std::filesystem::remove(folder / "out.txt");
  }
  // Interrupted, it leaves where it stood, and exits as any interrupted run does.
  RunningCommand interrupted(
      with({"-o", "out.txt", "--checkpoint", "run.checkpoint", "--checkpoint-every", "1000"}),
      folder.path());
  std::filesystem::remove(folder / "run.checkpoint");
  ASSERT_TRUE(interrupted.wait_for_stderr("iteration 3:"));
  interrupted.send(SIGTERM);
  EXPECT_EQ(interrupted.wait().exit_code, 130);
}

TEST(Resume, WhatIsNoCheckpointOfThisRunIsRefused) {
  TemporaryFolder folder;
  const auto run = [&](const Words& words) { return run_command(words, folder.path()); };
  ASSERT_EQ(run({"generate", "in.txt", "--points", "300"}).exit_code, 0);
  ASSERT_EQ(run({"generate", "other.txt", "--points", "301"}).exit_code, 0);
  ASSERT_EQ(run({"solve", "in.txt", "--checkpoint", "c", "--checkpoint-every", "0"}).exit_code, 0);
  EXPECT_EQ(run({"solve", "in.txt", "-o", "out.txt", "--resume", "c"}).exit_code, 0);
  const Outcome no_checkpoint = run({"solve", "in.txt", "-o", "o.txt", "--resume", "in.txt"});
  EXPECT_EQ(no_checkpoint.exit_code, 3);
  EXPECT_NE(no_checkpoint.err.find("in.txt: found no checkpoint of a solve"), std::string::npos);
  const Outcome other = run({"solve", "other.txt", "-o", "o.txt", "--resume", "c"});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_NE(other.err.find("c: the checkpoint is of another problem"), std::string::npos);
  const Outcome options =
      run({"solve", "in.txt", "-o", "o.txt", "--resume", "c", "--points", "xyz"});
  EXPECT_EQ(options.exit_code, 2);
  EXPECT_NE(options.err.find("--points auto, this one has xyz"), std::string::npos) << options.err;
  EXPECT_EQ(run({"solve", "in.txt", "-o", "c", "--resume", "c"}).exit_code, 2) << "its own input";
  EXPECT_FALSE(std::filesystem::exists(folder / "o.txt"));
}

}  // namespace
}  // namespace sheaf
