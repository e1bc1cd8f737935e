// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <chrono>
#include <cmath>
#include <new>
#include <optional>

#include "image/png.h"
#include "io/direct_folder.h"
#include "io/token_reader.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

}  // namespace

Result<std::string> bytes_of(const fs::path& path) {
  Result<RawBytes> raw = RawBytes::open(path);
  if (!raw.ok()) return raw.error();
  std::string out;
  constexpr std::size_t kBlock = 1 << 18;
  for (;;) {
    const std::size_t before = out.size();
    out.resize(before + kBlock);
    const Result<std::size_t> n = raw.value().read(out.data() + before, kBlock);
    if (!n.ok()) return n.error();
    out.resize(before + n.value());
    if (n.value() < kBlock) return out;
  }
}

namespace {

std::optional<Error> read_reals(TokenReader& in, double* to, std::size_t count, const char* what,
                                std::size_t record) {
  for (std::size_t k = 0; k < count; ++k)
    if (!in.read_real(to[k]))
      return in.unexpected("a finite number, entry " + std::to_string(k + 1) + " of " +
                           std::to_string(count) + " of " + what + " " + std::to_string(record));
  return {};
}

Result<GreyImage> read_grey(const fs::path& path) {
  const Result<std::string> bytes = bytes_of(path);
  if (!bytes.ok()) return bytes.error();
  const Result<Raster> raster = decode_png(bytes.value(), path.string());
  if (!raster.ok()) return raster.error();
  return GreyImage{raster.value().width, raster.value().height, grey_of(raster.value())};
}

Result<void> read_text(const fs::path& path,
                       Result<void> (*parse)(std::string_view, const std::string&,
                                             PhotometricFolder&),
                       PhotometricFolder& folder) {
  const Result<std::string> text = bytes_of(path);
  if (!text.ok()) return text.error();
  return parse(text.value(), path.string(), folder);
}

/// fx fy cx cy, unless they are given.
Result<void> find_intrinsics(const fs::path& path, const std::optional<Pinhole>& camera,
                             PhotometricFolder& folder) {
  const fs::path file = path / "intrinsics.txt";
  if (camera) {
    folder.problem.camera = *camera;
    return {};
  }
  if (!fs::exists(file))
    return Error(ErrorCode::usage, path.string() +
                                       ": no intrinsics.txt (fx fy cx cy) in this folder, and no "
                                       "intrinsics given");
  return read_text(file, parse_direct_intrinsics, folder);
}

Result<PhotometricFolder> read_folder(const fs::path& path, const std::optional<Pinhole>& camera) {
  const auto start = std::chrono::steady_clock::now();
  PhotometricFolder folder;
  folder.format = "direct";
  PhotometricProblem& problem = folder.problem;
  if (auto k = find_intrinsics(path, camera, folder); !k.ok()) return k.error();
  if (auto poses = read_text(path / "poses.txt", parse_direct_poses, folder); !poses.ok())
    return poses.error();
  if (auto points = read_text(path / "points.txt", parse_direct_points, folder); !points.ok())
    return points.error();
  if (fs::exists(path / "hosts.txt"))
    if (auto hosts = read_text(path / "hosts.txt", parse_direct_hosts, folder); !hosts.ok())
      return hosts.error();
  if (fs::exists(path / "brightness.txt"))
    if (auto looks = read_text(path / "brightness.txt", parse_direct_brightness, folder);
        !looks.ok())
      return looks.error();
  if (fs::exists(path / "measurements.txt"))
    if (auto measured = read_text(path / "measurements.txt", parse_direct_measurements, folder);
        !measured.ok())
      return measured.error();
  for (std::size_t i = 0; i < problem.poses.size(); ++i) {
    folder.files.push_back(path / (std::to_string(i) + ".png"));
    Result<GreyImage> image = read_grey(folder.files.back());
    if (!image.ok()) return image.error();
    problem.images.push_back(std::move(image).value());
  }
  if (Result<void> valid = validate(problem); !valid.ok())
    return Error(ErrorCode::unreadable_input, path.string() + ": " + valid.error().what());
  folder.read_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return folder;
}

}  // namespace

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

Result<PhotometricFolder> read_photometric(const fs::path& path,
                                           const std::optional<Pinhole>& camera) {
  try {
    return read_folder(path, camera);
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, path.string() + ": not enough memory for these images");
  }
}

}  // namespace sheaf
