// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "io/direct_folder.h"
#include "io/token_reader.h"

namespace sheaf {
namespace {

std::optional<Error> read_reals(TokenReader& in, double* to, std::size_t count, const char* what,
                                std::size_t record) {
  for (std::size_t k = 0; k < count; ++k)
    if (!in.read_real(to[k]))
      return in.unexpected("a finite number, entry " + std::to_string(k + 1) + " of " +
                           std::to_string(count) + " of " + what + " " + std::to_string(record));
  return {};
}

using Parse = Result<void> (*)(std::string_view, const std::string&, PhotometricFolder&);

Result<void> read_text(const FolderFiles& files, const std::string& name, Parse parse,
                       PhotometricFolder& folder) {
  const Result<std::string> text = files.bytes(name);
  if (!text.ok()) return text.error();
  return parse(text.value(), files.name(name), folder);
}

}  // namespace

Result<void> find_intrinsics(const FolderFiles& files, const std::optional<Pinhole>& camera,
                             PhotometricFolder& folder) {
  if (camera) {
    folder.problem.camera = *camera;
    return {};
  }
  if (files.has("intrinsics.txt"))
    return read_text(files, "intrinsics.txt", parse_direct_intrinsics, folder);
  return Error(ErrorCode::usage, files.folder.string() +
                                     ": no intrinsics.txt (fx fy cx cy) in this folder, and no "
                                     "intrinsics given");
}

Result<PhotometricFolder> read_direct(const FolderFiles& files,
                                      const PhotometricReadOptions& options) {
  PhotometricFolder folder;
  folder.format = "direct";
  PhotometricProblem& problem = folder.problem;
  if (auto k = find_intrinsics(files, options.camera, folder); !k.ok()) return k.error();
  for (const auto& [name, parse] : {std::pair<const char*, Parse>{"poses.txt", parse_direct_poses},
                                    {"points.txt", parse_direct_points}})
    if (auto read = read_text(files, name, parse, folder); !read.ok()) return read.error();
  for (const auto& [name, parse] : {std::pair<const char*, Parse>{"hosts.txt", parse_direct_hosts},
                                    {"brightness.txt", parse_direct_brightness},
                                    {"measurements.txt", parse_direct_measurements}})
    if (files.has(name))
      if (auto read = read_text(files, name, parse, folder); !read.ok()) return read.error();
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    const std::string name = std::to_string(i) + ".png";
    folder.files.push_back(files.folder / name);
    Result<GreyImage> image = grey_in(files, name);
    if (!image.ok()) return image.error();
    problem.images.push_back(std::move(image).value());
  }
  return folder;
}

Result<void> parse_direct_poses(std::string_view text, const std::string& name,
                                PhotometricFolder& folder) {
  Result<ByteSource> source = ByteSource::open(RawBytes(text, name));
  if (!source.ok()) return source.error();
  TokenReader in(source.value());
  while (!in.at_end()) {
    std::array<double, 8> v;
    const std::size_t i = folder.problem.poses.size();
    if (auto e = read_reals(in, v.data(), v.size(), "pose", i)) return *e;
    const double norm = std::sqrt(v[4] * v[4] + v[5] * v[5] + v[6] * v[6] + v[7] * v[7]);
    if (!(std::abs(norm - 1) < 1e-3))
      return in.unexpected("a unit quaternion x y z w at the end of pose " + std::to_string(i) +
                           ", not one of length " + std::to_string(norm));
    Pose pose;
    pose.rotation = {v[7] / norm, v[4] / norm, v[5] / norm, v[6] / norm};
    pose.translation = {v[1], v[2], v[3]};
    folder.times.push_back(v[0]);
    folder.problem.poses.push_back(pose);
  }
  if (folder.problem.poses.empty())
    return in.unexpected("poses, eight numbers each: time, tx ty tz, qx qy qz qw");
  return {};
}

