// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>
#include <utility>

namespace sheaf {

/// Tells a running solve whether it was asked to stop. Copies see the same request, whichever
/// thread they are on. A token of its own, made by no StopSource, is never asked. (StopToken
/// by its verbs, which not every standard library has.)
class StopToken {
 public:
  StopToken() = default;
  bool stop_requested() const noexcept {
    return requested_ != nullptr && requested_->load(std::memory_order_acquire);
  }

 private:
  friend class StopSource;
  using Flag = std::atomic<bool>;
  static_assert(Flag::is_always_lock_free, "a signal handler may ask");
  explicit StopToken(std::shared_ptr<const Flag> requested) : requested_(std::move(requested)) {}
  std::shared_ptr<const Flag> requested_;
};

/// Asks those who hold its tokens to stop, once and for all. Tokens may outlive it.
class StopSource {
 public:
  StopSource() = default;
  StopSource(const StopSource&) = default;  ///< asks the same tokens; so does a moved one
  StopSource& operator=(const StopSource&) = default;

  StopToken get_token() const { return StopToken(requested_); }
  /// Neither waits nor allocates: any thread may call it, and so may a signal handler.
  void request_stop() noexcept { requested_->store(true, std::memory_order_release); }
  bool stop_requested() const noexcept { return requested_->load(std::memory_order_acquire); }

 private:
  std::shared_ptr<StopToken::Flag> requested_ = std::make_shared<StopToken::Flag>(false);
};

}  // namespace sheaf
