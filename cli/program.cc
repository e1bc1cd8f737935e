// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>
#include <string_view>
#include <thread>

#include "sheaf/error.h"
#include "timer.h"

extern char** environ;

namespace sheaf {
namespace {

namespace fs = std::filesystem;

std::string contents_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

std::vector<char*> pointers(std::vector<std::string>& words) {
  std::vector<char*> out;
  for (std::string& word : words) out.push_back(word.data());
  out.push_back(nullptr);
  return out;
}

// This process' environment, with the variables in place of those of the same name.
std::vector<std::string> environment(const std::vector<std::string>& variables) {
  std::vector<std::string> out = variables;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    const std::string_view line = *entry;
    const std::string_view name = line.substr(0, line.find('='));
    const auto replaces = [&](const std::string& variable) {
      return variable.substr(0, variable.find('=')) == name;
    };
    if (std::none_of(variables.begin(), variables.end(), replaces)) out.emplace_back(line);
  }
  return out;
}

// In a group of its own, so that all it starts can be ended with it, and with the signals free that
// this process has blocked for its own watcher.
pid_t spawn(std::vector<std::string> words, const std::vector<std::string>& variables,
            const fs::path& folder) {
  std::vector<std::string> settings = environment(variables);
  const std::string out = folder / "out", err = folder / "err";
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  const int create = O_CREAT | O_WRONLY | O_TRUNC;
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, out.c_str(), create, 0600);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, err.c_str(), create, 0600);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK);
  pid_t process = -1;
  const int error = posix_spawn(&process, words[0].c_str(), &files, &attributes,
                                pointers(words).data(), pointers(settings).data());
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0)
    throw Error(ErrorCode::usage, fmt::format("{} cannot be run: {}", words[0], strerror(error)));
  return process;
}

}  // namespace

std::string ProgramOutcome::failure() const {
  if (timed_out) return "did not end in time: killed";
  if (stopped) return "interrupted";
  if (signal != 0) return fmt::format("crashed: {}", strsignal(signal));
  if (exit_code == 0) return "";
  std::istringstream lines(err);
  std::string last;
  for (std::string line; std::getline(lines, line);)
    if (!line.empty()) last = line;
  return last.empty() ? fmt::format("exit code {}", exit_code)
                      : fmt::format("exit code {}: {}", exit_code, last);
}

ProgramOutcome run_program(const std::vector<std::string>& words,
                           const std::vector<std::string>& variables, const fs::path& folder,
                           double limit_s, const StopToken& stop) {
  const Timer timer;
  ::signal(SIGCHLD, SIG_DFL);  // where a parent has it ignored, no exit code would come back
  const pid_t process = spawn(words, variables, folder);
  ProgramOutcome outcome;
  int status = 0;
  while (waitpid(process, &status, WNOHANG) == 0) {
    outcome.timed_out = timer.seconds() > limit_s;
    outcome.stopped = stop.stop_requested();
    if (outcome.timed_out || outcome.stopped) {
      kill(-process, SIGKILL);
      waitpid(process, &status, 0);
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  kill(-process, SIGKILL);  // whatever it left behind
  if (WIFEXITED(status)) outcome.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) outcome.signal = WTERMSIG(status);
  outcome.out = contents_of(folder / "out");
  outcome.err = contents_of(folder / "err");
  return outcome;
}

ScratchFolder::ScratchFolder() {
  std::error_code error;
  std::string pattern = fs::temp_directory_path(error) / "sheaf-XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr)
    throw Error(ErrorCode::unwritable_output,
                fmt::format("{}: no temporary folder can be made: {}", pattern, strerror(errno)));
  path_ = pattern;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace sheaf
