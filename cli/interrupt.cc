// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "interrupt.h"

#include <poll.h>
#include <signal.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cmath>
#include <string_view>

#include "exit_code.h"
#include "io/partial.h"

namespace sheaf {
namespace {

enum class Phase { read, compute, solve, write, over };

/// What the handler looks at. Signals are the process's, and so is this.
struct Watch {
  std::atomic<Phase> phase{Phase::read};
  std::atomic<bool> quiet{false};
  std::atomic<int> taken{0};
  std::atomic<int> child{0};  ///< a process group
  std::atomic<StopSource*> stop{nullptr};
};
Watch watch;

/// Never waits: a full pipe on stderr must not hold up what was asked for.
void tell(std::string_view words) {
  pollfd ready{STDERR_FILENO, POLLOUT, 0};
  if (::poll(&ready, 1, 0) == 1) (void)!::write(STDERR_FILENO, words.data(), words.size());
}

[[noreturn]] void leave(int code = kExitInterrupted) {
  if (const int child = watch.child) ::kill(-child, SIGKILL);
  unlink_partial_files();
  ::_exit(code);
}

/// Seconds that this process has run.
double age_s() {
  timespec now{};
  ::clock_gettime(CLOCK_MONOTONIC, &now);
  static const timespec kBegin = now;  // first asked for when signals are watched
  return static_cast<double>(now.tv_sec - kBegin.tv_sec) +
         1e-9 * static_cast<double>(now.tv_nsec - kBegin.tv_nsec);
}

extern "C" void take_alarm(int) {
  const int error = errno;
  const Phase phase = watch.phase;
  if (phase == Phase::read || phase == Phase::compute) {
    if (!watch.quiet)
      tell(phase == Phase::read
               ? "the time limit was reached before all was read: nothing is written\n"
               : "the time limit was reached: nothing is written\n");
    leave(kExitTimeLimit);
  }
  errno = error;
}

extern "C" void take_signal(int) {
  const int error = errno;
  const Phase phase = watch.phase;
  if (phase == Phase::read || phase == Phase::compute || watch.taken.fetch_add(1) > 0) leave();
  if (!watch.quiet && phase == Phase::solve)
    tell("interrupted: the best state will be written (again: end at once without)\n");
  if (!watch.quiet && phase == Phase::write)
    tell("interrupted: the file will be finished (again: end at once)\n");
  if (StopSource* stop = watch.stop) stop->request_stop();
  errno = error;
}

}  // namespace

void watch_signals() {
  (void)age_s();
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
  struct sigaction action {};
  action.sa_handler = take_signal;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigset_t taken;
  sigemptyset(&taken);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    if (::sigaction(signal, nullptr, &before) == 0 && before.sa_handler == SIG_IGN) continue;
    ::sigaction(signal, &action, nullptr);
    sigaddset(&taken, signal);
  }
  // A parent may have blocked them for itself alone.
  ::sigprocmask(SIG_UNBLOCK, &taken, nullptr);
}

void end_with_this(int process_group) { watch.child = process_group; }

Interrupt::Interrupt(bool quiet) {
  watch.quiet = quiet;
  watch.stop = &stop_;
}

Interrupt::~Interrupt() {
  watch.phase = Phase::over;
  watch.stop = nullptr;
}

void Interrupt::limit(double seconds) {
  constexpr double kGrace = 0.5, kLongest = 1e8;
  limit_s_ = seconds;
  if (!(seconds < kLongest)) return;
  struct sigaction action {};
  action.sa_handler = take_alarm;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  ::sigaction(SIGALRM, &action, nullptr);
  const double after = std::max(1e-3, seconds + kGrace - age_s());
  itimerval timer{};
  timer.it_value.tv_sec = static_cast<time_t>(after);
  timer.it_value.tv_usec = static_cast<suseconds_t>(1e6 * (after - std::floor(after)));
  ::setitimer(ITIMER_REAL, &timer, nullptr);
}

double Interrupt::left_s() const { return std::max(1e-9, limit_s_ - age_s()); }

void Interrupt::begin_compute() { watch.phase = Phase::compute; }
void Interrupt::begin_solve() { watch.phase = Phase::solve; }
void Interrupt::begin_write() { watch.phase = Phase::write; }

}  // namespace sheaf
