// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/partial.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <string>

namespace sheaf {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName = 200;  // of NAME in the partial's name: file systems allow 255
constexpr int kMost = 1000;                // of the partials of one target
constexpr int kMostLinks = 40;

fs::path partial_name(const fs::path& target, int n) {
  const std::string name = target.filename().string().substr(0, kLongestName);
  return target.parent_path() / (name + ".sheaf-partial-" + std::to_string(n));
}

/// Whether the name is still that of the open file: another process may have removed it meanwhile.
bool is_named(int fd, const fs::path& path) {
  struct stat open, named;
  return ::fstat(fd, &open) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         open.st_dev == named.st_dev && open.st_ino == named.st_ino;
}

/// Removes what a dead process left under this name. False where its writer lives, or nobody can
/// tell.
bool remove_if_dead(const fs::path& path) {
  constexpr int kFlags = O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;
  int fd = ::open(path.c_str(), O_RDWR | kFlags);
  if (fd < 0 && errno == EISDIR) fd = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | kFlags);
  if (fd < 0) return errno == ENOENT;
  std::error_code error;
  bool removed = false;
  if (::flock(fd, LOCK_EX | LOCK_NB) == 0 && is_named(fd, path)) {
    fs::remove_all(path, error);
    removed = !error;
  }
  ::close(fd);
  return removed;
}

void remove_dead_behind(const fs::path& target, int n) {
  struct stat status;
  while (++n < kMost && ::lstat(partial_name(target, n).c_str(), &status) == 0)
    (void)remove_if_dead(partial_name(target, n));
}

/// `make` creates what was not there and opens it, or returns -1 and sets errno.
template <class Make>
Result<Partial> claim(const fs::path& target, const fs::path& shown, const Make& make) {
  for (int n = 0; n < kMost; ++n) {
    const fs::path path = partial_name(target, n);
    int fd = make(path);
    if (fd < 0 && errno == EEXIST) {
      if (!remove_if_dead(path)) continue;
      fd = make(path);
    }
    if (fd < 0 && errno == EEXIST) continue;
    if (fd < 0) return unwritable(shown, errno);
    // Without locks on this file system its name is taken until somebody removes it.
    const bool lost = ::flock(fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    if (!lost && is_named(fd, path)) {
      remove_dead_behind(target, n);
      return Partial{path, fd};
    }
    ::close(fd);
  }
  return unwritable(shown,
                    partial_name(target, 0).string() + " and those behind it are in the way");
}

/// Names of partial files, where a signal handler can read them.
struct Remembered {
  std::atomic<bool> taken{false}, readable{false};
  char path[1024] = "";
};
std::array<Remembered, 16> remembered;

}  // namespace

void remember_partial(const fs::path& path) noexcept {
  if (path.native().size() >= sizeof Remembered::path) return;
  for (Remembered& at : remembered) {
    if (at.taken.exchange(true)) continue;
    std::strcpy(at.path, path.c_str());
    at.readable = true;
    return;
  }
}

void forget_partial(const fs::path& path) noexcept {
  for (Remembered& at : remembered) {
    if (!at.readable || path.native() != at.path) continue;
    at.readable = false;
    at.taken = false;
    return;
  }
}

void unlink_partial_files() noexcept {
  for (const Remembered& at : remembered)
    if (at.readable) ::unlink(at.path);
}

Error unwritable(const fs::path& path, const std::string& why) {
  return Error(ErrorCode::unwritable_output, path.string() + ": cannot be written: " + why);
}

Error unwritable(const fs::path& path, int error) {
  return unwritable(path, std::string(std::strerror(error)));
}

Result<Partial> claim_partial_file(const fs::path& target, mode_t mode, const fs::path& shown) {
  return claim(target, shown, [mode](const fs::path& path) {
    return ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, mode);
  });
}

Result<Partial> claim_partial_folder(const fs::path& target, mode_t mode, const fs::path& shown) {
  return claim(target, shown, [mode](const fs::path& path) {
    if (::mkdir(path.c_str(), mode) != 0) return -1;
    return ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  });
}

fs::path behind_links(fs::path path) {
  std::error_code ignored;
  if (!path.has_filename() && path.has_parent_path() && path != path.root_path())
    path = path.parent_path();
  for (int n = 0; n < kMostLinks && fs::is_symlink(path, ignored); ++n) {
    const fs::path next = fs::read_symlink(path, ignored);
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return path;
}

int sync_file(int fd) {
  if (::fsync(fd) == 0) return 0;
  // Pipes, devices and some file systems have nothing to keep.
  return errno == EINVAL || errno == ENOTSUP || errno == ENOSYS || errno == EROFS ? 0 : errno;
}

int sync_folder(const fs::path& folder) {
  const int fd = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return 0;  // a folder that may be written in but not listed
  const int error = sync_file(fd);
  ::close(fd);
  return error;
}

}  // namespace sheaf
