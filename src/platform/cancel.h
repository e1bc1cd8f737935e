// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>

namespace sheaf {

/// Thrown by `poll_cancelled`. It never leaves the library.
struct Cancelled {};

/// While it lives, `poll_cancelled` on this thread asks the function, which must outlive it. Scopes
/// of one thread nest. Passes over millions of observations can so be given up without handing the
/// question down through all of them.
class CancelScope {
 public:
  explicit CancelScope(const std::function<bool()>& asked);
  ~CancelScope();
  CancelScope(const CancelScope&) = delete;
  CancelScope& operator=(const CancelScope&) = delete;

 private:
  const std::function<bool()>* outer_;
};

/// To be called at least every tenth of a second where a pass is long, between its parts or at the
/// beginning of its tasks: throws Cancelled where this thread's scope says yes. Tasks on other
/// threads are not asked; a pass of tasks ends where the one that began it throws. Costs one clock.
void poll_cancelled();

/// What `poll_cancelled` asks on this thread, for tasks on others that are long by themselves and
/// may not throw; null outside every scope. It lives as long as the scope.
const std::function<bool()>* cancel_question();

}  // namespace sheaf
