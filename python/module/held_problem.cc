// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "held_problem.h"

#include <utility>

namespace sheaf {

std::size_t HeldProblem::views() const {
  const std::lock_guard lock(mutex_);
  return views_;
}

void HeldProblem::check_resizable(const char* what) const {
  if (const std::size_t count = views(); count > 0)
    throw Error(ErrorCode::usage, std::string(what) + " would resize a problem that " +
                                      std::to_string(count) +
                                      (count == 1 ? " array is a view" : " arrays are views") +
                                      " of: let them go (del), or work on a copy (problem.copy())");
}

void HeldProblem::check_idle() const {
  const std::lock_guard lock(mutex_);
  if (writes_ || readers_ > 0)
    throw Error(ErrorCode::usage, "the problem is in use by another call");
}

void HeldProblem::check_at_hand() const {
  const std::lock_guard lock(mutex_);
  if (lends_)
    throw Error(ErrorCode::usage,
                "the problem is being solved, and its observations are lent to the solver until "
                "that ends: solve with a callback, or with a view alive, to look at it meanwhile");
}

ViewPin::ViewPin(ProblemHandle held) : held_(std::move(held)) {
  const std::lock_guard lock(held_->mutex_);
  ++held_->views_;
}

ViewPin::~ViewPin() {
  const std::lock_guard lock(held_->mutex_);
  --held_->views_;
}

ReadUse::ReadUse(ProblemHandle held) : held_(std::move(held)) {
  const std::lock_guard lock(held_->mutex_);
  if (held_->writes_) throw Error(ErrorCode::usage, "the problem is being changed by another call");
  ++held_->readers_;
}

ReadUse::~ReadUse() {
  const std::lock_guard lock(held_->mutex_);
  --held_->readers_;
}

WriteUse::WriteUse(ProblemHandle held) : held_(std::move(held)) {
  const std::lock_guard lock(held_->mutex_);
  if (held_->writes_ || held_->readers_ > 0)
    throw Error(ErrorCode::usage, "the problem is in use by another call");
  held_->writes_ = true;
}

WriteUse::~WriteUse() {
  const std::lock_guard lock(held_->mutex_);
  held_->writes_ = held_->lends_ = false;
}

bool WriteUse::lend() {
  const std::lock_guard lock(held_->mutex_);
  if (held_->views_ == 0) held_->lends_ = true;
  return held_->lends_;
}

}  // namespace sheaf
