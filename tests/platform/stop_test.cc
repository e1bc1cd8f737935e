// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/stop.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <thread>
#include <utility>

namespace sheaf {
namespace {

TEST(Stop, ATokenOfNoSourceIsNeverAsked) { EXPECT_FALSE(StopToken().stop_requested()); }

TEST(Stop, ARequestReachesEveryTokenAndStays) {
  StopSource source;
  const StopToken before = source.get_token();
  const StopToken copy = before;
  EXPECT_FALSE(source.stop_requested());
  EXPECT_FALSE(copy.stop_requested());
  source.request_stop();
  source.request_stop();
  EXPECT_TRUE(source.stop_requested());
  EXPECT_TRUE(before.stop_requested());
  EXPECT_TRUE(copy.stop_requested());
  EXPECT_TRUE(source.get_token().stop_requested());
  EXPECT_FALSE(StopSource().stop_requested());
}

TEST(Stop, CopiesOfASourceAskTheSameTokens) {
  StopSource source;
  const StopToken token = source.get_token();
  StopSource moved = std::move(source);
  moved.request_stop();
  EXPECT_TRUE(token.stop_requested());
  EXPECT_TRUE(source.stop_requested());
}

TEST(Stop, ATokenOutlivesItsSource) {
  StopToken token;
  {
    StopSource source;
    token = source.get_token();
    source.request_stop();
  }
  EXPECT_TRUE(token.stop_requested());
}

TEST(Stop, AnotherThreadIsSeen) {
  StopSource source;
  std::thread watcher([token = source.get_token()] {
    while (!token.stop_requested()) std::this_thread::yield();
  });
  source.request_stop();
  watcher.join();
}

StopSource* asked_by_signal = nullptr;

TEST(Stop, ASignalHandlerMayAsk) {
  StopSource source;
  asked_by_signal = &source;
  const auto before = ::signal(SIGUSR1, [](int) { asked_by_signal->request_stop(); });
  ::raise(SIGUSR1);
  ::signal(SIGUSR1, before);
  EXPECT_TRUE(source.get_token().stop_requested());
}

}  // namespace
}  // namespace sheaf
