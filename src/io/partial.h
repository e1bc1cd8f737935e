// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <filesystem>

#include "sheaf/error.h"

namespace sheaf {

/// A name beside a target, NAME.sheaf-partial-N, under which it is written until it is whole.
/// Whoever writes holds a lock on it, so that what a process left that was killed is told from what
/// a living one writes, whatever their numbers are: it is removed when the name is claimed again.
struct Partial {
  std::filesystem::path path;
  int fd = -1;  ///< of the file, open for writing, or of the folder; it holds the lock
};

/// A new empty file. Errors: unwritable_output, which name `shown`.
Result<Partial> claim_partial_file(const std::filesystem::path& target, mode_t mode,
                                   const std::filesystem::path& shown);
/// A new empty folder.
Result<Partial> claim_partial_folder(const std::filesystem::path& target, mode_t mode,
                                     const std::filesystem::path& shown);

/// Until `forget_partial`, a signal handler that ends the process may remove the file first, by
/// `unlink_partial_files`, which neither waits nor allocates. Only so many files are remembered;
/// what is left beside is cleaned by the next claim.
void remember_partial(const std::filesystem::path& path) noexcept;
void forget_partial(const std::filesystem::path& path) noexcept;
void unlink_partial_files() noexcept;

/// "PATH: cannot be written: why", ErrorCode::unwritable_output.
Error unwritable(const std::filesystem::path& path, const std::string& why);
Error unwritable(const std::filesystem::path& path, int error);

/// What a chain of symbolic links names, whether it is there or not, without the slash that a
/// folder's name may end with.
std::filesystem::path behind_links(std::filesystem::path path);

/// Has the disk keep what a folder lists. Returns errno, or 0, also where a file system cannot.
int sync_folder(const std::filesystem::path& folder);
/// The same of an open file.
int sync_file(int fd);

}  // namespace sheaf
