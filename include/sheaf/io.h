// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
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
  std::string format;       ///< "bal", "colmap", "colmap-text", "bundler", "nvm" or "libmv"
  std::string compression;  ///< "none", "gzip" or "bzip2"
  std::string sha256;       ///< 64 hexadecimal digits, or empty when not asked for
  std::uint64_t bytes = 0;  ///< size on disk
  double read_s = 0;        ///< seconds spent reading and parsing
  /// Sentences about what of the file is not in the problem.
  std::vector<std::string> notes;
};

/// Reads a problem: a file of BAL, Bundler, NVM or libmv, or the folder of a COLMAP model. Format
/// and compression are sniffed from the content, never from the name; docs/formats.md describes
/// them. The hash of a folder is that of its files one behind the other: cameras, images, points3D,
/// rigs, frames. Errors: ErrorCode::unreadable_input with file, line (or byte), what was found,
/// what was expected.
Result<InputFile> read_file(const std::filesystem::path& path, const ReadOptions& options = {});
Result<Problem> read(const std::filesystem::path& path);

struct WriteOptions {
  /// "bal", "colmap" (binary), "colmap-text", "bundler", "nvm", "libmv" or "ply"; empty: by the
  /// name, as `write_format` tells.
  std::string format;
};

/// The format that a problem is written in, by the path's name: `.ply` is a point cloud with camera
/// frusta, `.out` Bundler, `.nvm` NVM, `.problem` libmv, all before a `.gz` or `.bz2`. A folder, a
/// name that ends in a slash and, for a problem that came from a COLMAP model, a name without
/// extension, is a COLMAP model, in the form that was read. Anything else is BAL.
std::string write_format(const Problem& problem, const std::filesystem::path& path);

/// Writes a problem, beside the target and then renamed over it; a trailing `.gz` or `.bz2`
/// compresses what is one file. Every double is stated exactly (in text in the shortest form that
/// reads back to the same bits); what was not changed since it was read is written as it stood.
/// Errors: ErrorCode::unwritable_output; ErrorCode::usage for a problem that the format cannot
/// hold; the target is then as it was.
Result<void> write(const Problem& problem, const std::filesystem::path& path,
                   const WriteOptions& options = {});

/// Sentences about what of a problem this format does not hold; none where nothing is lost.
std::vector<std::string> lost_in(const std::string& format, const Problem& problem);

/// Whether `write` to this path can begin: the folder exists and a file can be created beside the
/// target, or, for a model, in it where it is a folder. Leaves nothing behind.
Result<void> check_writable(const std::filesystem::path& path, bool model = false);

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
