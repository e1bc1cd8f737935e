// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/output_folder.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

namespace sheaf {
namespace {

namespace fs = std::filesystem;

/// Both names change places in one step; false where the system has no such call.
bool exchange_names(const fs::path& a, const fs::path& b) {
#if defined(RENAME_EXCHANGE)
  return ::renameat2(AT_FDCWD, a.c_str(), AT_FDCWD, b.c_str(), RENAME_EXCHANGE) == 0;
#elif defined(__APPLE__) && defined(RENAME_SWAP)
  return ::renamex_np(a.c_str(), b.c_str(), RENAME_SWAP) == 0;
#else
  (void)a, (void)b;
  return false;
#endif
}

/// Who stands in a folder that is replaced would stand in one that is gone.
bool stands_in(const fs::path& folder) {
  std::error_code error;
  const fs::path here = fs::current_path(error);
  if (error) return true;
  for (fs::path at = here;; at = at.parent_path()) {
    if (fs::equivalent(at, folder, error)) return true;
    if (at == at.parent_path()) return false;
  }
}

void take_attributes(const fs::path& from, const fs::path& to) {
  struct stat status;
  if (::stat(from.c_str(), &status) != 0) return;
  if (::chown(to.c_str(), status.st_uid, status.st_gid) != 0)
    (void)!::chown(to.c_str(), static_cast<uid_t>(-1), status.st_gid);
  (void)::chmod(to.c_str(), status.st_mode & 07777);
}

bool leads_out(const fs::path& name) {
  return !name.has_filename() || name.is_absolute() ||
         std::find(name.begin(), name.end(), "..") != name.end();
}

}  // namespace

Result<OutputFolder> OutputFolder::create(const fs::path& target) {
  OutputFolder out;
  out.shown_ = target;
  if (target.empty()) return unwritable(target, "the name is empty");
  std::error_code error;
  out.target_ = behind_links(target);
  const fs::path real = fs::canonical(out.target_, error);
  if (!error) out.target_ = real;  // "." and ".." have no name to write beside
  const fs::file_status status = fs::status(out.target_, error);
  out.replaces_ = fs::is_directory(status);
  if (!out.replaces_ && fs::exists(status)) return unwritable(target, "it is there and no folder");
  if (out.replaces_ && ::access(out.target_.c_str(), W_OK | X_OK) != 0)
    return unwritable(target, errno);
  if (out.replaces_ && stands_in(out.target_)) out.whole_ = false;
  Result<Partial> staging = claim_partial_folder(out.whole_ ? out.target_ : out.target_ / "folder",
                                                 out.replaces_ ? 0700 : 0777, target);
  if (!staging.ok() && out.replaces_ && out.whole_) {
    out.whole_ = false;
    staging = claim_partial_folder(out.target_ / "folder", 0700, target);
  }
  if (!staging.ok()) return staging.error();
  out.staging_ = std::move(staging.value().path);
  out.lock_ = staging.value().fd;
  return out;
}

OutputFolder::OutputFolder(OutputFolder&& other) noexcept
    : shown_(std::move(other.shown_)),
      target_(std::move(other.target_)),
      staging_(std::exchange(other.staging_, {})),
      lock_(std::exchange(other.lock_, -1)),
      replaces_(other.replaces_),
      whole_(other.whole_),
      files_(std::move(other.files_)),
      folders_(std::move(other.folders_)) {}

OutputFolder::~OutputFolder() {
  remove_staging();
  if (lock_ >= 0) ::close(lock_);
}

void OutputFolder::remove_staging() {
  std::error_code ignored;
  if (!staging_.empty()) fs::remove_all(staging_, ignored);
  staging_.clear();
}

bool OutputFolder::had(const fs::path& name) const {
  std::error_code ignored;
  return replaces_ && fs::exists(fs::symlink_status(target_ / name, ignored));
}

bool OutputFolder::is_there(const fs::path& name, const fs::path& file) const {
  std::error_code ignored;
  return replaces_ && fs::equivalent(target_ / name, file, ignored);
}

Result<OutputFile> OutputFolder::create_file(const fs::path& name) {
  if (leads_out(name)) return unwritable(shown_ / name, "the name leads out of the folder");
  std::error_code error;
  if (fs::is_symlink(target_ / name, error)) {
    whole_ = false;
    return OutputFile::create(target_ / name, Compression::none);
  }
  if (fs::is_directory(target_ / name, error)) return unwritable(shown_ / name, "it is a folder");
  fs::path folder;
  for (const fs::path& part : name.parent_path()) {
    folder /= part;
    if (fs::is_symlink(target_ / folder, error)) whole_ = false;
    if (std::find(folders_.begin(), folders_.end(), folder) != folders_.end()) continue;
    if (!fs::create_directory(staging_ / folder, error))
      return unwritable(shown_ / folder, error.message());
    take_attributes(target_ / folder, staging_ / folder);
    folders_.push_back(folder);
  }
  files_.push_back(name);
  return OutputFile::create_within(staging_ / name, shown_ / name, target_ / name);
}

Result<void> OutputFolder::sync_folders() const {
  for (const fs::path& folder : folders_)
    if (const int error = sync_folder(staging_ / folder)) return unwritable(shown_, error);
  if (const int error = sync_folder(staging_)) return unwritable(shown_, error);
  return {};
}

/// Second links, in the new folder, to the old one's files that it has not; false where there can
/// be none.
bool OutputFolder::keep_others(const fs::path& inner) const {
  std::error_code error;
  for (fs::directory_iterator at(target_ / inner, error), end; !error && at != end;
       at.increment(error)) {
    const fs::path name = inner / at->path().filename();
    std::error_code failed;
    const fs::file_status there = fs::symlink_status(staging_ / name, failed);
    const bool folder = fs::is_directory(at->symlink_status(failed));
    if (!folder && fs::exists(there)) continue;
    if (!folder) {
      if (::linkat(AT_FDCWD, at->path().c_str(), AT_FDCWD, (staging_ / name).c_str(), 0) != 0)
        return false;
      continue;
    }
    if (fs::exists(there) && !fs::is_directory(there)) return false;
    if (!fs::exists(there)) {
      if (!fs::create_directory(staging_ / name, failed)) return false;
      take_attributes(at->path(), staging_ / name);
    }
    if (!keep_others(name)) return false;
  }
  return !error;
}

/// False where it was not done; the old folder is as it was then.
bool OutputFolder::exchange() {
  if (!whole_ || !keep_others("")) return false;
  take_attributes(target_, staging_);
  const int old = ::open(target_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (old >= 0) (void)::flock(old, LOCK_EX | LOCK_NB);  // so that nobody takes it for left behind
  const bool done = exchange_names(staging_, target_);
  std::error_code error;
  // What somebody put there meanwhile goes along.
  if (done)
    for (const auto& entry : fs::directory_iterator(staging_, error))
      if (const fs::path to = target_ / entry.path().filename();
          !fs::exists(fs::symlink_status(to, error)))
        fs::rename(entry.path(), to, error);
  if (done) remove_staging();
  if (old >= 0) ::close(old);
  return done;
}

Result<void> OutputFolder::move_one_by_one() {
  std::error_code error;
  for (const fs::path& folder : folders_)
    if (fs::create_directory(target_ / folder, error); error)
      return unwritable(shown_ / folder, error.message());
  for (const fs::path& name : files_)
    if (::rename((staging_ / name).c_str(), (target_ / name).c_str()) != 0)
      return unwritable(shown_ / name, errno);
  for (const fs::path& folder : folders_)
    if (const int failed = sync_folder(target_ / folder)) return unwritable(shown_, failed);
  if (const int failed = sync_folder(target_)) return unwritable(shown_, failed);
  remove_staging();
  return {};
}

Result<void> OutputFolder::commit() {
  if (Result<void> done = sync_folders(); !done.ok()) return done;
  if (!replaces_) {
    // A name that somebody else took meanwhile is no folder of files to be kept: it is refused.
    if (::rename(staging_.c_str(), target_.c_str()) != 0) return unwritable(shown_, errno);
    staging_.clear();
  } else if (!exchange()) {
    return move_one_by_one();
  }
  if (const int error = sync_folder(target_.parent_path())) return unwritable(shown_, error);
  return {};
}

}  // namespace sheaf
