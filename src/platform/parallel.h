// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <thread>
#include <vector>

// The thread sanitizer does not see the order that a TBB of the distribution establishes, and takes
// every task for a race with its caller. Builds for it run the tasks on plain threads instead.
#if defined(__SANITIZE_THREAD__)
#define SHEAF_PLAIN_THREADS 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define SHEAF_PLAIN_THREADS 1
#endif
#endif

namespace sheaf {

#if defined(SHEAF_PLAIN_THREADS)
inline thread_local int plain_worker = 0;

/// Threads that are waited for, whatever is thrown meanwhile.
struct Joined {
  std::vector<std::thread> threads;
  ~Joined() {
    for (std::thread& thread : threads) thread.join();
  }
};
#endif

/// Runs independent tasks on a fixed number of threads. Results must not depend on which thread
/// runs which task, nor on the order: every task owns what it writes.
class Threads {
 public:
  /// More gain nothing anywhere, and systems refuse to start many thousands.
  static constexpr int kMost = 512;

  /// count 0: as many as the machine offers to this process; more than kMost: kMost.
  explicit Threads(int count)
      : count_(
            std::min(kMost, count > 0 ? count : oneapi::tbb::this_task_arena::max_concurrency())),
        arena_(count_) {
    // More threads than cores run only where this allows them (and the request would be warned
    // of). Of several such controls the least holds, so only those that need one make one.
    if (count_ == 1) return;
    if (count_ > oneapi::tbb::this_task_arena::max_concurrency())
      allowed_.emplace(oneapi::tbb::global_control::max_allowed_parallelism, count_);
    arena_.initialize();
  }

  int count() const { return count_; }

  /// Number of the calling thread within for_each, in [0, count()).
  int worker() const {
#if defined(SHEAF_PLAIN_THREADS)
    return plain_worker;
#else
    return count_ == 1 ? 0 : std::max(0, oneapi::tbb::this_task_arena::current_thread_index());
#endif
  }

  /// task(i) for every i in [0, tasks), each exactly once.
  template <class Task>
  void for_each(std::size_t tasks, const Task& task) {
    if (count_ == 1 || tasks < 2) {
      for (std::size_t i = 0; i < tasks; ++i) task(i);
      return;
    }
#if defined(SHEAF_PLAIN_THREADS)
    // Dealt out in turn, so that neighbouring tasks always run on different threads and no order
    // between them can hide that both write to one place.
    const auto work = [&](std::size_t first) {
      plain_worker = static_cast<int>(first);
      for (std::size_t i = first; i < tasks; i += count_) task(i);
    };
    Joined others;
    for (int i = 1; i < count_; ++i) others.threads.emplace_back(work, i);
    work(0);
#else
    arena_.execute([&] {
      oneapi::tbb::parallel_for(
          oneapi::tbb::blocked_range<std::size_t>(0, tasks, 1),
          [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
            for (std::size_t i = range.begin(); i != range.end(); ++i) task(i);
          },
          oneapi::tbb::simple_partitioner());
    });
#endif
  }

  /// task(first, end) for consecutive parts of [0, size), which do not depend on count().
  template <class Task>
  void for_ranges(std::size_t size, std::size_t each, const Task& task) {
    for_each((size + each - 1) / each,
             [&](std::size_t t) { task(t * each, std::min(size, (t + 1) * each)); });
  }

 private:
  int count_;
  std::optional<oneapi::tbb::global_control> allowed_;
  oneapi::tbb::task_arena arena_;
};

}  // namespace sheaf
