// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "geometry/rotation.h"
#include "io/bal.h"

namespace sheaf {
namespace {

constexpr std::uint64_t kMaxIndexed = std::numeric_limits<std::uint32_t>::max() - 1;
constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 56;  // sums below then fit into 64 bits
constexpr std::size_t kBatch = 256;                          // records appended at once

struct Counts {
  std::uint64_t cameras = 0, points = 0, observations = 0;

  /// Least size of the text behind the header: "0 0 0 0\n" and "0\n", the last end of line missing.
  std::uint64_t least_text() const { return 8 * observations + 2 * (9 * cameras + 3 * points) - 1; }
  std::uint64_t numbers() const { return 4 * observations + 9 * cameras + 3 * points; }
};

std::string numbered(const std::string& what, std::uint64_t i, const char* record,
                     std::uint64_t count) {
  return what + " of " + record + " " + std::to_string(i) + " (of " + std::to_string(count) + ")";
}

std::optional<Error> read_count(TokenReader& in, const char* what, std::uint64_t least,
                                std::uint64_t most, std::uint64_t& count) {
  if (in.read_integer(count) && count >= least && count <= most) return {};
  return in.unexpected(std::string("the number of ") + what + " (" + std::to_string(least) +
                       " to " + std::to_string(most) +
                       "; a BAL file begins with its numbers of cameras, points, observations)");
}

/// Refuses counts that the file cannot hold, so that what is allocated stays in proportion to the
/// file. Compressed, numbers of real scenes shrink to a half or a third, and the most regular to a
/// tenth; a text of the least size (8 bytes an observation; real ones have about 40) that shrinks
/// 16 times is a bomb.
std::optional<Error> check_size(ByteSource& source, const TokenReader& in, const Counts& counts) {
  if (source.compression() != Compression::none)
    source.limit_text((std::uint64_t{1} << 20) + 64 * counts.numbers());
  const std::optional<std::uint64_t> size = source.raw().size();
  if (!size) return {};
  const bool plain = source.compression() == Compression::none;
  const std::uint64_t most = plain ? *size : (std::uint64_t{1} << 16) + 16 * *size;
  if (counts.least_text() <= most) return {};
  return in.unexpected("counts that a file of " + std::to_string(*size) +
                       " bytes can hold: " + std::to_string(counts.cameras) + " cameras, " +
                       std::to_string(counts.points) + " points and " +
                       std::to_string(counts.observations) + " observations need at least " +
                       std::to_string(counts.least_text()) + " bytes of text");
}

/// Appends without the pass of zeros that resize() would make.
template <class T>
void append(std::vector<T>& to, const T* values, std::size_t count) {
  to.insert(to.end(), values, values + count);
}

std::optional<Error> read_index(TokenReader& in, const char* what, std::uint64_t count,
                                std::uint64_t i, const Counts& counts, std::uint32_t& index) {
  std::uint64_t value;
  if (in.read_integer(value) && value < count) [[likely]] {
    index = static_cast<std::uint32_t>(value);
    return {};
  }
  return in.unexpected(
      numbered(std::string("the ") + what + " index", i, "observation", counts.observations) +
      ", 0 to " + std::to_string(count - 1));
}

std::optional<Error> read_observations(TokenReader& in, const Counts& counts, Problem& problem) {
  std::array<std::uint32_t, kBatch> image, point;
  std::array<double, 2 * kBatch> xy;
  for (std::uint64_t i = 0; i < counts.observations;) {
    const std::size_t batch = std::min<std::uint64_t>(kBatch, counts.observations - i);
    for (std::size_t j = 0; j < batch; ++j, ++i) {
      if (auto e = read_index(in, "camera", counts.cameras, i, counts, image[j])) return e;
      if (auto e = read_index(in, "point", counts.points, i, counts, point[j])) return e;
      for (std::size_t k = 0; k < 2; ++k)
        if (!in.read_real(xy[2 * j + k])) [[unlikely]]
          return in.unexpected(numbered(k == 0 ? "a finite number, x" : "a finite number, y", i,
                                        "observation", counts.observations));
    }
    append(problem.observation_image, image.data(), batch);
    append(problem.observation_point, point.data(), batch);
    append(problem.observation_xy, xy.data(), 2 * batch);
  }
  return {};
}

bool is_unit(const Quaternion<double>& q) {
  const double norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  return std::abs(norm2 - 1) < 1e-6;
}

std::optional<Error> read_cameras(TokenReader& in, const Counts& counts, Problem& problem) {
  static constexpr const char* kFields[9] = {"angle-axis x",
                                             "angle-axis y",
                                             "angle-axis z",
                                             "translation x",
                                             "translation y",
                                             "translation z",
                                             "focal length",
                                             "k1",
                                             "k2"};
  for (std::uint64_t i = 0; i < counts.cameras; ++i) {
    std::array<double, 9> v;
    Pose pose;
    for (std::size_t k = 0; k < 9; ++k) {
      if (!in.read_real(v[k]))
        return in.unexpected(
            numbered(std::string("a finite number, ") + kFields[k], i, "camera", counts.cameras));
      if (k != 2) continue;
      pose.rotation = quaternion_from_angle_axis<double>({v[0], v[1], v[2]});
      if (!is_unit(pose.rotation))
        return in.unexpected(
            numbered("an angle below 1e150 rad, rotation", i, "camera", counts.cameras));
    }
    pose.translation = {v[3], v[4], v[5]};
    append(problem.bal_angle_axis, v.data(), 3);
    problem.add_image(pose, Camera{CameraModel::bal, {v[6], v[7], v[8]}});
  }
  return {};
}

std::optional<Error> read_points(TokenReader& in, const Counts& counts, Problem& problem) {
  std::array<double, 3 * kBatch> xyz;
  for (std::uint64_t i = 0; i < counts.points;) {
    const std::size_t batch = std::min<std::uint64_t>(kBatch, counts.points - i);
    for (std::size_t j = 0; j < batch; ++j, ++i)
      for (std::size_t k = 0; k < 3; ++k)
        if (!in.read_real(xyz[3 * j + k])) [[unlikely]]
          return in.unexpected(
              numbered(std::string("a finite number, ") + "XYZ"[k], i, "point", counts.points));
    append(problem.points, xyz.data(), 3 * batch);
  }
  return {};
}

/// Exact sizes where the file's size vouches for them; a pipe's counts may be lies.
void reserve(Problem& problem, const Counts& counts, bool vouched) {
  const std::uint64_t most = vouched ? std::numeric_limits<std::uint64_t>::max() : 1 << 16;
  const std::size_t cameras = std::min(counts.cameras, most);
  const std::size_t observations = std::min(counts.observations, most);
  problem.poses.reserve(cameras);
  problem.image_camera.reserve(cameras);
  problem.cameras.reserve(cameras);
  problem.bal_angle_axis.reserve(3 * cameras);
  problem.points.reserve(3 * std::min(counts.points, most));
  problem.observation_image.reserve(observations);
  problem.observation_point.reserve(observations);
  problem.observation_xy.reserve(2 * observations);
}

}  // namespace

Result<Problem> read_bal(ByteSource& source, std::size_t window_bytes) {
  TokenReader in(source, window_bytes);
  Counts counts;
  if (auto e = read_count(in, "cameras", 1, kMaxIndexed, counts.cameras)) return *e;
  if (auto e = read_count(in, "points", 0, kMaxIndexed, counts.points)) return *e;
  const std::uint64_t most = counts.points > 0 ? kMaxCount : 0;
  if (auto e = read_count(in, "observations", 0, most, counts.observations)) return *e;
  if (auto e = check_size(source, in, counts)) return *e;

  Problem problem;
  reserve(problem, counts, source.raw().size().has_value());
  if (auto e = read_observations(in, counts, problem)) return *e;
  if (auto e = read_cameras(in, counts, problem)) return *e;
  if (auto e = read_points(in, counts, problem)) return *e;
  if (!in.at_end()) return in.unexpected("the end of the file behind the last point");
  return problem;
}

Result<Problem> parse_bal(std::string_view bytes, const std::string& name,
                          std::size_t window_bytes) {
  Result<ByteSource> source = ByteSource::open(RawBytes(bytes, name));
  if (!source.ok()) return source.error();
  return read_bal(source.value(), window_bytes);
}

}  // namespace sheaf
