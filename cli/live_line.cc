// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "live_line.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string_view>
#include <system_error>
#include <utility>

#include "terminal.h"

namespace sheaf {
namespace {

constexpr auto kBefore = std::chrono::seconds(1);
constexpr auto kBetween = std::chrono::milliseconds(100);
constexpr int kBar = 24;

std::size_t columns() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col : 80u;
}

}  // namespace

bool stderr_moves() {
  if (isatty(STDERR_FILENO) != 1) return false;
  const char* kind = std::getenv("TERM");
  return kind != nullptr && std::string_view(kind) != "dumb" && *kind != '\0';
}

void show_live_line(const std::string& text) {
  std::string line = printable(text);
  if (const std::size_t room = columns() - 1; line.size() > room) line.resize(room);
  // Back to the beginning, the text, and what is left of the line erased.
  const std::string all = "\r" + line + "\x1b[K" + (line.empty() ? "\r" : "");
  std::fwrite(all.data(), 1, all.size(), stderr);
  std::fflush(stderr);
}

std::string bar(double share, int width) {
  const int full = static_cast<int>(std::clamp(share, 0.0, 1.0) * width + 0.5);
  return "[" + std::string(std::size_t(full), '#') + std::string(std::size_t(width - full), '.') +
         "]";
}

Activity::Activity(bool quiet, std::string what, const std::atomic<std::uint64_t>* so_far,
                   std::uint64_t total)
    : what_(std::move(what)),
      so_far_(so_far),
      before_(so_far != nullptr ? so_far->load() : 0),
      total_(total) {
  if (quiet || !stderr_moves()) return;
  try {
    watcher_ = std::thread([this] { watch(); });
  } catch (const std::system_error&) {  // then nothing is shown
  }
}

Activity::~Activity() {
  if (!watcher_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  over_.notify_one();
  watcher_.join();
}

void Activity::watch() {
  const auto began = std::chrono::steady_clock::now();
  std::unique_lock lock(mutex_);
  if (over_.wait_for(lock, kBefore, [this] { return ends_; })) return;
  do {
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
    std::string line = what_;
    if (so_far_ != nullptr) {
      const auto done = static_cast<double>(so_far_->load() - before_);
      if (total_ > 0) {
        const double share = std::min(1.0, done / static_cast<double>(total_));
        line += fmt::format("  {} {:3.0f} %", bar(share, kBar), 100 * share);
      } else {
        line += fmt::format("  {:.0f} MB", 1e-6 * done);
      }
    }
    show_live_line(line + fmt::format("  {:.0f} s", seconds));
  } while (!over_.wait_for(lock, kBetween, [this] { return ends_; }));
  show_live_line("");
}

}  // namespace sheaf
