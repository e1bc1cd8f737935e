// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>

namespace sheaf {

/// A text of the outside (a file's name, a word of a file, what a peer said) as a terminal may be
/// shown it: control characters, line ends among them, what turns the direction of writing and
/// bytes that are no UTF-8 become \n, \t, \xHH or \u{HHHH}.
std::string printable(std::string_view text);

/// A text of several lines, on stdout or stderr, `printable` but for its line ends and tabs.
/// Neither throws nor stops at a stream that fails: stderr is no result, and what became of stdout
/// is told by `finish_stdout`.
void print_text(std::string_view text, std::FILE* stream = stdout);

/// Descriptors 0 to 2, where they are closed, are opened on nothing, so that no file gets their
/// numbers: writing to a closed stdout fails still, to a closed stderr it does nothing.
void guard_streams();

/// Whether all that was printed on stdout has arrived; else why not, in words.
std::string finish_stdout();

/// A text made here, whose line ends are meant.
struct Lines {
  std::string text;
};

/// What an argument of `print_out` is printed as: texts are `printable`.
template <class T>
inline constexpr bool kIsText =
    std::is_convertible_v<const T&, std::string_view> || std::is_same_v<T, Lines>;
template <class T>
using Shown = std::conditional_t<kIsText<T>, std::string, const T&>;

template <class T>
Shown<T> shown(const T& value) {
  if constexpr (std::is_same_v<T, Lines>)
    return value.text;
  else if constexpr (kIsText<T>)
    return printable(value);
  else
    return value;
}

/// On stdout, as `print_text`.
template <class... Args>
void print_out(fmt::format_string<std::remove_cvref_t<Shown<Args>>...> format,
               const Args&... args) {
  print_text(fmt::format(fmt::runtime(fmt::string_view(format)), shown(args)...));
}

/// On stderr, as `print_text`.
template <class... Args>
void print_err(fmt::format_string<std::remove_cvref_t<Shown<Args>>...> format,
               const Args&... args) {
  print_text(fmt::format(fmt::runtime(fmt::string_view(format)), shown(args)...), stderr);
}

}  // namespace sheaf
