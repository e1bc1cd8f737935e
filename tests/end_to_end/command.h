// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace sheaf {

/// A folder of its own, removed with all in it at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string operator/(const std::string& name) const { return path_ / name; }
  /// Names of what is in it, sorted.
  std::vector<std::string> names() const;

 private:
  std::filesystem::path path_;
};

/// What the command did.
struct Outcome {
  int exit_code = -1;  ///< 1000 + the signal that ended it
  std::string out, err;
};

/// The command, running in `folder`.
class RunningCommand {
 public:
  RunningCommand(const std::vector<std::string>& arguments, const std::filesystem::path& folder);
  /// Another program in its place.
  RunningCommand(const std::string& program, const std::vector<std::string>& arguments,
                 const std::filesystem::path& folder);
  ~RunningCommand();
  RunningCommand(const RunningCommand&) = delete;
  RunningCommand& operator=(const RunningCommand&) = delete;

  void send(int signal);
  /// Waits until stderr has the text; false when it ended or a minute passed without.
  bool wait_for_stderr(const std::string& text);
  Outcome wait();

 private:
  bool ended();

  TemporaryFolder streams_;
  pid_t process_ = -1;
  bool ended_ = false;
  int status_ = 0;
};

Outcome run_command(const std::vector<std::string>& arguments, const std::filesystem::path& folder);
Outcome run_program(const std::string& program, const std::vector<std::string>& arguments,
                    const std::filesystem::path& folder);
std::string command_path();

std::string contents_of(const std::filesystem::path& path);
void write_text(const std::filesystem::path& path, const std::string& text);
nlohmann::json json_of(const std::filesystem::path& path);

/// A real problem, or "" when it is not there: $SHEAF_DATA/bal, data/bal by default.
std::string real_problem(const std::string& name);

}  // namespace sheaf
