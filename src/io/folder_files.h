// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "image/grey.h"
#include "image/image_bounds.h"
#include "io/output_folder.h"
#include "io/text_buffer.h"
#include "sheaf/error.h"
#include "sheaf/photometric.h"

namespace sheaf {

/// The bytes of a regular file, whatever its size turns out to be.
Result<std::string> bytes_of(const std::filesystem::path& path);

/// The files of a folder: on a disk, or in memory where a test or a fuzzer makes them up.
struct FolderFiles {
  std::filesystem::path folder;  ///< messages begin with it
  std::function<bool(const std::string&)> has;
  std::function<Result<std::string>(const std::string&)> bytes;

  std::string name(const std::string& file) const { return (folder / file).string(); }
};
FolderFiles files_in(const std::filesystem::path& folder);

/// A decoded image of the folder. Errors: unreadable_input.
Result<Raster> raster_in(const FolderFiles& files, const std::string& name,
                         const ImageBounds& bounds = {});
/// As grey levels.
Result<GreyImage> grey_in(const FolderFiles& files, const std::string& name,
                          const ImageBounds& bounds = {});

/// Errors of writing: unwritable_output. Folders are made where they are not there.
Result<void> make_folder(const std::filesystem::path& folder);
/// A folder to write into, with the folders that it lies in.
Result<OutputFolder> make_output_folder(const std::filesystem::path& target);
Result<void> write_bytes(OutputFolder& folder, const std::filesystem::path& name,
                         const std::string& bytes);
/// A file that is what the folder has under this name stays.
Result<void> duplicate_file(const std::filesystem::path& from, OutputFolder& folder,
                            const std::filesystem::path& name);

/// A text made by `put(TextBuffer&)`.
template <class Put>
Result<void> write_text_file(OutputFolder& folder, const std::filesystem::path& name,
                             const Put& put) {
  Result<OutputFile> out = folder.create_file(name);
  if (!out.ok()) return out.error();
  TextBuffer text(out.value());
  put(text);
  text.flush();
  return out.value().commit();
}

}  // namespace sheaf
