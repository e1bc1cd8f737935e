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

/// An InputFile says what was read, and from what.
struct InputFile {
  Problem problem;
  /// "bal", "colmap", "colmap-text", "bundler", "nvm", "libmv", "opensfm", "openmvg",
  /// "alicevision", "g2o" or "sba".
  std::string format;
  std::string compression;  ///< "none", "gzip" or "bzip2"
  std::string sha256;       ///< 64 hexadecimal digits, or empty when not asked for
  std::uint64_t bytes = 0;  ///< size on disk
  double read_s = 0;        ///< seconds spent reading and parsing
  /// Sentences about what of the file is not in the problem.
  std::vector<std::string> notes;
};

/// Reads a problem: a file of BAL, Bundler, NVM, libmv, OpenSfM (with tracks.csv beside it),
/// OpenMVG, AliceVision or g2o, or the folder of a COLMAP model or of SBA's files. Format and
/// compression are sniffed from the content, never from the name; docs/formats.md describes them.
/// The hash of a folder is that of its files one behind the other: cameras, images, points3D, rigs,
/// frames. Errors: ErrorCode::unreadable_input with file, line (or byte), what was found, what was
/// expected.
Result<InputFile> read_file(const std::filesystem::path& path, const ReadOptions& options = {});
Result<Problem> read(const std::filesystem::path& path);

struct WriteOptions {
  /// "bal", "colmap" (binary), "colmap-text", "bundler", "nvm", "libmv", "opensfm", "openmvg",
  /// "alicevision", "nerfstudio" or "ply"; empty: by the name, as `write_format` tells.
  std::string format;
};

/// The format that a problem is written in, by the path's name: `.ply` is a point cloud with camera
/// frusta, `.out` Bundler, `.nvm` NVM, `.problem` libmv, `.sfm` AliceVision, `reconstruction.json`
/// OpenSfM, `sfm_data.json` OpenMVG, `transforms.json` nerfstudio, all before a `.gz` or `.bz2`;
/// another `.json` is the JSON that was read, or "json", which `write` refuses. A folder, a name
/// with a slash at its end and, of what came from a COLMAP model, one without extension is a COLMAP
/// model, in the form that was read, or text for lenses without number. Anything else is BAL.
std::string write_format(const Problem& problem, const std::filesystem::path& path);

/// Writes a problem, beside the target and then renamed over it; a trailing `.gz` or `.bz2`
/// compresses what is one file. Every double is stated exactly (in text in the shortest form that
/// reads back to the same bits); what was not changed since it was read is written as it stood.
/// Errors: ErrorCode::unwritable_output; ErrorCode::usage for a problem that the format cannot
/// hold, that is not valid, or whose ids occur twice or names hold zero bytes or line ends, which
/// `read` would refuse; the target is then as it was.
Result<void> write(const Problem& problem, const std::filesystem::path& path,
                   const WriteOptions& options = {});

/// Sentences about what of a problem this format does not hold; none where nothing is lost.
std::vector<std::string> lost_in(const std::string& format, const Problem& problem);

/// Whether `write` can put the problem's lenses and names into this format, found without writing.
/// Errors: usage, saying what it cannot hold.
Result<void> can_hold(const std::string& format, const Problem& problem);

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
  std::string format;              ///< "direct", "rgbd", "rgbd-numbered", "colmap" or "colmap-text"
  std::vector<double> times;       ///< one for each image, as the folder states them, or empty
  std::filesystem::path source{};  ///< the folder; empty: not from files
  std::vector<std::filesystem::path> files{};        ///< of the images, or empty: not from files
  std::vector<std::filesystem::path> depth_files{};  ///< of their depth maps ("rgbd")
  std::vector<Pose> given_poses{};           ///< as the folder has them, where these were disturbed
  Problem model{};                           ///< of a COLMAP model: what the state is written into
  std::vector<std::uint32_t> model_point{};  ///< its point that each point is
  std::vector<std::string> notes{};          ///< sentences about what of the folder is left out
  double read_s = 0;                         ///< seconds spent reading and decoding
};

struct PhotometricReadOptions {
  std::optional<Pinhole> camera{};  ///< of all images, instead of what the folder says
  PoseNoise noise{};                ///< disturbs the poses, before it is decided what they see
  int every = 1;                    ///< RGB-D: takes the first image and every so many after it
  /// RGB-D: what a depth image has for one scene unit; 0 and 65535 are no depth.
  double depth_scale = 5000;
  int cell_px = 16;                  ///< RGB-D: at most one point in each square of this size
  double least_slope = 2;            ///< RGB-D: grey levels per pixel that a point needs
  std::uint32_t max_points = 20000;  ///< RGB-D: those with the steepest slopes
  double depth_tolerance =
      0.1;  ///< RGB-D, relative: a patch counts where a depth map has its depth
  std::filesystem::path images{};  ///< of a COLMAP model; empty: its folder's own "images"
};

/// Reads a folder of images with poses and points. What it is, its files tell:
///   poses.txt                          "direct": images 0.png, 1.png, ... and points.txt, with
///                                      their patches, or the pixels of their hosts
///   rgb.txt, depth.txt, groundtruth.txt  "rgbd": lists of grey or colour images and depth maps by
///                                      time, and a trajectory, as TUM's benchmark has them
///   pose.txt, color/, depth/           "rgbd-numbered": the same, by number
///   cameras.bin or cameras.txt         a COLMAP model of pinholes, whose images lie elsewhere
/// docs/photometric.md describes them. Errors: ErrorCode::unreadable_input; usage where intrinsics
/// or images are missing and for lenses that are no pinholes.
Result<PhotometricFolder> read_photometric(const std::filesystem::path& path,
                                           const PhotometricReadOptions& options = {});

/// Writes the state in the folder's format into a folder, which is made where it is not there and
/// else replaced whole, other files in it kept; images that were read are copied (not those of a
/// COLMAP model), others become PNG of 8 bits. `details` go along (see below). Errors:
/// ErrorCode::unwritable_output.
Result<void> write_photometric(const PhotometricFolder& folder, const std::filesystem::path& path,
                               const PhotometricDetails* details = nullptr);

/// Writes what `examine_photometric` found into a folder that is there:
///   visibility.txt  a line per point: the images that its patch is seen in; its host is not listed
///   sigma.txt       a line per point: the standard deviation of its inverse depth in its host, or
///   three of X, Y and Z; "inf" where nothing determines it
/// Errors: ErrorCode::unwritable_output.
Result<void> write_photometric_details(const PhotometricDetails& details, std::size_t points,
                                       const std::filesystem::path& path);

/// Poses, lenses and points alone, for `write_ply` and comparisons; pixels count as COLMAP's do.
Problem cloud_of(const PhotometricProblem& problem);

/// The same, each point in the colour of its pixel: in its host, or, without hosts, in that of the
/// images `seen` that its patch fits best. Colours are read from the images' files again, where
/// there are such; points that no image shows are grey. Errors: ErrorCode::unreadable_input.
Result<Problem> coloured_cloud_of(const PhotometricFolder& folder,
                                  const std::vector<PatchSight>& seen);

}  // namespace sheaf
