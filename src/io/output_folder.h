// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "io/output_file.h"
#include "io/partial.h"
#include "sheaf/error.h"

namespace sheaf {

/// A folder whose files appear together: they are written into a folder beside it (io/partial.h),
/// and `commit` exchanges the two in one step, so that whoever looks sees all old files or all new
/// ones. Other files that are there stay, by hard links to the same files. Without commit nothing
/// is left and the folder is as it was.
///
/// Where folders cannot be exchanged (the file system or the operating system has no such call, the
/// folder is one that this process stands in or is mounted, no folder can be made beside it, or a
/// file in it cannot have a second link) every file is whole, but they are renamed one by one. A
/// file of it that is a symbolic link stays one; what it names is replaced at once.
class OutputFolder {
 public:
  /// A trailing slash is left out, links are followed. Errors: unwritable_output.
  static Result<OutputFolder> create(const std::filesystem::path& target);
  OutputFolder(OutputFolder&& other) noexcept;
  OutputFolder& operator=(OutputFolder&&) = delete;
  ~OutputFolder();

  /// A new file of it, by a relative name; folders in between are made. Errors: unwritable_output,
  /// also for a name that leads out of the folder.
  Result<OutputFile> create_file(const std::filesystem::path& name);

  /// Whether the folder that is replaced has it.
  bool had(const std::filesystem::path& name) const;
  /// Whether it has this very file under the name.
  bool is_there(const std::filesystem::path& name, const std::filesystem::path& file) const;
  /// As it was named, for messages.
  const std::filesystem::path& shown() const { return shown_; }

  /// After all its files were committed.
  Result<void> commit();

 private:
  OutputFolder() = default;
  bool keep_others(const std::filesystem::path& inner) const;
  bool exchange();
  Result<void> move_one_by_one();
  Result<void> sync_folders() const;
  void remove_staging();

  std::filesystem::path shown_, target_;
  std::filesystem::path staging_;  ///< empty once it is gone
  int lock_ = -1;
  bool replaces_ = false;                               ///< a folder was there
  bool whole_ = true;                                   ///< may be exchanged
  std::vector<std::filesystem::path> files_, folders_;  ///< written; made for them; relative
};

}  // namespace sheaf
