// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/folder_files.h"

#include "image/jpeg.h"
#include "io/byte_source.h"

namespace sheaf {

namespace fs = std::filesystem;

Result<std::string> bytes_of(const fs::path& path) {
  Result<RawBytes> raw = RawBytes::open_regular(path);
  if (!raw.ok()) return raw.error();
  std::string out;
  constexpr std::size_t kBlock = 1 << 18;
  for (;;) {
    const std::size_t before = out.size();
    out.resize(before + kBlock);
    const Result<std::size_t> n = raw.value().read(out.data() + before, kBlock);
    if (!n.ok()) return n.error();
    out.resize(before + n.value());
    if (n.value() < kBlock) return out;
  }
}

FolderFiles files_in(const fs::path& folder) {
  return {folder,
          [folder](const std::string& name) {
            std::error_code ignored;
            return fs::exists(folder / name, ignored);
          },
          [folder](const std::string& name) { return bytes_of(folder / name); }};
}

Result<Raster> raster_in(const FolderFiles& files, const std::string& name,
                         const ImageBounds& bounds) {
  const Result<std::string> bytes = files.bytes(name);
  if (!bytes.ok()) return bytes.error();
  return decode_image(bytes.value(), files.name(name), bounds);
}

Result<GreyImage> grey_in(const FolderFiles& files, const std::string& name,
                          const ImageBounds& bounds) {
  const Result<Raster> raster = raster_in(files, name, bounds);
  if (!raster.ok()) return raster.error();
  return GreyImage{raster.value().width, raster.value().height, grey_of(raster.value())};
}

Result<void> make_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error) return {};
  return Error(ErrorCode::unwritable_output,
               folder.string() + ": the folder cannot be made: " + error.message());
}

Result<OutputFolder> make_output_folder(const fs::path& target) {
  const fs::path around = behind_links(target).parent_path();
  if (!around.empty())
    if (Result<void> made = make_folder(around); !made.ok()) return made.error();
  return OutputFolder::create(target);
}

Result<void> write_bytes(OutputFolder& folder, const fs::path& name, const std::string& bytes) {
  Result<OutputFile> out = folder.create_file(name);
  if (!out.ok()) return out.error();
  out.value().write(bytes);
  return out.value().commit();
}

Result<void> duplicate_file(const fs::path& from, OutputFolder& folder, const fs::path& name) {
  if (folder.is_there(name, from)) return {};
  const Result<std::string> bytes = bytes_of(from);
  if (!bytes.ok()) return bytes.error();
  return write_bytes(folder, name, bytes.value());
}

}  // namespace sheaf
