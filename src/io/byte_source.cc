// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/byte_source.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "io/sha256.h"
#include "platform/transfers.h"
#include "platform/unicode.h"

namespace sheaf {
namespace {

constexpr std::size_t kBlockBytes = 1 << 16;

Error unreadable(const std::string& message) { return Error(ErrorCode::unreadable_input, message); }

Error unreadable(const std::string& name, int error) {
  return unreadable(name + ": found: " + std::strerror(error) + ", expected a readable file");
}

bool starts_with(std::string_view bytes, std::string_view magic) {
  return bytes.substr(0, magic.size()) == magic;
}

Compression sniff(std::string_view bytes) {
  if (starts_with(bytes, "\x1f\x8b")) return Compression::gzip;
  // After "BZh" and the block size comes the magic number of a block, or of the end of the stream.
  if (starts_with(bytes, "BZh") && bytes.size() > 4 &&
      (starts_with(bytes.substr(4), "\x31\x41\x59") ||
       starts_with(bytes.substr(4), "\x17\x72\x45")))
    return Compression::bzip2;
  return Compression::none;
}

}  // namespace

Result<RawBytes> RawBytes::open(const std::filesystem::path& path) {
  return open_with(path, false);
}

Result<RawBytes> RawBytes::open_regular(const std::filesystem::path& path) {
  return open_with(path, true);
}

Result<RawBytes> RawBytes::open_with(const std::filesystem::path& path, bool regular) {
  RawBytes raw;
  raw.name_ = path.string();
  raw.fd_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | (regular ? O_NONBLOCK : 0));
  if (raw.fd_ < 0) return unreadable(raw.name_, errno);
  struct stat status;
  if (::fstat(raw.fd_, &status) != 0) return unreadable(raw.name_, errno);
  if (S_ISDIR(status.st_mode))
    return unreadable(raw.name_ + ": found a directory, expected a file");
  if (regular && !S_ISREG(status.st_mode))
    return unreadable(raw.name_ + ": found a pipe or a device, expected a regular file");
  if (S_ISREG(status.st_mode)) {
    raw.size_ = static_cast<std::uint64_t>(status.st_size);
#if defined(POSIX_FADV_SEQUENTIAL)
    ::posix_fadvise(raw.fd_, 0, 0, POSIX_FADV_SEQUENTIAL);
#endif
  }
  return raw;
}

RawBytes::RawBytes(std::string_view bytes, std::string name)
    : memory_(bytes), name_(std::move(name)), size_(bytes.size()) {}

RawBytes::RawBytes(RawBytes&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)),
      memory_(other.memory_),
      name_(std::move(other.name_)),
      size_(other.size_),
      bytes_read_(other.bytes_read_),
      hash_(other.hash_) {}

RawBytes::~RawBytes() {
  if (fd_ >= 0) ::close(fd_);
}

Result<std::size_t> RawBytes::read(char* to, std::size_t capacity) {
  std::size_t done = 0;
  if (fd_ < 0) {
    done = memory_.copy(to, capacity);
    memory_.remove_prefix(done);
  }
  while (fd_ >= 0 && done < capacity) {
    const ssize_t n = ::read(fd_, to + done, capacity - done);
    if (n == 0) break;
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return unreadable(name_, errno);
    done += static_cast<std::size_t>(n);
  }
  bytes_read_ += done;
  transfers.read.fetch_add(done, std::memory_order_relaxed);
  if (hash_ != nullptr) hash_->update(to, done);
  return done;
}

ByteSource::ByteSource(RawBytes raw) : raw_(std::move(raw)), block_(kBlockBytes) {}
ByteSource::ByteSource(ByteSource&&) noexcept = default;
ByteSource::~ByteSource() = default;

Result<ByteSource> ByteSource::open(RawBytes raw) {
  ByteSource source(std::move(raw));
  if (Result<void> filled = source.refill_block(); !filled.ok()) return filled.error();
  if (source.filled_ == 0)
    return unreadable(source.name() + ": found an empty file, expected text");
  source.compression_ = sniff({source.block_.data(), source.filled_});
  if (source.compression_ != Compression::none)
    source.decompressor_ = std::make_unique<Decompressor>(source.compression_);
  return source;
}

