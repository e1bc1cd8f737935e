// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What a terminal sees of a run: one line that moves, and nothing of it on stdout or elsewhere.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <vector>

#include "end_to_end/command.h"

namespace sheaf {
namespace {

/// The command with stderr on a terminal of so many columns, and stdout in a file; what the
/// terminal was sent.
std::string seen_by_terminal(const std::vector<std::string>& arguments, const char* kind,
                             unsigned short columns, const TemporaryFolder& folder) {
  const int master = ::posix_openpt(O_RDWR | O_NOCTTY);
  if (master < 0 || ::grantpt(master) != 0 || ::unlockpt(master) != 0) return "no terminal";
  winsize size{};
  size.ws_col = columns, size.ws_row = 24;
  const int slave = ::open(::ptsname(master), O_RDWR | O_NOCTTY);
  ::ioctl(slave, TIOCSWINSZ, &size);
  const std::string out = folder / "stdout.txt";
  const std::string command = command_path();
  const pid_t process = ::fork();
  if (process == 0) {
    ::setenv("TERM", kind, 1);
    if (::chdir(folder.path().c_str()) != 0) ::_exit(99);
    const int file = ::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    ::dup2(file, STDOUT_FILENO);
    ::dup2(slave, STDERR_FILENO);
    std::vector<char*> words = {const_cast<char*>(command.c_str())};
    for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    ::execv(command.c_str(), words.data());
    ::_exit(99);
  }
  ::close(slave);
  std::string seen;
  char buffer[4096];
  for (ssize_t n; (n = ::read(master, buffer, sizeof buffer)) > 0;)
    seen.append(buffer, static_cast<std::size_t>(n));
  ::close(master);
  int status = 0;
  ::waitpid(process, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0) << seen;
  return seen;
}

/// Texts between carriage returns, without what erases the rest of a line.
std::vector<std::string> states_of_the_line(const std::string& seen) {
  std::vector<std::string> out(1);
  for (const char c : seen)
    if (c == '\r')
      out.emplace_back();
    else
      out.back() += c;
  return out;
}

TEST(Terminal, OneLineMovesAndIsGoneAtTheEnd) {
  TemporaryFolder folder;
  const auto generate = run_command({"generate", "in.txt", "--cameras", "12"}, folder.path());
  ASSERT_EQ(generate.exit_code, 0) << generate.err;
  const std::vector<std::string> solve = {"solve", "in.txt", "-o", "out.txt"};
  const std::string seen = seen_by_terminal(solve, "xterm", 120, folder);
  const std::vector<std::string> states = states_of_the_line(seen);
  const auto moves = std::count_if(states.begin(), states.end(), [](const std::string& state) {
    return state.starts_with("step ") && state.find(" px  ") != state.npos &&
           state.find(" MB  ") != state.npos && state.ends_with("\x1b[K");
  });
  EXPECT_GT(moves, 3) << seen;
  EXPECT_NE(seen.find(" s left"), seen.npos) << seen;
  // The last thing that the line was told is to be empty.
  EXPECT_TRUE(seen.ends_with("\r\x1b[K\r")) << seen;
  const std::string out = contents_of(folder / "stdout.txt");
  EXPECT_NE(out.find("stopped     converged"), out.npos);
  EXPECT_EQ(out.find('\r'), out.npos);
  // Cut to a narrow terminal, so that it stays one line.
  for (const std::string& state : states_of_the_line(seen_by_terminal(solve, "xterm", 30, folder)))
    if (state.starts_with("step ")) {
      EXPECT_LE(state.find('\x1b'), 29u) << state;
    }
}

TEST(Terminal, OneThatCannotTakeALineBackGetsPlainLines) {
  TemporaryFolder folder;
  ASSERT_EQ(run_command({"generate", "in.txt", "--cameras", "6"}, folder.path()).exit_code, 0);
  const std::string seen = seen_by_terminal({"solve", "in.txt"}, "dumb", 80, folder);
  EXPECT_NE(seen.find("iteration 1: cost"), seen.npos) << seen;
  EXPECT_EQ(seen.find('\x1b'), seen.npos);
  EXPECT_EQ(seen_by_terminal({"solve", "in.txt", "--quiet"}, "xterm", 80, folder), "");
}

/// Nobody ever writes into the pipe.
TEST(Terminal, ATimeLimitEndsAReadingThatDoesNotEnd) {
  TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder / "in.txt").c_str(), 0600), 0);
  const Outcome outcome =
      run_command({"solve", "in.txt", "-o", "out.txt", "--time-limit", "0.1"}, folder.path());
  EXPECT_EQ(outcome.exit_code, 7);
  EXPECT_NE(outcome.err.find("before all was read: nothing is written"), std::string::npos);
  EXPECT_EQ(folder.names(), std::vector<std::string>{"in.txt"});
}

}  // namespace
}  // namespace sheaf
