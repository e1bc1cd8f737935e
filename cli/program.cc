// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <string.h>
#if defined(__linux__)
#include <sys/prctl.h>
#endif
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>
#include <string_view>
#include <thread>

#include "interrupt.h"
#include "io/partial.h"
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

// Between fork and exec, where nothing may be allocated: a group of its own, so that all it starts
// can be ended with it; the end of this process is its end; signals as a program expects them.
[[noreturn]] void become(char** words, char** settings, const char* out, const char* err,
                         pid_t parent, int tell) {
  ::setpgid(0, 0);
#if defined(__linux__)
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
#endif
  ::signal(SIGPIPE, SIG_DFL);
  ::signal(SIGXFSZ, SIG_DFL);
  constexpr int kCreate = O_CREAT | O_WRONLY | O_TRUNC;
  const int files[] = {::open("/dev/null", O_RDONLY), ::open(out, kCreate, 0600),
                       ::open(err, kCreate, 0600)};
  for (int fd = 0; fd < 3; ++fd)
    if (::dup2(files[fd], fd) < 0) ::_exit(127);
  for (const int file : files)
    if (file > STDERR_FILENO) ::close(file);
  if (::getppid() == parent) ::execve(words[0], words, settings);
  const int error = errno;
  (void)!::write(tell, &error, sizeof error);
  ::_exit(127);
}

pid_t spawn(std::vector<std::string> words, const std::vector<std::string>& variables,
            const fs::path& folder) {
  std::vector<std::string> settings = environment(variables);
  const std::string out = folder / "out", err = folder / "err";
  const std::vector<char*> argv = pointers(words), envp = pointers(settings);
  int told[2];  // an error of exec; closed by its success
  if (::pipe(told) != 0)
    throw Error(ErrorCode::usage, fmt::format("{} cannot be run: {}", words[0], strerror(errno)));
  for (const int fd : told) ::fcntl(fd, F_SETFD, FD_CLOEXEC);
  const pid_t parent = ::getpid(), process = ::fork();
  if (process == 0)
    become(const_cast<char**>(argv.data()), const_cast<char**>(envp.data()), out.c_str(),
           err.c_str(), parent, told[1]);
  int error = process < 0 ? errno : 0;
  ::close(told[1]);
  if (process > 0) {
    ::setpgid(process, process);
    end_with_this(process);
    if (::read(told[0], &error, sizeof error) == sizeof error) {
      ::waitpid(process, nullptr, 0);
      end_with_this(0);
    }
  }
  ::close(told[0]);
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
  end_with_this(0);
  if (WIFEXITED(status)) outcome.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) outcome.signal = WTERMSIG(status);
  outcome.out = contents_of(folder / "out");
  outcome.err = contents_of(folder / "err");
  return outcome;
}

ScratchFolder::ScratchFolder() {
  std::error_code error;
  const fs::path target = fs::temp_directory_path(error) / "sheaf-compare";
  Partial claimed = claim_partial_folder(target, 0700, target).value();
  path_ = std::move(claimed.path);
  lock_ = claimed.fd;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  ::close(lock_);
}

}  // namespace sheaf
