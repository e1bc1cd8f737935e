// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "io/folder_files.h"
#include "sheaf/error.h"
#include "sheaf/io.h"

namespace sheaf {

/// A line of rgb.txt or depth.txt: time, and a file's name within the folder. # begins a comment.
struct TimedFile {
  double time = 0;  ///< seconds
  std::string name;
};
Result<std::vector<TimedFile>> parse_file_list(std::string_view text, const std::string& name);

/// A line of groundtruth.txt: time, then where the camera is (tx ty tz) and how it is turned (qx qy
/// qz qw): world_from_camera. The numbered layout's pose.txt has no times.
struct TimedPose {
  double time = 0;
  Pose pose;  ///< cam_from_world
};
Result<std::vector<TimedPose>> parse_trajectory(std::string_view text, const std::string& name,
                                                bool timed);

/// hosts.txt: a line per point, its host image, the pixel's x and y there, and its inverse depth.
Result<void> parse_rgbd_hosts(std::string_view text, const std::string& name,
                              PhotometricFolder& folder);

/// How far apart in time an image and its depth or pose may be: as TUM's own tools have it.
constexpr double kSameMoment_s = 0.02;

/// The folder as a whole, not yet validated. Points are those of hosts.txt, or are chosen.
Result<PhotometricFolder> read_rgbd(const FolderFiles& files,
                                    const PhotometricReadOptions& options);
Result<void> write_rgbd(const PhotometricFolder& folder, OutputFolder& out);

}  // namespace sheaf
