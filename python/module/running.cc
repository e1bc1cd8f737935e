// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "running.h"

#include <chrono>
#include <thread>
#include <utility>

namespace sheaf {
namespace {

/// How long a signal waits at most before its handler runs.
constexpr std::chrono::milliseconds kPatience(20);

bool in_main_thread() {
  const nb::module_ threading = nb::module_::import_("threading");
  return threading.attr("current_thread")().is(threading.attr("main_thread")());
}

}  // namespace

Run::Run(nb::object callback) : callback_(std::move(callback)) {
  if (has_callback() && !PyCallable_Check(callback_.ptr()))
    throw nb::type_error("callback: expected a function of an Iteration");
}

bool Run::report(const Iteration& iteration) {
  if (!has_callback()) return true;
  if (!aside_) {
    const nb::gil_scoped_acquire locked;
    return call(iteration);
  }
  std::unique_lock lock(mutex_);
  asked_ = &iteration;
  changed_.notify_all();
  changed_.wait(lock, [this] { return asked_ == nullptr; });
  return answer_;
}

bool Run::call(const Iteration& iteration) {
  if (raised_) return false;
  try {
    const nb::object said = callback_(nb::cast(iteration, nb::rv_policy::copy));
    return said.is_none() || nb::cast<bool>(nb::bool_(said));
  } catch (...) {
    raised_ = std::current_exception();
    return false;
  }
}

void Run::go(const std::function<void()>& work) {
  aside_ = in_main_thread();
  if (aside_) {
    go_aside(work);
    return;
  }
  {
    const nb::gil_scoped_release released;
    work();
  }
  if (raised_) std::rethrow_exception(std::exchange(raised_, nullptr));
}

void Run::go_aside(const std::function<void()>& work) {
  std::exception_ptr thrown;
  std::thread worker([&] {
    try {
      work();
    } catch (...) {
      thrown = std::current_exception();
    }
    const std::lock_guard lock(mutex_);
    done_ = true;
    changed_.notify_all();
  });
  wait_for_end();
  worker.join();
  if (raised_) std::rethrow_exception(std::exchange(raised_, nullptr));
  if (thrown) std::rethrow_exception(thrown);
}

void Run::wait_for_end() {
  for (;;) {
    const Iteration* asked = nullptr;
    {
      const nb::gil_scoped_release released;
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, kPatience, [this] { return done_ || asked_ != nullptr; });
      if (done_) return;
      asked = asked_;
    }
    if (asked != nullptr) {
      const bool answer = call(*asked);
      if (!answer) stop_.request_stop();
      const std::lock_guard lock(mutex_);
      answer_ = answer;
      asked_ = nullptr;
      changed_.notify_all();
    } else if (PyErr_CheckSignals() != 0) {
      try {
        nb::raise_python_error();
      } catch (...) {
        if (!raised_) raised_ = std::current_exception();
      }
      stop_.request_stop();
    }
  }
}

}  // namespace sheaf
