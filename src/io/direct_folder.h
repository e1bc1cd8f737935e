// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "io/folder_files.h"
#include "sheaf/error.h"
#include "sheaf/io.h"

namespace sheaf {

/// The text files of a folder as `read_photometric` expects it, from memory; `name` is what
/// messages call them.
///   poses   a line per image: time, cam_from_world translation, quaternion x y z w
///   points  a line per point: X Y Z, then 16 grey levels, dx in -2..1 outside, dy in -2..1 inside
/// and those that may be beside them:
///   hosts         a line per point: image, x and y of its pixel; the 16 grey levels are then not
///                 used
///   brightness    a line per image: a b
///   intrinsics    fx fy cx cy
///   measurements  a line per measured position: point, image, x, y
Result<void> parse_direct_poses(std::string_view text, const std::string& name,
                                PhotometricFolder& folder);
Result<void> parse_direct_points(std::string_view text, const std::string& name,
                                 PhotometricFolder& folder);

Result<void> parse_direct_hosts(std::string_view text, const std::string& name,
                                PhotometricFolder& folder);
Result<void> parse_direct_brightness(std::string_view text, const std::string& name,
                                     PhotometricFolder& folder);
Result<void> parse_direct_measurements(std::string_view text, const std::string& name,
                                       PhotometricFolder& folder);
Result<void> parse_direct_intrinsics(std::string_view text, const std::string& name,
                                     PhotometricFolder& folder);

/// fx fy cx cy: as given, or from intrinsics.txt. Errors: usage where there is neither.
Result<void> find_intrinsics(const FolderFiles& files, const std::optional<Pinhole>& camera,
                             PhotometricFolder& folder);

/// The folder as a whole, not yet validated.
Result<PhotometricFolder> read_direct(const FolderFiles& files,
                                      const PhotometricReadOptions& options);
Result<void> write_direct(const PhotometricFolder& folder, OutputFolder& out);

/// visibility.txt and sigma.txt.
Result<void> write_details(const PhotometricDetails& details, std::size_t points,
                           OutputFolder& out);

/// brightness.txt and intrinsics.txt, as every format writes them.
Result<void> write_looks(const PhotometricProblem& problem, OutputFolder& out);

}  // namespace sheaf
