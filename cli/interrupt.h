// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <thread>

#include "sheaf/stop.h"

namespace sheaf {

/// What Ctrl-C (SIGINT) and SIGTERM do. Until `begin_solve` they end the command at once: there is
/// nothing to save. From then on the first one asks the solver to stop, so that its best state can
/// be written. From `begin_write` on the first one waits for the file. A second one always ends the
/// command at once.
///
/// Construct it before any thread is started: the signals are blocked in the constructing thread
/// and all that it starts later, and one thread waits for them.
class Interrupt {
 public:
  explicit Interrupt(bool quiet);
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  void begin_solve() { phase_ = Phase::solve; }
  void begin_write() { phase_ = Phase::write; }
  StopToken token() const { return stop_.get_token(); }

 private:
  enum class Phase { read, solve, write, over };
  void watch();

  StopSource stop_;
  std::atomic<Phase> phase_{Phase::read};
  bool quiet_;
  std::thread watcher_;
};

}  // namespace sheaf
