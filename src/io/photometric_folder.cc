// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <chrono>
#include <cmath>
#include <new>
#include <optional>
#include <utility>

#include "io/colmap.h"
#include "io/direct_folder.h"
#include "io/model_images.h"
#include "io/rgbd_folder.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

Result<PhotometricFolder> read_model(const FolderFiles& files,
                                     const PhotometricReadOptions& options) {
  if (options.camera)
    return Error(ErrorCode::usage,
                 files.folder.string() + ": a COLMAP model has intrinsics of its own");
  if (options.images.empty() && !files.has("images"))
    return Error(ErrorCode::usage,
                 files.folder.string() + ": a COLMAP model without its images; say where they are");
  Result<InputFile> model = read_file(files.folder);
  if (!model.ok()) return model.error();
  PhotometricFolder folder;
  folder.format = model.value().format;
  folder.model = std::move(model.value().problem);
  const fs::path images = options.images.empty() ? files.folder / "images" : options.images;
  if (Result<void> added = add_images(files_in(images), folder); !added.ok()) return added.error();
  return folder;
}

Result<PhotometricFolder> read_what_it_is(const FolderFiles& files,
                                          const PhotometricReadOptions& options) {
  if (files.has("poses.txt")) return read_direct(files, options);
  if (files.has("rgb.txt") || (files.has("pose.txt") && files.has("depth")))
    return read_rgbd(files, options);
  if (files.has("cameras.bin") || files.has("cameras.txt")) return read_model(files, options);
  return Error(ErrorCode::unreadable_input,
               files.folder.string() +
                   ": found none of poses.txt (images with points), rgb.txt or pose.txt with "
                   "depth/ (RGB-D), cameras.bin or cameras.txt (a COLMAP model)");
}

std::optional<Error> wrong_options(const PhotometricReadOptions& o) {
  const auto usage = [](const char* text) { return Error(ErrorCode::usage, text); };
  if (o.every < 1) return usage("every so many images: a whole number from 1 up");
  if (!(o.depth_scale >= 1e-6 && o.depth_scale <= 1e9))
    return usage("the depth scale is 1e-6 to 1e9 per scene unit");
  if (o.cell_px < 1 || o.cell_px > 10000) return usage("cells of points are 1 to 10000 pixels");
  if (!(o.least_slope >= 0 && std::isfinite(o.least_slope)))
    return usage("the least slope is a finite number from 0 up");
  if (o.max_points < 1) return usage("at least 1 point");
  if (!(o.depth_tolerance > 0)) return usage("the tolerance of depths is above 0");
  return {};
}

Result<PhotometricFolder> read_and_check(const fs::path& path,
                                         const PhotometricReadOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  if (auto wrong = wrong_options(options)) return *wrong;
  std::error_code ignored;
  if (!fs::is_directory(path, ignored))
    return Error(ErrorCode::unreadable_input,
                 path.string() + ": no such folder; expected one with images, or a COLMAP model");
  Result<PhotometricFolder> read = read_what_it_is(files_in(path), options);
  if (!read.ok()) return read;
  PhotometricFolder& folder = read.value();
  folder.source = path;
  if (Result<void> valid = validate(folder.problem); !valid.ok())
    return Error(ErrorCode::unreadable_input, path.string() + ": " + valid.error().what());
  if (folder.given_poses.empty() &&
      (options.noise.rotation_rad != 0 || options.noise.center != 0)) {
    folder.given_poses = folder.problem.poses;
    if (auto moved = disturb(folder.problem, options.noise); !moved.ok()) return moved.error();
  }
  folder.read_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return read;
}

}  // namespace

Result<PhotometricFolder> read_photometric(const fs::path& path,
                                           const PhotometricReadOptions& options) {
  try {
    return read_and_check(path, options);
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, path.string() + ": not enough memory for these images");
  }
}

Result<void> write_photometric(const PhotometricFolder& folder, const fs::path& path,
                               const PhotometricDetails* details) {
  Result<OutputFolder> out = make_output_folder(path);
  if (!out.ok()) return out.error();
  const auto put_state = [&] {
    if (folder.format.starts_with("rgbd")) return write_rgbd(folder, out.value());
    if (folder.format.starts_with("colmap"))
      return put_model(model_with_state(folder), folder.format == "colmap-text", out.value());
    return write_direct(folder, out.value());
  };
  if (auto r = put_state(); !r.ok()) return r;
  if (details != nullptr)
    if (auto r = write_details(*details, folder.problem.num_points(), out.value()); !r.ok())
      return r;
  return out.value().commit();
}

}  // namespace sheaf
