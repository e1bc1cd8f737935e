// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bzlib.h>
#include <zlib.h>

#include <cstddef>
#include <string_view>

namespace sheaf {

enum class Compression { none, gzip, bzip2 };

/// "none", "gzip", "bzip2".
const char* to_string(Compression compression);

/// One gzip member or bzip2 stream after another, a piece at a time. Checks every check sum.
class Decompressor {
 public:
  enum class State { running, member_ended, failed };
  struct Progress {
    std::size_t consumed = 0;  ///< bytes of the input
    std::size_t produced = 0;  ///< bytes of the output
    State state = State::running;
  };

  explicit Decompressor(Compression compression) : compression_(compression) {}
  Decompressor(const Decompressor&) = delete;
  Decompressor& operator=(const Decompressor&) = delete;
  ~Decompressor() { end_member(); }

  void begin_member();
  Progress advance(std::string_view input, char* output, std::size_t capacity);

  /// Whether the current member has not produced anything: it may not be one at all.
  bool at_header() const { return produced_ == 0; }

 private:
  void end_member();
  Progress advance_gzip(std::string_view input, char* output, std::size_t capacity);
  Progress advance_bzip2(std::string_view input, char* output, std::size_t capacity);

  Compression compression_;
  z_stream zlib_{};
  bz_stream bzip2_{};
  bool open_ = false;
  std::size_t produced_ = 0;  ///< by the current member
};

}  // namespace sheaf
