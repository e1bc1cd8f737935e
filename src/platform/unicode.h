// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

namespace sheaf {

/// A name as names are compared: in Unicode's normal form C, so that an accent that one system
/// writes as a character of its own (macOS, in names of files) and another as part of a letter is
/// the same. What is no UTF-8 is left as it stands.
std::string comparable_name(std::string_view name);

/// Whether a text is UTF-8, as JSON has to be.
bool is_utf8(std::string_view text);

/// The text behind a byte order mark (UTF-8's), which some editors put before a text.
inline std::string_view without_mark(std::string_view text) {
  constexpr std::string_view kMark = "\xef\xbb\xbf";
  return text.starts_with(kMark) ? text.substr(kMark.size()) : text;
}

}  // namespace sheaf
