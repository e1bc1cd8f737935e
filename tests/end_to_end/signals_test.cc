// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "end_to_end/command.h"

// What signals and streams do to the command. A shell prepares what a test cannot: ignored signals,
// closed descriptors, limits.
namespace sheaf {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;

class Signals : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(run_command({"generate", "in.txt", "--points", "200"}, folder_.path()).exit_code, 0);
  }
  /// `command` with SHEAF for the command's name.
  Outcome shell(std::string command) {
    const std::string name = command_path();
    for (std::size_t at; (at = command.find("SHEAF")) != std::string::npos;)
      command.replace(at, 5, name);
    return run_program("/bin/sh", {"-c", command}, folder_.path());
  }
  TemporaryFolder folder_;
};

TEST_F(Signals, AreAlikeWhileReading) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    RunningCommand command({"solve", "pipe", "-o", "o.txt"}, folder_.path());
    std::this_thread::sleep_for(std::chrono::milliseconds(800));
    command.send(signal);
    EXPECT_EQ(command.wait().exit_code, 130) << signal;
  }
  EXPECT_EQ(folder_.names(), (Words{"in.txt", "pipe"}));
}

TEST_F(Signals, ThatWereIgnoredStayIgnored) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);  // the command waits for who writes
  const Outcome outcome = shell(
      "trap '' HUP TERM; SHEAF solve pipe -o o.txt --quiet & "
      "sleep 0.3; kill -HUP $!; kill -TERM $!; kill -INT $!; cat in.txt > pipe; wait $!");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  EXPECT_TRUE(fs::exists(folder_ / "o.txt"));
}

// While the command waits for somebody to read what it writes into a pipe.
TEST_F(Signals, ASecondOneLeavesAtOnceAndNothingIsTorn) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0600), 0);
  write_text(folder_ / "o.txt", "precious");
  RunningCommand command({"solve", "in.txt", "-o", "pipe", "--ply", "o.ply", "--json", "o.txt"},
                         folder_.path());
  ASSERT_TRUE(command.wait_for_stderr("iteration"));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  command.send(SIGTERM);
  ASSERT_TRUE(command.wait_for_stderr("interrupted"));
  command.send(SIGHUP);
  EXPECT_EQ(command.wait().exit_code, 130);
  EXPECT_EQ(contents_of(folder_ / "o.txt"), "precious");
  EXPECT_EQ(folder_.names(), (Words{"in.txt", "o.txt", "pipe"}));
}

