// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "held_problem.h"

#include <utility>

namespace sheaf {
namespace {

/// That lenses are of a model that there is, which is an enumerator to the library.
void check_models(const Problem& problem) {
  for (std::size_t i = 0; i < problem.cameras.size(); ++i)
    if (static_cast<std::size_t>(problem.cameras[i].model) >= kCameraModels)
      throw Error(ErrorCode::usage, "camera " + std::to_string(i) + " has the model number " +
                                        std::to_string(static_cast<int>(problem.cameras[i].model)) +
                                        ", expected less than " + std::to_string(kCameraModels));
}

void check_valid(const Problem& problem) {
  check_models(problem);
  validate(problem).value();
}

}  // namespace

std::size_t HeldProblem::views() const {
  const std::lock_guard lock(mutex_);
  return views_;
}

void HeldProblem::refuse_resize(const std::string& what) const {
  throw Error(ErrorCode::usage, what + " would resize a problem that " + std::to_string(views_) +
                                    (views_ == 1 ? " array is a view" : " arrays are views") +
                                    " of: let them go (del), or work on a copy (problem.copy())");
}

void HeldProblem::check_resizable(const std::string& what) const {
  const std::lock_guard lock(mutex_);
  if (views_ > 0) refuse_resize(what);
}

void HeldProblem::check_idle() const {
  const std::lock_guard lock(mutex_);
  if (writes_ || readers_ > 0)
    throw Error(ErrorCode::usage, "the problem is in use by another call");
}

void HeldProblem::check_at_hand() const {
  const std::lock_guard lock(mutex_);
  if (alone_)
    throw Error(ErrorCode::usage,
                "the problem is in use by a call that has its arrays for itself until it ends (a "
                "solve leaves them at hand with a callback, or while a view lives)");
}

ViewPin::ViewPin(ProblemHandle held) : held_(std::move(held)) {
  const std::lock_guard lock(held_->mutex_);
  ++held_->views_;
}

ViewPin::~ViewPin() {
  const std::lock_guard lock(held_->mutex_);
  --held_->views_;
}

ReadUse::ReadUse(ProblemHandle held, Validity validity) : held_(std::move(held)) {
  const std::lock_guard lock(held_->mutex_);
  if (held_->writes_) throw Error(ErrorCode::usage, "the problem is being changed by another call");
  if (validity == Validity::asked) check_valid(held_->problem);
  ++held_->readers_;
}

ReadUse::~ReadUse() {
  const std::lock_guard lock(held_->mutex_);
  --held_->readers_;
}

WriteUse::WriteUse(ProblemHandle held, Validity validity) : held_(std::move(held)) {
  const std::lock_guard lock(held_->mutex_);
  if (held_->writes_ || held_->readers_ > 0)
    throw Error(ErrorCode::usage, "the problem is in use by another call");
  validity == Validity::asked ? check_valid(held_->problem) : check_models(held_->problem);
  held_->writes_ = true;
}

WriteUse::~WriteUse() {
  const std::lock_guard lock(held_->mutex_);
  held_->writes_ = held_->alone_ = false;
}

bool WriteUse::alone() {
  const std::lock_guard lock(held_->mutex_);
  if (held_->views_ == 0) held_->alone_ = true;
  return held_->alone_;
}

void WriteUse::resize(const std::string& what) {
  const std::lock_guard lock(held_->mutex_);
  if (held_->views_ > 0) held_->refuse_resize(what);
  held_->alone_ = true;
}

}  // namespace sheaf
