// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "terminal.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <iostream>

namespace sheaf {
namespace {

/// The bytes of the character that the text begins with, and the character; 0 bytes where it is no
/// UTF-8 (overlong forms, surrogates and what is beyond U+10FFFF included).
struct Character {
  std::size_t bytes;
  char32_t code;
};

Character first_of(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  const unsigned head = byte(0);
  if (head < 0x80) return {1, head};
  const std::size_t bytes = head < 0xc2   ? 0
                            : head < 0xe0 ? 2
                            : head < 0xf0 ? 3
                            : head < 0xf5 ? 4
                                          : 0;
  if (bytes == 0) return {0, 0};
  char32_t code = head & (0x7fu >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return {0, 0};
    code = code << 6 | (byte(i) & 0x3f);
  }
  const bool overlong = (bytes == 3 && code < 0x800) || (bytes == 4 && code < 0x10000);
  const bool surrogate = code >= 0xd800 && code < 0xe000;
  return {overlong || surrogate || code > 0x10ffff ? 0 : bytes, code};
}

bool is_plain(char32_t code) {
  if (code < 0x20 || (code >= 0x7f && code < 0xa0)) return false;  // controls of ISO 6429
  if (code == 0x2028 || code == 0x2029) return false;              // ends of lines and paragraphs
  // What turns the direction of writing makes a line look like another one.
  return code != 0x200e && code != 0x200f && code != 0x61c && !(code >= 0x202a && code <= 0x202e) &&
         !(code >= 0x2066 && code <= 0x2069);
}

/// Appends the first character, plain or escaped, and takes it off.
void take(std::string_view& text, bool lines, std::string& out) {
  const auto [bytes, code] = first_of(text);
  if (bytes == 0) {
    out += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[0]));
  } else if (is_plain(code) || (lines && (code == '\n' || code == '\t'))) {
    out += text.substr(0, bytes);
  } else if (code == '\n' || code == '\t') {
    out += code == '\n' ? "\\n" : "\\t";
  } else if (code < 0x80) {
    out += fmt::format("\\x{:02x}", static_cast<unsigned>(code));
  } else {
    out += fmt::format("\\u{{{:x}}}", static_cast<unsigned>(code));
  }
  text.remove_prefix(bytes == 0 ? 1 : bytes);
}

std::string escaped(std::string_view text, bool lines) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) take(text, lines, out);
  return out;
}

/// Of the first failure of stdout, which later calls would lose.
int& stdout_error() {
  static int error = 0;
  return error;
}

void note_stdout(bool good) {
  if (!good && stdout_error() == 0) stdout_error() = errno != 0 ? errno : EIO;
}

}  // namespace

std::string printable(std::string_view text) { return escaped(text, false); }

void print_text(std::string_view text, std::FILE* stream) {
  const std::string safe = escaped(text, true);
  errno = 0;
  const bool good = std::fwrite(safe.data(), 1, safe.size(), stream) == safe.size();
  if (stream == stdout) note_stdout(good);
}

void guard_streams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (::fcntl(fd, F_GETFD) < 0 && errno == EBADF)
      // The lowest free number is this one: those below it are open by now.
      (void)!::open("/dev/null", fd == STDOUT_FILENO ? O_RDONLY : O_RDWR);
}

std::string finish_stdout() {
  errno = 0;
  std::cout.flush();
  note_stdout(std::cout.good());
  errno = 0;
  note_stdout(std::fflush(stdout) == 0 && std::ferror(stdout) == 0);
  return stdout_error() == 0 ? "" : std::strerror(stdout_error());
}

}  // namespace sheaf
