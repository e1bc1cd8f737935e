// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <string_view>
#include <utility>

#include "io/partial.h"
#include "platform/transfers.h"

namespace sheaf {
namespace {

constexpr std::size_t kCompressedBytes = 1 << 16;
constexpr int kGzipLevel = 4;  // on BAL text three times as fast as 6 and 4% larger
constexpr std::size_t kLargestPiece = 1 << 30;  // zlib and bzip2 count in 32 bits

namespace fs = std::filesystem;

/// Mode, owner and group of the file that is replaced. Who may not give files away keeps them, and
/// then no right to act as their owner goes along.
void take_attributes(int fd, const struct stat& of) {
  struct stat own;
  if (::fstat(fd, &own) != 0) return;
  mode_t mode = of.st_mode & 07777;
  if (own.st_uid != of.st_uid || own.st_gid != of.st_gid) {
    if (::fchown(fd, of.st_uid, of.st_gid) != 0) {
      mode &= 0777;
      (void)!::fchown(fd, static_cast<uid_t>(-1), of.st_gid);
    }
  }
  (void)::fchmod(fd, mode);
}

/// The descriptor that a name like /dev/stdout or /dev/fd/3 stands for; -1 for other names.
int named_descriptor(const fs::path& target) {
  const std::string name = target.lexically_normal().string();
  if (name == "/dev/stdout") return STDOUT_FILENO;
  if (name == "/dev/stderr") return STDERR_FILENO;
  for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (!name.starts_with(folder)) continue;
    const char *begin = name.data() + folder.size(), *end = name.data() + name.size();
    int fd = -1;
    const auto [stop, error] = std::from_chars(begin, end, fd);
    if (error == std::errc() && stop == end) return fd;
  }
  return -1;
}

}  // namespace

Result<OutputFile> OutputFile::create(const fs::path& target, Compression compression) {
  OutputFile out;
  out.compression_ = compression;
  out.shown_ = target;
  if (target.empty()) return unwritable(target, "the name is empty");
  struct stat status;
  const bool exists = ::stat(target.c_str(), &status) == 0;
  if (!exists && errno != ENOENT) return unwritable(target, errno);
  if (exists && S_ISDIR(status.st_mode)) return unwritable(target, "it is a directory");
  const int open = named_descriptor(target);
  if (exists && open < 0 && ::access(target.c_str(), W_OK) != 0) return unwritable(target, errno);
  if (open >= 0) {
    out.fd_ = ::fcntl(open, F_DUPFD_CLOEXEC, 0);
  } else if (exists && !S_ISREG(status.st_mode)) {
    out.fd_ = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
  } else {
    out.target_ = behind_links(target);
    Result<Partial> partial = claim_partial_file(out.target_, exists ? 0600 : 0666, target);
    if (!partial.ok()) return partial.error();
    out.partial_ = std::move(partial.value().path);
    out.fd_ = partial.value().fd;
    remember_partial(out.partial_);
    if (exists) take_attributes(out.fd_, status);
  }
  if (out.fd_ < 0) return unwritable(target, errno);
  out.open_compressor();
  return out;
}

Result<OutputFile> OutputFile::create_within(const fs::path& path, const fs::path& shown,
                                             const fs::path& replaced) {
  OutputFile out;
  out.shown_ = shown;
  struct stat status;
  const bool exists = ::stat(replaced.c_str(), &status) == 0 && S_ISREG(status.st_mode);
  out.fd_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_NOFOLLOW | O_CLOEXEC, 0666);
  if (out.fd_ < 0) return unwritable(shown, errno);
  out.new_ = path;
  if (exists) take_attributes(out.fd_, status);
  return out;
}

OutputFile::OutputFile(OutputFile&& other) noexcept
    : shown_(std::move(other.shown_)),
      target_(std::move(other.target_)),
      partial_(std::exchange(other.partial_, {})),
      new_(std::exchange(other.new_, {})),
      fd_(std::exchange(other.fd_, -1)),
      compression_(other.compression_),
      zlib_(std::move(other.zlib_)),
      bzip2_(std::move(other.bzip2_)),
      compressed_(std::move(other.compressed_)),
      error_(std::move(other.error_)) {}

OutputFile::~OutputFile() {
  close_compressor();
  // Unlinked first: the lock must outlast the name.
  if (!partial_.empty()) forget_partial(partial_);
  for (const fs::path* path : {&partial_, &new_})
    if (!path->empty()) ::unlink(path->c_str());
  if (fd_ >= 0) ::close(fd_);
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
    transfers.written.fetch_add(static_cast<std::uint64_t>(n), std::memory_order_relaxed);
    data += n, size -= static_cast<std::size_t>(n);
  }
}

void OutputFile::fail(int error) {
  if (!error_) error_ = unwritable(shown_, error);
}

Result<void> OutputFile::commit() {
  if (!error_ && compression_ != Compression::none) compress(nullptr, 0, true);
  // Some file systems tell of a full disk only here.
  if (const int error = error_ || fd_ < 0 ? 0 : sync_file(fd_)) fail(error);
  if (error_) return *error_;
  if (Result<void> done = replace(); !done.ok()) return done;
  // Of what is whole and in its place; pipes and devices may tell here what went wrong.
  if (fd_ >= 0 && ::close(std::exchange(fd_, -1)) != 0) fail(errno);
  if (error_) return *error_;
  return {};
}

Result<void> OutputFile::replace() {
  new_.clear();
  if (partial_.empty()) return {};
  forget_partial(partial_);  // the name may be another process's as soon as it is free
  if (::rename(partial_.c_str(), target_.c_str()) != 0) return unwritable(shown_, errno);
  partial_.clear();
  if (const int error = sync_folder(target_.parent_path())) return unwritable(shown_, error);
  return {};
}

}  // namespace sheaf
