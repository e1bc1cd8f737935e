// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/rotation.h"
#include "io/direct_folder.h"
#include "io/rgbd_folder.h"
#include "scene/depth_points.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

/// world_from_camera, as it was read.
void put_trajectory(const PhotometricFolder& folder, bool timed, TextBuffer& text) {
  for (std::size_t i = 0; i < folder.problem.poses.size(); ++i) {
    const Pose& pose = folder.problem.poses[i];
    const auto& q = pose.rotation;
    const Vector3<double> c = multiply(
        matrix_from_quaternion(Quaternion<double>{q[0], -q[1], -q[2], -q[3]}), pose.translation);
    if (timed) text.put(folder.times[i], ' ');
    for (int d = 0; d < 3; ++d) text.put(0 - c[d], ' ');
    for (int k : {1, 2, 3}) text.put(0 - q[k], ' ');
    text.put(q[0], '\n');
  }
}

void put_hosts(const PhotometricProblem& problem, TextBuffer& text) {
  for (std::size_t i = 0; i < problem.host.size(); ++i) {
    text.put(problem.host[i], ' ');
    text.put(problem.host_xy[2 * i], ' '), text.put(problem.host_xy[2 * i + 1], ' ');
    text.put(1 / depth_in(problem, i, problem.host[i]), '\n');
  }
}

/// By number images follow each other without a gap, whichever were taken.
fs::path name_of(const PhotometricFolder& folder, const fs::path& file, std::size_t i) {
  const fs::path name = file.lexically_relative(folder.source);
  if (folder.format == "rgbd") return name;
  const std::size_t first = folder.files[0].filename() == "0.png" ? 0 : 1;
  return name.parent_path() / (std::to_string(first + i) + ".png");
}

/// Copies of the files, and their list by time.
Result<void> write_files(const PhotometricFolder& folder, const std::vector<fs::path>& files,
                         OutputFolder& out, const char* list) {
  std::string lines;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const fs::path name = name_of(folder, files[i], i);
    if (auto r = duplicate_file(files[i], out, name); !r.ok()) return r;
    char time[32];
    lines.append(time, std::to_chars(time, time + sizeof time, folder.times[i]).ptr);
    lines += " " + name.string() + "\n";
  }
  return list == nullptr ? Result<void>() : write_bytes(out, list, lines);
}

}  // namespace

Result<void> write_rgbd(const PhotometricFolder& folder, OutputFolder& out) {
  const bool timed = folder.format == "rgbd";
  if (auto r = write_text_file(out, timed ? "groundtruth.txt" : "pose.txt",
                               [&](TextBuffer& t) { put_trajectory(folder, timed, t); });
      !r.ok())
    return r;
  if (auto r =
          write_text_file(out, "hosts.txt", [&](TextBuffer& t) { put_hosts(folder.problem, t); });
      !r.ok())
    return r;
  if (auto r = write_looks(folder.problem, out); !r.ok()) return r;
  if (auto r = write_files(folder, folder.files, out, timed ? "rgb.txt" : nullptr); !r.ok())
    return r;
  return write_files(folder, folder.depth_files, out, timed ? "depth.txt" : nullptr);
}

}  // namespace sheaf
