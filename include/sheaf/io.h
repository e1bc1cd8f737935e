// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sheaf/error.h"
#include "sheaf/photometric.h"
#include "sheaf/problem.h"

namespace sheaf {

struct ReadOptions {
  bool hash = false;  ///< also compute the SHA-256 of the file's bytes, on another thread
};

/// What was read, and from what.
struct InputFile {
  Problem problem;
  std::string format;       ///< "bal"
  std::string compression;  ///< "none", "gzip" or "bzip2"
  std::string sha256;       ///< 64 hexadecimal digits, or empty when not asked for
  std::uint64_t bytes = 0;  ///< size on disk
  double read_s = 0;        ///< seconds spent reading and parsing
};

/// Reads a problem; format and compression are sniffed from the content, never from the name.
/// Errors: ErrorCode::unreadable_input with file, line (or byte), what was found, what was
/// expected.
Result<InputFile> read_file(const std::filesystem::path& path, const ReadOptions& options = {});
Result<Problem> read(const std::filesystem::path& path);

/// Writes a problem, beside the target and then renamed over it. The format follows the name:
/// `.ply` is a point cloud with camera frusta, anything else is BAL; a trailing `.gz` or `.bz2`
/// compresses. BAL text states every double exactly (shortest form that reads back to the same
/// bits). Errors: ErrorCode::unwritable_output; the target is then as it was before.
Result<void> write(const Problem& problem, const std::filesystem::path& path);

/// Whether `write` to this path can begin: the folder exists and a file can be created beside the
/// target. Leaves nothing behind.
Result<void> check_writable(const std::filesystem::path& path);

/// Two states of one scene in one binary coloured PLY: the start in grey, the result in colour,
/// each with its camera frusta as points and edges.
Result<void> write_ply(const Problem& before, const Problem& after,
                       const std::filesystem::path& path);

/// A photometric problem and what its folder has beside it.
struct PhotometricFolder {
  PhotometricProblem problem;
  std::string format;                        ///< "direct"
  std::vector<double> times;                 ///< one for each image, as the folder states them
  std::vector<std::filesystem::path> files;  ///< of the images, or empty: not from files
  double read_s = 0;                         ///< seconds spent reading and decoding
};

/// Reads a folder of images with poses and points:
///   poses.txt       a line per image: time, cam_from_world translation, quaternion x y z w
///   points.txt      a line per point: X Y Z, then the grey levels of its 4x4 patch
///   0.png, 1.png    an image per pose
///   intrinsics.txt  fx fy cx cy, unless `camera` gives them
///   hosts.txt       if there: a line per point, the image and pixel x y that its patch is taken
///   from brightness.txt  if there: a line per image, a b
/// Errors: ErrorCode::unreadable_input, or usage where intrinsics are missing.
Result<PhotometricFolder> read_photometric(const std::filesystem::path& path,
                                           const std::optional<Pinhole>& camera = {});

/// Writes the state in the same format into a folder, which is made where it is not there; images
/// that were read are copied, others become PNG of 8 bits. Errors: ErrorCode::unwritable_output.
Result<void> write_photometric(const PhotometricFolder& folder, const std::filesystem::path& path);

}  // namespace sheaf
