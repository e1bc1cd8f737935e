// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/direct_folder.h"

#include <array>
#include <chrono>
#include <cmath>
#include <new>
#include <optional>

#include "image/png.h"
#include "io/output_file.h"
#include "io/text_buffer.h"
#include "io/token_reader.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

/// Whole, whatever its size turns out to be.
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

Result<PhotometricFolder> read_folder(const fs::path& path, const Pinhole& camera) {
  const auto start = std::chrono::steady_clock::now();
  PhotometricFolder folder;
  folder.format = "direct";
  PhotometricProblem& problem = folder.problem;
  problem.camera = camera;
  if (auto poses = read_text(path / "poses.txt", parse_direct_poses, folder); !poses.ok())
    return poses.error();
  if (auto points = read_text(path / "points.txt", parse_direct_points, folder); !points.ok())
    return points.error();
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

Result<PhotometricFolder> read_photometric(const fs::path& path, const Pinhole& camera) {
  try {
    return read_folder(path, camera);
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, path.string() + ": not enough memory for these images");
  }
}

namespace {

template <class Put>
Result<void> write_text(const fs::path& path, const Put& put) {
  Result<OutputFile> out = OutputFile::create(path, Compression::none);
  if (!out.ok()) return out.error();
  TextBuffer text(out.value());
  put(text);
  text.flush();
  return out.value().commit();
}

Result<void> copy_image(const fs::path& from, const fs::path& to) {
  std::error_code same;
  if (fs::equivalent(from, to, same)) return {};
  const Result<std::string> bytes = bytes_of(from);
  if (!bytes.ok()) return bytes.error();
  Result<OutputFile> out = OutputFile::create(to, Compression::none);
  if (!out.ok()) return out.error();
  out.value().write(bytes.value());
  return out.value().commit();
}

void put_poses(const PhotometricFolder& folder, TextBuffer& text) {
  for (std::size_t i = 0; i < folder.problem.poses.size(); ++i) {
    const Pose& pose = folder.problem.poses[i];
    text.put(folder.times[i], ' ');
    for (double t : pose.translation) text.put(t, ' ');
    for (int k : {1, 2, 3, 0}) text.put(pose.rotation[k], k == 0 ? '\n' : ' ');
  }
}

void put_points(const PhotometricProblem& problem, TextBuffer& text) {
  const std::size_t pixels = problem.patch.size();
  for (std::size_t i = 0; i < problem.num_points(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) text.put(problem.points[3 * i + k], ' ');
    for (std::size_t k = 0; k < pixels; ++k)
      text.put(problem.patches[pixels * i + k], k + 1 == pixels ? '\n' : ' ');
  }
}

}  // namespace

Result<void> write_photometric(const PhotometricFolder& folder, const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error)
    return Error(ErrorCode::unwritable_output,
                 path.string() + ": the folder cannot be made: " + error.message());
  const PhotometricProblem& problem = folder.problem;
  if (auto r = write_text(path / "poses.txt", [&](auto& t) { put_poses(folder, t); }); !r.ok())
    return r;
  if (auto r = write_text(path / "points.txt", [&](auto& t) { put_points(problem, t); }); !r.ok())
    return r;
  const auto put_brightness = [&](TextBuffer& text) {
    for (const Brightness& of : problem.brightness) text.put(of.a, ' '), text.put(of.b, '\n');
  };
  if (auto r = write_text(path / "brightness.txt", put_brightness); !r.ok()) return r;
  for (std::size_t i = 0; i < folder.files.size(); ++i)
    if (auto r = copy_image(folder.files[i], path / (std::to_string(i) + ".png")); !r.ok())
      return r;
  return {};
}

}  // namespace sheaf
