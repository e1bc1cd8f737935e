// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// The command, with these in place of the C library's own: the n-th call that opens a file for
// writing, writes to one, keeps it on the disk or renames it fails, for the n of the variable
// SHEAF_FAILING_FILE_CALL, and only that one: with "no space left on device" where it writes, with
// an error of the device elsewhere.

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdlib>

#include "command_line.h"
#include "verb.h"

namespace {

std::atomic<long> left{0};

bool fails(int error) {
  if (left <= 0 || --left != 0) return false;
  errno = error;
  return true;
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const unsigned mode = (flags & O_CREAT) != 0 ? va_arg(rest, unsigned) : 0;
  va_end(rest);
  if ((flags & O_ACCMODE) != O_RDONLY && fails(EIO)) return -1;
  return static_cast<int>(::syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}

ssize_t write(int file, const void* data, size_t size) {
  if (file > STDERR_FILENO && fails(ENOSPC)) return -1;
  return ::syscall(SYS_write, file, data, size);
}

int fsync(int file) {
  if (fails(EIO)) return -1;
  return static_cast<int>(::syscall(SYS_fsync, file));
}

int rename(const char* from, const char* to) noexcept {
  if (fails(EIO)) return -1;
  return static_cast<int>(::syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0u));
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to,
              unsigned flags) noexcept {
  if (fails(EIO)) return -1;
  return static_cast<int>(::syscall(SYS_renameat2, from_folder, from, to_folder, to, flags));
}

}  // extern "C"

int main(int argc, char** argv) {
  const char* text = std::getenv("SHEAF_FAILING_FILE_CALL");
  left = text != nullptr ? std::atol(text) : 0;
  return sheaf::run_command_line(argc, argv, sheaf::all_verbs);
}
