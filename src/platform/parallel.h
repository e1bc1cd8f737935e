// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <cstddef>

namespace sheaf {

/// Runs independent tasks on a fixed number of threads. Results must not depend on which thread
/// runs which task, nor on the order: every task owns what it writes.
class Threads {
 public:
  /// count 0: as many as the machine offers to this process.
  explicit Threads(int count)
      : arena_(count > 0 ? count : oneapi::tbb::this_task_arena::max_concurrency()),
        count_(arena_.max_concurrency()) {}

  int count() const { return count_; }

  /// task(i) for every i in [0, tasks), each exactly once.
  template <class Task>
  void for_each(std::size_t tasks, const Task& task) {
    if (count_ == 1 || tasks < 2) {
      for (std::size_t i = 0; i < tasks; ++i) task(i);
      return;
    }
    arena_.execute([&] {
      oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, tasks, 1),
                                [&](const oneapi::tbb::blocked_range<std::size_t>& range) {
                                  for (std::size_t i = range.begin(); i != range.end(); ++i) task(i);
                                },
                                oneapi::tbb::simple_partitioner());
    });
  }

 private:
  oneapi::tbb::task_arena arena_;
  int count_;
};

}  // namespace sheaf
