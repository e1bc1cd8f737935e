// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nanobind/nanobind.h>

#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>

#include "sheaf/solve.h"
#include "sheaf/stop.h"

namespace sheaf {

namespace nb = nanobind;

/// Work without the interpreter's lock that Python can look at and end. In the main thread the work
/// runs on a thread of its own, while the caller's answers signals (Ctrl-C) and runs callbacks, so
/// that these are where Python expects them; in other threads, which get no signals, it runs where
/// it is called.
class Run {
 public:
  /// callback: None, or called with each Iteration; False ends the run.
  explicit Run(nb::object callback = nb::none());

  /// Asks the work to stop: a signal's handler or the callback raised something, or it said so.
  StopToken token() const { return stop_.get_token(); }
  bool has_callback() const { return !callback_.is_none(); }
  /// For SolveOptions::on_iteration; called by the work.
  bool report(const Iteration& iteration);

  /// Runs it to its end, whatever happens. Throws what a handler or the callback raised, else what
  /// the work throws.
  void go(const std::function<void()>& work);

 private:
  void go_aside(const std::function<void()>& work);
  void wait_for_end();
  bool call(const Iteration& iteration);

  nb::object callback_;
  StopSource stop_;
  std::exception_ptr raised_;  ///< by Python; what the run ends with
  bool aside_ = false;

  std::mutex mutex_;
  std::condition_variable changed_;
  bool done_ = false;
  const Iteration* asked_ = nullptr;  ///< the work waits for the callback's answer
  bool answer_ = true;
};

}  // namespace sheaf
