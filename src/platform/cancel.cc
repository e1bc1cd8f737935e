// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "platform/cancel.h"

namespace sheaf {
namespace {

thread_local const std::function<bool()>* asked_here = nullptr;

}  // namespace

CancelScope::CancelScope(const std::function<bool()>& asked) : outer_(asked_here) {
  asked_here = &asked;
}

CancelScope::~CancelScope() { asked_here = outer_; }

void poll_cancelled() {
  if (asked_here != nullptr && (*asked_here)()) throw Cancelled();
}

const std::function<bool()>* cancel_question() { return asked_here; }

}  // namespace sheaf
