// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>

#include "geometry/rotation.h"
#include "image/png.h"
#include "io/folder_files.h"
#include "platform/random.h"
#include "scene/wave_surface.h"
#include "sheaf/io.h"
#include "sheaf/photometric.h"

namespace sheaf::test {

/// A folder in memory: names and bytes.
using MemoryFolder = std::map<std::string, std::string>;

inline FolderFiles files_of(const MemoryFolder& folder) {
  const auto has = [&folder](const std::string& name) {
    const auto at = folder.lower_bound(name);
    return at != folder.end() && (at->first == name || at->first.starts_with(name + "/"));
  };
  const auto bytes = [&folder](const std::string& name) -> Result<std::string> {
    const auto at = folder.find(name);
    if (at == folder.end()) return Error(ErrorCode::unreadable_input, "m/" + name + ": not there");
    return at->second;
  };
  return {"m", has, bytes};
}

inline void write_folder(const MemoryFolder& folder, const std::filesystem::path& path) {
  for (const auto& [name, bytes] : folder) {
    make_folder((path / name).parent_path()).value();
    std::ofstream(path / name, std::ios::binary) << bytes;
  }
}

inline PhotometricSceneOptions rgbd_scene() {
  PhotometricSceneOptions o;
  o.images = 4, o.points = 100, o.width = 160, o.height = 120;
  o.eight_bit = true, o.relief = 0.02;
  return o;
}

inline Vector3<double> centre_of(const Pose& pose) {
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  const Vector3<double>& t = pose.translation;
  Vector3<double> c;
  for (int d = 0; d < 3; ++d) c[d] = -(R[d] * t[0] + R[3 + d] * t[1] + R[6 + d] * t[2]);
  return c;
}

constexpr double kDepthScale = 10000;

inline std::string grey_png(const GreyImage& image) {
  Raster raster{image.width, image.height, 1, 8, {}};
  for (float grey : image.pixels) raster.samples.push_back(static_cast<std::uint16_t>(grey));
  return encode_png(raster).value();
}

inline std::string depth_png(const PhotometricSceneOptions& o, const Pinhole& k, const Pose& pose) {
  const WaveSurface surface(o, k.fx, Random(o.seed, 0));
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  Raster raster{o.width, o.height, 1, 16, {}};
  for (int y = 0; y < o.height; ++y)
    for (int x = 0; x < o.width; ++x) {
      const double ray[3] = {(x - k.cx) / k.fx, (y - k.cy) / k.fy, 1};
      Vector3<double> d;
      for (int i = 0; i < 3; ++i) d[i] = R[i] * ray[0] + R[3 + i] * ray[1] + R[6 + i] * ray[2];
      const double depth = surface.hit(centre_of(pose), d).depth;
      raster.samples.push_back(static_cast<std::uint16_t>(std::lround(kDepthScale * depth)));
    }
  return encode_png(raster).value();
}

inline std::string number(double x) {
  char text[40];
  return std::string(text, std::to_chars(text, text + sizeof text, x).ptr);
}

/// world_from_camera, tx ty tz qx qy qz qw.
inline std::string trajectory_line(const Pose& pose) {
  const auto& q = pose.rotation;
  std::string line;
  for (double c : centre_of(pose)) line += number(c) + " ";
  return line + number(-q[1]) + " " + number(-q[2]) + " " + number(-q[3]) + " " + number(q[0]);
}

/// A scene as TUM's benchmark has it; images at 0.1 s, 0.2 s, ...; depth and poses a little later.
inline MemoryFolder rgbd_folder(const PhotometricSceneOptions& o, const PhotometricProblem& scene) {
  MemoryFolder out;
  const Pinhole& k = scene.camera;
  out["intrinsics.txt"] =
      number(k.fx) + " " + number(k.fy) + " " + number(k.cx) + " " + number(k.cy) + "\n";
  out["rgb.txt"] = out["depth.txt"] = out["groundtruth.txt"] = "# made by a test\n";
  for (std::size_t i = 0; i < scene.images.size(); ++i) {
    const double time = 0.1 * static_cast<double>(i + 1);
    const std::string file = "/" + std::to_string(i) + " a.png";
    out["rgb.txt"] += number(time) + " rgb" + file + "\n";
    out["depth.txt"] += number(time + 0.01) + " depth" + file + "\n";
    out["groundtruth.txt"] += number(time - 0.005) + " " + trajectory_line(scene.poses[i]) + "\n";
    out["rgb" + file] = grey_png(scene.images[i]);
    out["depth" + file] = depth_png(o, k, scene.poses[i]);
  }
  return out;
}

/// The same by number, counted from 1.
inline MemoryFolder numbered_folder(const PhotometricSceneOptions& o,
                                    const PhotometricProblem& scene) {
  MemoryFolder timed = rgbd_folder(o, scene), out;
  out["intrinsics.txt"] = timed["intrinsics.txt"];
  for (std::size_t i = 0; i < scene.images.size(); ++i) {
    const std::string file = "/" + std::to_string(i) + " a.png";
    const std::string to = "/" + std::to_string(i + 1) + ".png";
    out["pose.txt"] += trajectory_line(scene.poses[i]) + "\n";
    out["color" + to] = timed["rgb" + file];
    out["depth" + to] = timed["depth" + file];
  }
  return out;
}

/// A scene as a model: features are where the points are seen from `poses`.
inline Problem model_of(const PhotometricProblem& scene) {
  const Pinhole& k = scene.camera;
  Camera lens;
  lens.model = CameraModel::pinhole;
  lens.parameters = {k.fx, k.fy, k.cx + 0.5, k.cy + 0.5};
  lens.width_px = static_cast<std::uint64_t>(scene.images[0].width);
  lens.height_px = static_cast<std::uint64_t>(scene.images[0].height);
  Problem out;
  out.cameras.push_back(lens);
  auto metadata = std::make_shared<SceneMetadata>();
  for (std::size_t j = 0; j < scene.poses.size(); ++j) {
    out.add_image(scene.poses[j], 0u);
    metadata->image_names.push_back("of/" + std::to_string(j) + ".png");
  }
  out.metadata = metadata;
  out.points = scene.points;
  for (std::uint32_t i = 0; i < scene.num_points(); ++i)
    for (std::uint32_t j = 0; j < scene.poses.size(); ++j) {
      const double* X = &scene.points[3 * std::size_t(i)];
      Vector3<double> P = multiply(matrix_from_quaternion(scene.poses[j].rotation),
                                   Vector3<double>{X[0], X[1], X[2]});
      for (int d = 0; d < 3; ++d) P[d] += scene.poses[j].translation[d];
      const double x = k.fx * P[0] / P[2] + k.cx, y = k.fy * P[1] / P[2] + k.cy;
      if (x < 8 || y < 8 || x > scene.images[j].width - 9 || y > scene.images[j].height - 9)
        continue;
      out.add_observation(j, i, x + 0.5, y + 0.5);
    }
  return out;
}

inline MemoryFolder pictures_of(const PhotometricProblem& scene) {
  MemoryFolder out;
  for (std::size_t j = 0; j < scene.images.size(); ++j)
    out["of/" + std::to_string(j) + ".png"] = grey_png(scene.images[j]);
  return out;
}

}  // namespace sheaf::test
