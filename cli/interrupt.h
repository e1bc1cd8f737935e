// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>

#include "sheaf/stop.h"

namespace sheaf {

/// What Ctrl-C (SIGINT), SIGTERM and SIGHUP do from now on, all alike: they end the command at once
/// with kExitInterrupted, unless an Interrupt says otherwise. One that was ignored when the command
/// began (nohup) stays ignored. SIGPIPE and SIGXFSZ become errors of writing. To be called first of
/// all.
void watch_signals();

/// A process that the command has started and that must not outlive it: its group is killed with
/// the command. 0: none.
void end_with_this(int process_group);

/// What a signal means while a verb runs. Until `begin_solve` it ends the command at once: there is
/// nothing to save. From then on the first one asks the solver to stop, so that its best state can
/// be written. From `begin_write` on the first one waits for the file. A second one always ends the
/// command at once, partial files removed. One at a time.
class Interrupt {
 public:
  explicit Interrupt(bool quiet);
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// A run of this verb is to end after so many seconds from the command's beginning: where nothing
  /// that can be saved has begun half a second later, it ends with kExitTimeLimit.
  void limit(double seconds);
  /// Of that time; infinite without a limit, and never 0: there is always a start to write.
  double left_s() const;

  /// What is computed can only be saved whole: a signal ends the command at once, as before.
  void begin_compute();
  void begin_solve();
  void begin_write();
  StopToken token() const { return stop_.get_token(); }

 private:
  StopSource stop_;
  double limit_s_ = std::numeric_limits<double>::infinity();
};

}  // namespace sheaf
