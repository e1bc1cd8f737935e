// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "json_document.h"

namespace sheaf {

/// --log: what a solve does, as lines of JSON (docs/json.md), each written as soon as it is known,
/// so that another program can follow and a killed run leaves what it had done. The file is begun
/// anew, not replaced at the end. Without a path it does nothing.
class StepLog {
 public:
  /// Throws Error (ErrorCode::unwritable_output).
  explicit StepLog(const std::string& path);
  ~StepLog();
  StepLog(const StepLog&) = delete;
  StepLog& operator=(const StepLog&) = delete;

  /// Writing that fails ends no solve: `end` tells it.
  void step(const Iteration& iteration);
  /// Throws Error (ErrorCode::unwritable_output) where a line could not be written.
  void end(const Summary& summary);

 private:
  void put(const Json& line);

  std::string path_;
  int fd_ = -1;
  int error_ = 0;  ///< errno of the first failure
};

}  // namespace sheaf
