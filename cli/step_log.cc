// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "step_log.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>

#include "io/partial.h"

namespace sheaf {

StepLog::StepLog(const std::string& path) : path_(path) {
  if (path.empty()) return;
  fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666);
  if (fd_ < 0) throw unwritable(path, errno);
}

StepLog::~StepLog() {
  if (fd_ >= 0) ::close(fd_);
}

void StepLog::put(const Json& line) {
  if (fd_ < 0 || error_ != 0) return;
  const std::string text = line.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  std::size_t done = 0;
  while (done < text.size() && error_ == 0) {
    const ssize_t n = ::write(fd_, text.data() + done, text.size() - done);
    if (n >= 0)
      done += static_cast<std::size_t>(n);
    else if (errno != EINTR)
      error_ = errno;
  }
}

void StepLog::step(const Iteration& iteration) {
  if (fd_ < 0) return;
  Json line = {{"event", "step"}};
  line.update(iteration_json(iteration));
  put(line);
}

void StepLog::end(const Summary& summary) {
  if (fd_ < 0) return;
  put({{"event", "end"},
       {"termination", {{"code", to_string(summary.termination)}, {"words", summary.words}}},
       {"initial_cost", number(summary.initial_cost)},
       {"final_cost", number(summary.final_cost)},
       {"setup_s", summary.setup_s},
       {"solve_s", summary.solve_s}});
  if (error_ != 0) throw unwritable(path_, error_);
}

}  // namespace sheaf