Result<void> parse_direct_points(std::string_view text, const std::string& name,
                                 PhotometricFolder& folder) {
  Result<ByteSource> source = ByteSource::open(RawBytes(text, name));
  if (!source.ok()) return source.error();
  TokenReader in(source.value());
  PhotometricProblem& problem = folder.problem;
  problem.patch = make_pattern("4x4").value();
  while (!in.at_end()) {
    std::array<double, 19> v;
    if (auto e = read_reals(in, v.data(), v.size(), "point", problem.num_points())) return *e;
    problem.points.insert(problem.points.end(), v.begin(), v.begin() + 3);
    problem.patches.insert(problem.patches.end(), v.begin() + 3, v.end());
  }
  if (problem.points.empty())
    return in.unexpected("points, nineteen numbers each: X Y Z and 16 grey levels");
  return {};
}

Result<void> parse_direct_hosts(std::string_view text, const std::string& name,
                                PhotometricFolder& folder) {
  Result<ByteSource> source = ByteSource::open(RawBytes(text, name));
  if (!source.ok()) return source.error();
  TokenReader in(source.value());
  PhotometricProblem& problem = folder.problem;
  const std::size_t images = problem.poses.size();
  for (std::size_t i = 0; i < problem.num_points(); ++i) {
    std::uint64_t image = 0;
    if (!in.read_integer(image) || image >= images)
      return in.unexpected("the host image of point " + std::to_string(i) + ", 0 to " +
                           std::to_string(images - 1));
    std::array<double, 2> xy;
    if (auto e = read_reals(in, xy.data(), xy.size(), "the host pixel of point", i)) return *e;
    problem.host.push_back(static_cast<std::uint32_t>(image));
    problem.host_xy.insert(problem.host_xy.end(), xy.begin(), xy.end());
  }
  if (!in.at_end()) return in.unexpected("the end of the file behind the last point's host");
  return {};
}

Result<void> parse_direct_brightness(std::string_view text, const std::string& name,
                                     PhotometricFolder& folder) {
  Result<ByteSource> source = ByteSource::open(RawBytes(text, name));
  if (!source.ok()) return source.error();
  TokenReader in(source.value());
  for (std::size_t i = 0; i < folder.problem.poses.size(); ++i) {
    std::array<double, 2> ab;
    if (auto e = read_reals(in, ab.data(), ab.size(), "the brightness a b of image", i)) return *e;
    folder.problem.brightness.push_back({ab[0], ab[1]});
  }
  if (!in.at_end()) return in.unexpected("the end of the file behind the last image's brightness");
  return {};
}

Result<void> parse_direct_measurements(std::string_view text, const std::string& name,
                                       PhotometricFolder& folder) {
  Result<ByteSource> source = ByteSource::open(RawBytes(text, name));
  if (!source.ok()) return source.error();
  TokenReader in(source.value());
  PhotometricProblem& problem = folder.problem;
  const auto read_index = [&](std::size_t count, const char* what) -> Result<std::uint32_t> {
    std::uint64_t index = 0;
    if (in.read_integer(index) && index < count) return static_cast<std::uint32_t>(index);
    return in.unexpected(std::string("the ") + what + " of measured position " +
                         std::to_string(problem.num_measurements()) + ", 0 to " +
                         std::to_string(count - 1));
  };
  while (!in.at_end()) {
    const Result<std::uint32_t> point = read_index(problem.num_points(), "point");
    if (!point.ok()) return point.error();
    const Result<std::uint32_t> image = read_index(problem.poses.size(), "image");
    if (!image.ok()) return image.error();
    std::array<double, 2> xy;
    if (auto e =
            read_reals(in, xy.data(), xy.size(), "measured position", problem.num_measurements()))
      return *e;
    problem.measured_point.push_back(point.value());
    problem.measured_image.push_back(image.value());
    problem.measured_xy.insert(problem.measured_xy.end(), xy.begin(), xy.end());
  }
  return {};
}

Result<void> parse_direct_intrinsics(std::string_view text, const std::string& name,
                                     PhotometricFolder& folder) {
  Result<ByteSource> source = ByteSource::open(RawBytes(text, name));
  if (!source.ok()) return source.error();
  TokenReader in(source.value());
  std::array<double, 4> k;
  if (auto e = read_reals(in, k.data(), k.size(), "the intrinsics fx fy cx cy of camera", 0))
    return *e;
  if (!in.at_end()) return in.unexpected("the end of the file behind fx fy cx cy");
  folder.problem.camera = {k[0], k[1], k[2], k[3]};
  return {};
}

}  // namespace sheaf
