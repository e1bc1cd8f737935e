// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Some peers have no callback, but print a line for each step: the one moment at which others can
// look at them.
#pragma once

#include <functional>
#include <iostream>
#include <streambuf>
#include <string>
#include <utility>

namespace peer {

/// While it lives, the lines that go to std::cout go to a function instead, each as it ends. What
/// the function throws leaves through whoever printed the line.
class LineWatch final : public std::streambuf {
 public:
  explicit LineWatch(std::function<void(const std::string&)> on_line)
      : on_line_(std::move(on_line)), before_(std::cout.rdbuf(this)) {
    std::cout.exceptions(std::ios::badbit);  // lets exceptions pass through operator<<
  }
  ~LineWatch() override {
    std::cout.exceptions(std::ios::goodbit);
    std::cout.clear();
    std::cout.rdbuf(before_);
  }
  LineWatch(const LineWatch&) = delete;
  LineWatch& operator=(const LineWatch&) = delete;

 protected:
  int overflow(int c) override {
    if (c == '\n')
      on_line_(std::exchange(line_, {}));
    else if (c != EOF)
      line_ += static_cast<char>(c);
    return c == EOF ? 0 : c;
  }

 private:
  std::function<void(const std::string&)> on_line_;
  std::streambuf* before_;
  std::string line_;
};

}  // namespace peer
