// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "sheaf/stop.h"

namespace sheaf {

/// What became of a program that ran in a process of its own.
struct ProgramOutcome {
  int exit_code = -1;      ///< -1 when a signal ended it
  int signal = 0;          ///< that ended it, or 0
  bool timed_out = false;  ///< ended here, after the limit
  bool stopped = false;    ///< ended here, because the stop token asked
  std::string out, err;
  /// "" for success, else why not in words: the last line on stderr, the signal, the limit.
  std::string failure() const;
};

/// Runs words[0] with the arguments words[1...] and the environment plus `variables`
/// ("NAME=VALUE"), its streams going to files in `folder`. After limit_s seconds the process and
/// all that it started are killed; the process is also where this one ends. Throws Error
/// (ErrorCode::usage) when it cannot be started.
ProgramOutcome run_program(const std::vector<std::string>& words,
                           const std::vector<std::string>& variables,
                           const std::filesystem::path& folder, double limit_s,
                           const StopToken& stop);

/// A folder of its own, removed with all in it at the end; one that a killed run left is removed by
/// the next (io/partial.h). Throws Error (ErrorCode::unwritable_output) when it cannot be made.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_;
};

}  // namespace sheaf
