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

/// A file that appears whole or not at all: written beside its target (NAME.partial-PID-N), and
/// renamed over it by `commit`. Without commit nothing is left and the target is as it was. A
/// target that exists and is no regular file (a pipe, a device) is written directly.
class OutputFile {
 public:
  static Result<OutputFile> create(const std::filesystem::path& target, Compression compression);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;
  ~OutputFile();

  /// Keeps the first error for `commit`; afterwards does nothing.
  void write(const char* data, std::size_t size);
  void write(const std::string& text) { write(text.data(), text.size()); }

  /// Whether a write has failed: what follows is in vain.
  bool failed() const { return error_.has_value(); }

  /// Compresses what is left, closes and renames.
  Result<void> commit();

 private:
  OutputFile() = default;
  void open_compressor();
  void compress(const char* data, std::size_t size, bool finish);
  int compress_step(bool finish, std::size_t& produced);
  void close_compressor();
  void write_raw(const char* data, std::size_t size);
  void fail(int error);

  std::filesystem::path target_;
  std::filesystem::path partial_;  ///< empty when written directly
  int fd_ = -1;
  Compression compression_ = Compression::none;
  std::unique_ptr<z_stream> zlib_;  // on the heap: both libraries point back at their stream
  std::unique_ptr<bz_stream> bzip2_;
  std::vector<char> compressed_;
  std::optional<Error> error_;
};

}  // namespace sheaf
