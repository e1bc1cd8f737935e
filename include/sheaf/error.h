// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace sheaf {

/// Why a call could not do its work. The numbers are the exit codes of the command.
enum class ErrorCode {
  usage = 2,              ///< options or arguments that contradict each other or the problem
  unreadable_input = 3,   ///< missing, truncated, malformed or absurd input
  no_usable_step = 4,     ///< the solver could not make a single step
  memory_limit = 5,       ///< the forecast exceeds the limit; nothing was allocated
  unwritable_output = 6,  ///< the output cannot be created or written
};

/// An error is a value with a message a user can act on. It is thrown only by Result::value().
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

/// Either a value or an Error. `value()` throws the Error when there is no value; `ok()` and
/// `error()` ask politely.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : content_(std::move(value)) {}
  Result(Error error) : content_(std::move(error)) {}

  bool ok() const { return std::holds_alternative<T>(content_); }
  explicit operator bool() const { return ok(); }

  T& value() & { return check(), std::get<T>(content_); }
  const T& value() const& { return check(), std::get<T>(content_); }
  T&& value() && { return check(), std::get<T>(std::move(content_)); }
  const Error& error() const { return std::get<Error>(content_); }

 private:
  void check() const {
    if (!ok()) throw std::get<Error>(content_);
  }
  std::variant<T, Error> content_;
};

/// A Result without a value: success, or an Error.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}

  bool ok() const { return !error_.has_value(); }
  explicit operator bool() const { return ok(); }
  void value() const {
    if (error_) throw *error_;
  }
  const Error& error() const { return *error_; }

 private:
  std::optional<Error> error_;
};

}  // namespace sheaf