Result<void> ByteSource::refill_block() {
  const Result<std::size_t> n = raw_.read(block_.data(), block_.size());
  if (!n.ok()) return n.error();
  used_ = 0;
  filled_ = n.value();
  return {};
}

Result<std::string_view> ByteSource::head() {
  constexpr std::size_t kHead = 64;
  if (head_.empty()) {
    std::string first(kHead, '\0');
    const Result<std::size_t> n = read(first.data(), kHead);
    if (!n.ok()) return n.error();
    head_ = without_mark(std::string_view(first).substr(0, n.value()));
  }
  return std::string_view(head_);
}

Result<std::string> ByteSource::read_rest() {
  constexpr std::size_t kPiece = 1 << 20;
  limit_text((std::uint64_t{1} << 20) + 64 * raw_.size().value_or(std::uint64_t{1} << 30));
  std::string text;
  text.reserve(compression_ == Compression::none ? raw_.size().value_or(0) + 1 : 0);
  for (std::size_t filled = 0;;) {
    text.resize(filled + kPiece);
    const Result<std::size_t> n = read(text.data() + filled, kPiece);
    if (!n.ok()) return n.error();
    filled += n.value();
    text.resize(filled);
    if (n.value() < kPiece) return text;
  }
}

Result<std::size_t> ByteSource::read(char* to, std::size_t capacity) {
  if (head_used_ < head_.size()) {
    const std::size_t first = head_.copy(to, capacity, head_used_);
    head_used_ += first;
    if (first == capacity) return first;
    const Result<std::size_t> rest = read(to + first, capacity - first);
    if (!rest.ok()) return rest.error();
    return first + rest.value();
  }
  return decompressor_ ? read_compressed(to, capacity) : read_plain(to, capacity);
}

Result<std::size_t> ByteSource::read_plain(char* to, std::size_t capacity) {
  const std::size_t first = std::min(capacity, filled_ - used_);
  std::copy_n(block_.data() + used_, first, to);
  used_ += first;
  const Result<std::size_t> rest = raw_.read(to + first, capacity - first);
  if (!rest.ok()) return rest.error();
  return first + rest.value();
}

Error ByteSource::corrupt(const std::string& found) const {
  const std::uint64_t byte = raw_.bytes_read() - (filled_ - used_);
  return unreadable(name() + ": byte " + std::to_string(byte) + ": found " + found);
}

Result<std::size_t> ByteSource::read_compressed(char* to, std::size_t capacity) {
  const std::string kind = to_string(compression_);
  std::size_t done = 0;
  while (done < capacity) {
    if (used_ == filled_)
      if (Result<void> filled = refill_block(); !filled.ok()) return filled.error();
    if (filled_ == 0 && !in_member_) return done;
    if (filled_ == 0)
      return corrupt("the end of the file, expected the rest of its " + kind +
                     " data (truncated?)");
    if (!in_member_) decompressor_->begin_member();
    in_member_ = true;

    const Decompressor::Progress step = decompressor_->advance(
        {block_.data() + used_, filled_ - used_}, to + done, capacity - done);
    used_ += step.consumed;
    done += step.produced;
    text_bytes_ += step.produced;
    if (text_bytes_ > limit_)
      return corrupt(kind + " data that unpack to more than " + std::to_string(limit_) +
                     " bytes, expected no more than the header's counts can need");
    if (step.state == Decompressor::State::failed && members_ > 0 && decompressor_->at_header())
      return corrupt("other bytes behind the " + kind + " data, expected the end of the file");
    if (step.state == Decompressor::State::failed)
      return corrupt("corrupt data, expected valid " + kind + " data");
    if (step.state == Decompressor::State::member_ended) {
      in_member_ = false;
      ++members_;
    }
  }
  return done;
}

Result<std::string> read_text(const std::filesystem::path& path) {
  Result<RawBytes> raw = RawBytes::open(path);
  if (!raw.ok()) return raw.error();
  Result<ByteSource> source = ByteSource::open(std::move(raw).value());
  if (!source.ok()) return source.error();
  return source.value().read_rest();
}

}  // namespace sheaf
