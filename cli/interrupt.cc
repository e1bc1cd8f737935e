// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "interrupt.h"

#include <pthread.h>
#include <signal.h>

#include <cstdio>
#include <cstdlib>

#include "exit_code.h"

namespace sheaf {
namespace {

sigset_t watched_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  return signals;
}

}  // namespace

Interrupt::Interrupt(bool quiet) : quiet_(quiet) {
  const sigset_t signals = watched_signals();
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  watcher_ = std::thread([this] { watch(); });
}

Interrupt::~Interrupt() {
  phase_ = Phase::over;
  pthread_kill(watcher_.native_handle(), SIGTERM);  // wakes the watcher alone
  watcher_.join();
}

void Interrupt::watch() {
  const sigset_t signals = watched_signals();
  for (int taken = 0;; ++taken) {
    int signal = 0;
    while (sigwait(&signals, &signal) != 0) continue;
    const Phase phase = phase_;
    if (phase == Phase::over) return;
    if (phase == Phase::read || taken > 0) std::_Exit(kExitInterrupted);
    if (!quiet_)
      std::fputs(phase == Phase::solve
                     ? "interrupted: the best state will be written (again: end at once without)\n"
                     : "interrupted: the file will be finished (again: end at once)\n",
                 stderr);
    stop_.request_stop();
  }
}

}  // namespace sheaf