TEST_F(Signals, WhileAFileIsMadeRemoveWhatIsThere) {
  RunningCommand command({"generate", "big.txt", "--like", "ladybug-1723"}, folder_.path());
  for (int i = 0; i < 500 && folder_.names() == Words{"in.txt"}; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  command.send(SIGINT);
  EXPECT_EQ(command.wait().exit_code, 130);
  EXPECT_EQ(folder_.names(), Words{"in.txt"});
}

TEST_F(Signals, AFullOrClosedStderrEndsNoSolve) {
  for (const char* to : {"2>/dev/full", "2>&-", "2>&1 >/dev/null | true", "2>&- 0<&-"}) {
    const Outcome outcome = shell(std::string("SHEAF solve in.txt -o o.txt ") + to);
    EXPECT_EQ(outcome.exit_code, 0) << to << outcome.err;
    EXPECT_EQ(run_command({"info", "o.txt"}, folder_.path()).exit_code, 0) << to;
    fs::remove(folder_ / "o.txt");
  }
}

TEST_F(Signals, AStdoutThatCannotBeWrittenIsSix) {
  for (const char* words : {"solve in.txt -o o.txt --json o.json --quiet", "info in.txt", "--help",
                            "--version", "--options", "solve --help"}) {
    EXPECT_EQ(shell(std::string("SHEAF ") + words + " >/dev/full").exit_code, 6) << words;
    EXPECT_EQ(shell(std::string("SHEAF ") + words + " >&-").exit_code, 6) << words;
  }
  EXPECT_EQ(run_command({"info", "o.txt"}, folder_.path()).exit_code, 0);
  EXPECT_TRUE(json_of(folder_ / "o.json").contains("final_cost"));
  // Nobody reads: an error of writing, not the end by a signal.
  const Outcome unread = shell("(trap '' PIPE; sleep 0.2; SHEAF info in.txt; echo $? >&2) | true");
  EXPECT_NE(unread.err.find("Broken pipe\n6\n"), std::string::npos) << unread.err;
}

// Descriptor 2 is free when the file is opened: progress must not go into it.
TEST_F(Signals, ClosedDescriptorsAreNoFiles) {
  ASSERT_EQ(shell("SHEAF solve in.txt -o a.txt --quiet").exit_code, 0);
  ASSERT_EQ(shell("SHEAF solve in.txt -o b.txt 0<&- 2>&-").exit_code, 0);
  EXPECT_EQ(contents_of(folder_ / "a.txt"), contents_of(folder_ / "b.txt"));
}

TEST_F(Signals, AFileThatMayNotGrowIsSix) {
  write_text(folder_ / "o.txt", "precious");
  const Outcome outcome = shell("ulimit -f 4; SHEAF convert in.txt o.txt 2>&1");
  EXPECT_EQ(outcome.exit_code, 6) << outcome.out;
  EXPECT_NE(outcome.out.find("too large"), std::string::npos) << outcome.out;
  EXPECT_EQ(contents_of(folder_ / "o.txt"), "precious");
  EXPECT_EQ(folder_.names(), (Words{"in.txt", "o.txt"}));
}

// A log is there as far as the run has come; it is whole lines, and the end is one of them.
TEST_F(Signals, LogsAreWrittenStepByStep) {
  for (const Words& verb : {Words{"solve", "in.txt"}, Words{"photometric", "images"}}) {
    if (verb[1] == "images")
      run_command({"generate", "images", "--photometric", "--points", "50"}, folder_.path());
    const Outcome outcome =
        run_command({verb[0], verb[1], "--quiet", "--log", "log", "--json", "o"}, folder_.path());
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    std::ifstream file(folder_ / "log");
    std::vector<nlohmann::json> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(nlohmann::json::parse(line));
    const auto document = json_of(folder_ / "o");
    ASSERT_EQ(lines.size(), document["iterations"].size() + 1);
    for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
      EXPECT_EQ(lines[i]["event"], "step");
      EXPECT_EQ(lines[i]["cost"], document["iterations"][i]["cost"]);
    }
    EXPECT_EQ(lines.back()["event"], "end");
    EXPECT_EQ(lines.back()["termination"], document["termination"]);
    EXPECT_EQ(lines.back()["final_cost"], document["final_cost"]);
  }
  const Outcome full = shell("SHEAF solve in.txt -o o.txt --log /dev/full --json o.json");
  EXPECT_EQ(full.exit_code, 6) << full.err;
  EXPECT_NE(full.err.find("/dev/full: cannot be written"), std::string::npos) << full.err;
  EXPECT_TRUE(fs::exists(folder_ / "o.txt") && fs::exists(folder_ / "o.json"));
}

// A run that was killed leaves its partial file; one with the same process number goes on.
TEST_F(Signals, WhatAKilledRunLeftIsCleanedByTheNext) {
  RunningCommand command({"generate", "big.txt", "--like", "ladybug-1723"}, folder_.path());
  for (int i = 0; i < 500 && folder_.names() == Words{"in.txt"}; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  command.send(SIGKILL);
  command.wait();
  EXPECT_EQ(folder_.names(), (Words{"big.txt.sheaf-partial-0", "in.txt"}));
  EXPECT_EQ(run_command({"convert", "in.txt", "big.txt"}, folder_.path()).exit_code, 0);
  EXPECT_EQ(folder_.names(), (Words{"big.txt", "in.txt"}));
}

}  // namespace
}  // namespace sheaf
