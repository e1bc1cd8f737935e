// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <utility>

namespace sheaf {
namespace {

constexpr std::size_t kLongestName = 200;  // of NAME in the partial's name: file systems allow 255
constexpr std::size_t kCompressedBytes = 1 << 16;
constexpr int kGzipLevel = 4;  // on BAL text three times as fast as 6 and 4% larger
constexpr std::size_t kLargestPiece = 1 << 30;  // zlib and bzip2 count in 32 bits

Error unwritable(const std::filesystem::path& path, const std::string& why) {
  return Error(ErrorCode::unwritable_output, path.string() + ": cannot be written: " + why);
}

Error unwritable(const std::filesystem::path& path, int error) {
  return unwritable(path, std::strerror(error));
}

std::filesystem::path partial_beside(const std::filesystem::path& target) {
  static std::atomic<unsigned> serial = 0;
  const std::string name = target.filename().string().substr(0, kLongestName);
  return target.parent_path() /
         (name + ".partial-" + std::to_string(::getpid()) + "-" + std::to_string(serial++));
}

}  // namespace

Result<OutputFile> OutputFile::create(const std::filesystem::path& target,
                                      Compression compression) {
  OutputFile out;
  out.compression_ = compression;
  out.target_ = target;
  if (target.empty()) return unwritable(target, "the name is empty");
  struct stat status;
  const bool exists = ::stat(target.c_str(), &status) == 0;
  if (exists && S_ISDIR(status.st_mode)) return unwritable(target, "it is a directory");
  if (exists && ::access(target.c_str(), W_OK) != 0) return unwritable(target, errno);
  if (exists && !S_ISREG(status.st_mode)) {
    out.fd_ = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    // Through a symbolic link, so that the file it names is replaced and not the link.
    std::error_code ignored;
    const std::filesystem::path real = std::filesystem::canonical(target, ignored);
    if (exists && !ignored) out.target_ = real;
    out.partial_ = partial_beside(out.target_);
    out.fd_ = ::open(out.partial_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC,
                     exists ? status.st_mode & 07777 : 0666);
  }
  if (out.fd_ < 0) {
    const int error = errno;
    out.partial_.clear();
    return unwritable(target, error);
  }
  if (exists && !out.partial_.empty()) (void)::fchmod(out.fd_, status.st_mode & 07777);
  out.open_compressor();
  return out;
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : target_(std::move(other.target_)),
      partial_(std::exchange(other.partial_, {})),
      fd_(std::exchange(other.fd_, -1)),
      compression_(other.compression_),
      zlib_(std::move(other.zlib_)),
      bzip2_(std::move(other.bzip2_)),
      compressed_(std::move(other.compressed_)),
      error_(std::move(other.error_)) {}

OutputFile::~OutputFile() {
  close_compressor();
  if (fd_ >= 0) ::close(fd_);
  if (!partial_.empty()) ::unlink(partial_.c_str());
}

void OutputFile::open_compressor() {
  if (compression_ == Compression::none) return;
  compressed_.resize(kCompressedBytes);
  bool good;
  if (compression_ == Compression::gzip) {
    zlib_ = std::make_unique<z_stream>();
    good =
        deflateInit2(zlib_.get(), kGzipLevel, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) == Z_OK;
  } else {
    bzip2_ = std::make_unique<bz_stream>();
    good = BZ2_bzCompressInit(bzip2_.get(), 9, 0, 0) == BZ_OK;
  }
  if (!good) fail(ENOMEM);
}

void OutputFile::close_compressor() {
  if (zlib_) deflateEnd(zlib_.get());
  if (bzip2_) BZ2_bzCompressEnd(bzip2_.get());
  zlib_.reset();
  bzip2_.reset();
}

/// One call of the library into an empty `compressed_`; negative on failure, 1 at the end.
int OutputFile::compress_step(bool finish, std::size_t& produced) {
  if (zlib_) {
    zlib_->next_out = reinterpret_cast<Bytef*>(compressed_.data());
    zlib_->avail_out = kCompressedBytes;
    const int code = deflate(zlib_.get(), finish ? Z_FINISH : Z_NO_FLUSH);
    produced = kCompressedBytes - zlib_->avail_out;
    return code == Z_STREAM_END ? 1 : code == Z_OK || code == Z_BUF_ERROR ? 0 : -1;
  }
  bzip2_->next_out = compressed_.data();
  bzip2_->avail_out = kCompressedBytes;
  const int code = BZ2_bzCompress(bzip2_.get(), finish ? BZ_FINISH : BZ_RUN);
  produced = kCompressedBytes - bzip2_->avail_out;
  return code == BZ_STREAM_END ? 1 : code == BZ_RUN_OK || code == BZ_FINISH_OK ? 0 : -1;
}

void OutputFile::compress(const char* data, std::size_t size, bool finish) {
  if (zlib_) {
    zlib_->next_in = reinterpret_cast<Bytef*>(const_cast<char*>(data));
    zlib_->avail_in = static_cast<uInt>(size);
  } else {
    bzip2_->next_in = const_cast<char*>(data);
    bzip2_->avail_in = static_cast<unsigned>(size);
  }
  for (int step = 0; step == 0 && !error_;) {
    std::size_t produced = 0;
    const unsigned left = zlib_ ? zlib_->avail_in : bzip2_->avail_in;
    if (!finish && left == 0) return;
    step = compress_step(finish, produced);
    if (step < 0) return fail(EIO);
    write_raw(compressed_.data(), produced);
  }
}

void OutputFile::write(const char* data, std::size_t size) {
  while (size > 0 && !error_) {
    const std::size_t piece = std::min(size, kLargestPiece);
    if (compression_ == Compression::none) {
      write_raw(data, piece);
    } else {
      compress(data, piece, false);
    }
    data += piece, size -= piece;
  }
}

void OutputFile::write_raw(const char* data, std::size_t size) {
  while (size > 0 && !error_) {
    const ssize_t n = ::write(fd_, data, size);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return fail(errno);
    data += n, size -= static_cast<std::size_t>(n);
  }
}

void OutputFile::fail(int error) {
  if (!error_) error_ = unwritable(target_, error);
}

Result<void> OutputFile::commit() {
  if (!error_ && compression_ != Compression::none) compress(nullptr, 0, true);
  // Some file systems tell of a full disk only here.
  if (fd_ >= 0 && ::close(std::exchange(fd_, -1)) != 0) fail(errno);
  if (error_) return *error_;
  if (!partial_.empty()) {
    if (::rename(partial_.c_str(), target_.c_str()) != 0) {
      fail(errno);
      return *error_;
    }
    partial_.clear();
  }
  return {};
}

}  // namespace sheaf
