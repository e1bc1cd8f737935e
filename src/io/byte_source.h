// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "io/decompressor.h"
#include "sheaf/error.h"

namespace sheaf {

class Sha256;

/// The bytes of a file, a pipe or a block of memory as they lie there. Reads with read(2) rather
/// than a mapping: a file that shrinks meanwhile is then a short read, not a signal.
class RawBytes {
 public:
  static Result<RawBytes> open(const std::filesystem::path& path);
  /// The same, of a file in a folder: a pipe, which would have to be waited for, or a device, which
  /// may never end, is an error.
  static Result<RawBytes> open_regular(const std::filesystem::path& path);
  RawBytes(std::string_view bytes, std::string name);
  RawBytes(RawBytes&& other) noexcept;
  RawBytes& operator=(RawBytes&&) = delete;
  ~RawBytes();

  /// Fills up to `capacity` bytes; fewer only at the end.
  Result<std::size_t> read(char* to, std::size_t capacity);

  const std::string& name() const { return name_; }
  std::optional<std::uint64_t> size() const { return size_; }  ///< unknown for a pipe
  std::uint64_t bytes_read() const { return bytes_read_; }
  void hash_into(Sha256* hash) { hash_ = hash; }  ///< every byte read from now on

 private:
  RawBytes() = default;
  static Result<RawBytes> open_with(const std::filesystem::path& path, bool regular);

  int fd_ = -1;
  std::string_view memory_;
  std::string name_;
  std::optional<std::uint64_t> size_;
  std::uint64_t bytes_read_ = 0;
  Sha256* hash_ = nullptr;
};

/// The bytes after decompression, which is recognised by the first bytes, never by the name.
/// Several gzip members or bzip2 streams in a row are one text; anything else behind them is an
/// error, as are truncated and corrupt data. Holds one block of 64 KiB.
class ByteSource {
 public:
  static Result<ByteSource> open(RawBytes raw);
  ByteSource(ByteSource&&) noexcept;
  ~ByteSource();

  /// Fills up to `capacity` bytes; fewer only at the end of the text.
  Result<std::size_t> read(char* to, std::size_t capacity);

  /// The first bytes of the text, up to 64, behind a byte order mark, which is left out; `read`
  /// begins with them all the same.
  Result<std::string_view> head();

  /// What is left of the text, as a whole; compressed text at most 64 times as large as the file.
  Result<std::string> read_rest();

  /// Refuses to decompress to more than this (at first 1 MiB; plain text has no limit).
  void limit_text(std::uint64_t bytes) { limit_ = bytes; }

  const std::string& name() const { return raw_.name(); }
  Compression compression() const { return compression_; }
  const RawBytes& raw() const { return raw_; }

 private:
  explicit ByteSource(RawBytes raw);
  Result<void> refill_block();
  Result<std::size_t> read_plain(char* to, std::size_t capacity);
  Result<std::size_t> read_compressed(char* to, std::size_t capacity);
  Error corrupt(const std::string& found) const;

  RawBytes raw_;
  Compression compression_ = Compression::none;
  std::vector<char> block_;
  std::size_t used_ = 0, filled_ = 0;  ///< of block_
  std::unique_ptr<Decompressor> decompressor_;
  std::uint64_t members_ = 0;  ///< gzip members or bzip2 streams that ended
  bool in_member_ = false;
  std::string head_;
  std::size_t head_used_ = 0;
  std::uint64_t text_bytes_ = 0;
  std::uint64_t limit_ = std::uint64_t{1} << 20;
};

/// The whole text of a file, plain or compressed. Errors: unreadable_input.
Result<std::string> read_text(const std::filesystem::path& path);

}  // namespace sheaf
