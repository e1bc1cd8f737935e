// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bzlib.h>
#include <zlib.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "io/decompressor.h"
#include "sheaf/error.h"

namespace sheaf {

/// A file that appears whole or not at all: written beside its target (io/partial.h), kept by the
/// disk and renamed over it by `commit`. Without commit nothing is left and the target is as it
/// was. A file that is replaced leaves its mode to the new one, and its owner and group as far as
/// this process may give files away; a symbolic link stays, and what it names is replaced or made.
/// A target that exists and is no regular file (a pipe, a device), and one that names an open
/// descriptor (/dev/stdout), is written directly.
class OutputFile {
 public:
  static Result<OutputFile> create(const std::filesystem::path& target, Compression compression);
  /// A file of a folder that is not in its place yet: new, under its own name. Messages say
  /// `shown`, where it will be; `replaced` is what is there now, or nothing.
  static Result<OutputFile> create_within(const std::filesystem::path& path,
                                          const std::filesystem::path& shown,
                                          const std::filesystem::path& replaced);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();

  /// Keeps the first error for `commit`; afterwards does nothing.
  void write(const char* data, std::size_t size);
  void write(const std::string& text) { write(text.data(), text.size()); }

  /// Whether a write has failed: what follows is in vain.
  bool failed() const { return error_.has_value(); }

  /// Compresses what is left, waits for the disk, renames and closes.
  Result<void> commit();

 private:
  OutputFile() = default;
  Result<void> replace();
  void open_compressor();
  void compress(const char* data, std::size_t size, bool finish);
  int compress_step(bool finish, std::size_t& produced);
  void close_compressor();
  void write_raw(const char* data, std::size_t size);
  void fail(int error);

  std::filesystem::path shown_;    ///< as it was named
  std::filesystem::path target_;   ///< behind links
  std::filesystem::path partial_;  ///< empty when written directly
  std::filesystem::path new_;      ///< of `create_within`, until it is whole
  int fd_ = -1;
  Compression compression_ = Compression::none;
  std::unique_ptr<z_stream> zlib_;  // on the heap: both libraries point back at their stream
  std::unique_ptr<bz_stream> bzip2_;
  std::vector<char> compressed_;
  std::optional<Error> error_;
};

}  // namespace sheaf
