// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include "image/png.h"
#include "io/direct_folder.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

/// Grey levels as the nearest of 8 bits.
Result<void> write_image(const GreyImage& image, OutputFolder& out, const fs::path& name) {
  Raster raster{image.width, image.height, 1, 8, {}};
  for (float grey : image.pixels)
    raster.samples.push_back(
        static_cast<std::uint16_t>(std::clamp(std::lround(grey), long{0}, long{255})));
  const Result<std::string> bytes = encode_png(raster);
  if (!bytes.ok()) return bytes.error();
  return write_bytes(out, name, bytes.value());
}

void put_poses(const PhotometricFolder& folder, TextBuffer& text) {
  for (std::size_t i = 0; i < folder.problem.poses.size(); ++i) {
    const Pose& pose = folder.problem.poses[i];
    text.put(folder.times.empty() ? static_cast<double>(i) : folder.times[i], ' ');
    for (double t : pose.translation) text.put(t, ' ');
    for (int k : {1, 2, 3, 0}) text.put(pose.rotation[k], k == 0 ? '\n' : ' ');
  }
}

/// Grey levels of the course's sixteen pixels around a host's pixel.
float host_grey(const PhotometricProblem& problem, std::size_t point, std::size_t k,
                const Pattern& pattern) {
  const GreyImage& image = problem.images[problem.host[point]];
  const auto at = [&](double middle, int offset, int size) {
    return std::size_t(std::clamp(static_cast<int>(std::lround(middle)) + offset, 0, size - 1));
  };
  const std::size_t x = at(problem.host_xy[2 * point], pattern.dx[k], image.width);
  const std::size_t y = at(problem.host_xy[2 * point + 1], pattern.dy[k], image.height);
  return image.pixels[y * std::size_t(image.width) + x];
}

void put_points(const PhotometricProblem& problem, TextBuffer& text) {
  const Pattern pattern = make_pattern("4x4").value();
  const std::size_t pixels = pattern.size();
  for (std::size_t i = 0; i < problem.num_points(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) text.put(problem.points[3 * i + k], ' ');
    for (std::size_t k = 0; k < pixels; ++k)
      text.put(problem.patches.empty() ? host_grey(problem, i, k, pattern)
                                       : problem.patches[pixels * i + k],
               k + 1 == pixels ? '\n' : ' ');
  }
}

void put_measurements(const PhotometricProblem& problem, TextBuffer& text) {
  for (std::size_t i = 0; i < problem.num_measurements(); ++i) {
    text.put(problem.measured_point[i], ' '), text.put(problem.measured_image[i], ' ');
    text.put(problem.measured_xy[2 * i], ' '), text.put(problem.measured_xy[2 * i + 1], '\n');
  }
}

}  // namespace

Result<void> write_looks(const PhotometricProblem& problem, OutputFolder& out) {
  const auto put_intrinsics = [&](TextBuffer& text) {
    const Pinhole& k = problem.camera;
    text.put(k.fx, ' '), text.put(k.fy, ' '), text.put(k.cx, ' '), text.put(k.cy, '\n');
  };
  if (auto r = write_text_file(out, "intrinsics.txt", put_intrinsics); !r.ok()) return r;
  if (problem.brightness.empty()) return {};
  return write_text_file(out, "brightness.txt", [&](TextBuffer& text) {
    for (const Brightness& of : problem.brightness) text.put(of.a, ' '), text.put(of.b, '\n');
  });
}

Result<void> write_direct(const PhotometricFolder& folder, OutputFolder& out) {
  const PhotometricProblem& problem = folder.problem;
  if (auto r = write_text_file(out, "poses.txt", [&](auto& t) { put_poses(folder, t); }); !r.ok())
    return r;
  if (auto r = write_text_file(out, "points.txt", [&](auto& t) { put_points(problem, t); });
      !r.ok())
    return r;
  const auto put_hosts = [&](TextBuffer& text) {
    for (std::size_t i = 0; i < problem.host.size(); ++i) {
      text.put(problem.host[i], ' ');
      text.put(problem.host_xy[2 * i], ' '), text.put(problem.host_xy[2 * i + 1], '\n');
    }
  };
  if (problem.has_hosts())
    if (auto r = write_text_file(out, "hosts.txt", put_hosts); !r.ok()) return r;
  if (auto r = write_looks(problem, out); !r.ok()) return r;
  if (problem.num_measurements() > 0)
    if (auto r = write_text_file(out, "measurements.txt",
                                 [&](TextBuffer& text) { put_measurements(problem, text); });
        !r.ok())
      return r;
  for (std::size_t i = 0; i < problem.images.size(); ++i) {
    const fs::path name = std::to_string(i) + ".png";
    if (auto r = folder.files.empty() ? write_image(problem.images[i], out, name)
                                      : duplicate_file(folder.files[i], out, name);
        !r.ok())
      return r;
  }
  return {};
}

}  // namespace sheaf
