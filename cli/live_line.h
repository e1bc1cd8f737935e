// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

namespace sheaf {

/// Whether stderr is a terminal that can take a line back.
bool stderr_moves();

/// In place of the line that stands there, cut to the terminal's width; empty: takes it away.
void show_live_line(const std::string& text);

/// "[######....]" of `width` characters between the brackets.
std::string bar(double share, int width);

/// What the command is at (reading, set-up, writing), on a line of a terminal that moves, once it
/// has taken a second; nothing elsewhere. Ends with its life, and the line with it.
class Activity {
 public:
  /// so_far: a count of bytes that grows, and total what it is to grow by; null or 0: not known.
  Activity(bool quiet, std::string what, const std::atomic<std::uint64_t>* so_far = nullptr,
           std::uint64_t total = 0);
  ~Activity();
  Activity(const Activity&) = delete;
  Activity& operator=(const Activity&) = delete;

 private:
  void watch();

  const std::string what_;
  const std::atomic<std::uint64_t>* const so_far_;
  const std::uint64_t before_, total_;
  std::mutex mutex_;
  std::condition_variable over_;
  bool ends_ = false;
  std::thread watcher_;
};

}  // namespace sheaf
