// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "end_to_end/command.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace sheaf {
namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder() {
  std::string pattern = fs::temp_directory_path() / "sheaf-test-XXXXXX";
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::permissions(path_, fs::perms::owner_all, ignored);
  fs::remove_all(path_, ignored);
}

std::vector<std::string> TemporaryFolder::names() const {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(path_)) names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}

RunningCommand::RunningCommand(const std::vector<std::string>& arguments, const fs::path& folder)
    : RunningCommand(command_path(), arguments, folder) {}

RunningCommand::RunningCommand(const std::string& program,
                               const std::vector<std::string>& arguments, const fs::path& folder) {
  std::vector<std::string> words = {program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const std::string out = streams_ / "out", err = streams_ / "err";
  process_ = fork();
  if (process_ != 0) return;
  const int out_file = open(out.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
  const int err_file = open(err.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0600);
  if (dup2(out_file, STDOUT_FILENO) < 0 || dup2(err_file, STDERR_FILENO) < 0 ||
      chdir(folder.c_str()) != 0)
    _exit(126);
  execv(argv[0], argv.data());
  _exit(127);
}

RunningCommand::~RunningCommand() {
  if (!ended()) {
    send(SIGKILL);
    wait();
  }
}

void RunningCommand::send(int signal) { kill(process_, signal); }

bool RunningCommand::ended() {
  if (!ended_) ended_ = waitpid(process_, &status_, WNOHANG) == process_;
  return ended_;
}

bool RunningCommand::wait_for_stderr(const std::string& text) {
  using namespace std::chrono_literals;
  for (int i = 0; i < 6000; ++i) {
    const bool last = ended();
    if (contents_of(streams_ / "err").find(text) != std::string::npos) return true;
    if (last) return false;
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

Outcome RunningCommand::wait() {
  if (!ended_) {
    waitpid(process_, &status_, 0);
    ended_ = true;
  }
  Outcome outcome;
  outcome.exit_code = WIFEXITED(status_) ? WEXITSTATUS(status_) : 1000 + WTERMSIG(status_);
  outcome.out = contents_of(streams_ / "out");
  outcome.err = contents_of(streams_ / "err");
  return outcome;
}

Outcome run_command(const std::vector<std::string>& arguments, const fs::path& folder) {
  return RunningCommand(arguments, folder).wait();
}

Outcome run_program(const std::string& program, const std::vector<std::string>& arguments,
                    const fs::path& folder) {
  return RunningCommand(program, arguments, folder).wait();
}

std::string command_path() { return SHEAF_COMMAND; }

std::string contents_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void write_text(const fs::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

nlohmann::json json_of(const fs::path& path) { return nlohmann::json::parse(contents_of(path)); }

std::string real_problem(const std::string& name) {
  const char* folder = std::getenv("SHEAF_DATA");
  const fs::path path =
      (folder != nullptr ? fs::path(folder) : fs::path(SHEAF_SOURCE_DIR) / "data") / "bal" / name;
  return fs::exists(path) ? fs::absolute(path).string() : "";
}

}  // namespace sheaf
