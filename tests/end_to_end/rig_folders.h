// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <sstream>
#include <string>
#include <vector>

#include "end_to_end/command.h"
#include "scene/rigs.h"
#include "sheaf/io.h"

// COLMAP models of a stereo rig with four frames, made by the command and then edited.
namespace sheaf::test {

/// As the command writes it: images, rigs and frames agree.
inline void make_rig_folder(const TemporaryFolder& folder, const std::string& name) {
  const std::vector<std::string> scene{"generate",         name + "-binary",
                                       "--rigs",           "stereo",
                                       "--frames",         "4",
                                       "--points",         "60",
                                       "--camera",         "SIMPLE_RADIAL",
                                       "--rotation-noise", "0",
                                       "--center-noise",   "0",
                                       "--point-noise",    "0",
                                       "--focal-noise",    "0"};
  ASSERT_EQ(run_command(scene, folder.path()).exit_code, 0);
  ASSERT_EQ(
      run_command({"convert", name + "-binary", name, "--format", "colmap-text"}, folder.path())
          .exit_code,
      0);
}

/// The lines of a file, each as `change` makes it.
template <class Change>
void change_lines(const std::filesystem::path& path, const Change& change) {
  std::string out;
  std::istringstream lines(contents_of(path));
  for (std::string line; std::getline(lines, line);) out += change(line) + "\n";
  write_text(path, out);
}

/// The same with other poses in images.txt, half a unit off along the axis.
inline void make_stale_folder(const TemporaryFolder& folder, const std::string& name) {
  make_rig_folder(folder, name);
  change_lines(folder / (name + "/images.txt"), [](const std::string& line) {
    if (!line.ends_with(".png")) return line;
    std::istringstream words(line);
    std::vector<std::string> word;
    for (std::string w; words >> w;) word.push_back(w);
    word[7] = std::to_string(std::stod(word[7]) + 0.5);
    std::string out = word[0];
    for (std::size_t k = 1; k < word.size(); ++k) out += " " + word[k];
    return out;
  });
}

inline std::string numbers_of(const Pose& pose) {
  std::ostringstream out;
  out.precision(17);
  for (const double q : pose.rotation) out << " " << q;
  for (const double t : pose.translation) out << " " << t;
  return out.str();
}

/// The same with an IMU for the rig's origin, whose id is that of a camera: both cameras are turned
/// and moved against it, and frames are its poses.
inline void make_imu_folder(const TemporaryFolder& folder, const std::string& name) {
  make_rig_folder(folder, name);
  const Problem problem = read(folder / name).value();
  Pose first;  // of the first camera
  first.rotation = normalized(Quaternion<double>{0.98, 0.05, 0.1, 0.15});
  first.translation = {0.05, 0.02, -0.1};
  const Pose second = pose_in_rig(problem.rigs.sensor_from_rig[1], first);
  write_text(folder / (name + "/rigs.txt"), "1 3 IMU 1 CAMERA 1 1" + numbers_of(first) +
                                                " CAMERA 2 1" + numbers_of(second) + "\n");
  std::size_t frame = 0;
  change_lines(folder / (name + "/frames.txt"), [&](const std::string& line) {
    if (line.starts_with("#")) return line;
    const Pose pose = frame_from_image(first, problem.rigs.rig_from_world[frame++]);
    const std::size_t data = line.find(" 2 CAMERA 1");
    return std::to_string(frame) + " 1" + numbers_of(pose) + line.substr(data);
  });
}

}  // namespace sheaf::test
