// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "fork_safety.h"

#include <pthread.h>

#include <atomic>
#include <mutex>

namespace sheaf {
namespace {

std::atomic<bool> started{false};   ///< threads, by this process or the one it was forked from
std::atomic<bool> orphaned{false};  ///< they stayed with the parent

void after_fork() {
  if (started) orphaned = true;
}

}  // namespace

int threads_here(int asked) {
  static std::once_flag watching;
  std::call_once(watching, [] { pthread_atfork(nullptr, nullptr, &after_fork); });
  if (orphaned) return 1;
  if (asked != 1) started = true;
  return asked;
}

}  // namespace sheaf
