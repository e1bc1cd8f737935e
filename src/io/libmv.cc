// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/libmv.h"

#include <array>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "io/byte_cursor.h"
#include "scene/source_files.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

constexpr std::uint64_t kCameraBytes = 4 + 12 * 4, kPointBytes = 4 + 3 * 4, kMarkerBytes = 16;

struct Marker {
  std::uint32_t image;
  std::int32_t track;
  double x, y;
};

struct Reader {
  ByteCursor in;
  Problem problem;
  SceneMetadata metadata;
  std::unordered_map<std::int32_t, std::uint32_t> image_of, point_of;
  std::vector<Marker> markers;
  std::uint64_t homeless = 0;  ///< markers of images without a camera

  template <std::size_t N>
  std::optional<Error> floats(std::array<double, N>& out, const char* what) {
    for (double& x : out) {
      float value;
      if (!in.read(value)) return in.truncated(what);
      if (!std::isfinite(value))
        return in.refuse(std::string("found a number that is not finite, expected ") + what);
      x = value;
    }
    return {};
  }
  std::optional<Error> id(std::int32_t& value, const char* what) {
    if (!in.read(value)) return in.truncated(what);
    if (value >= 0) return {};
    return in.refuse("found " + std::to_string(value) + ", expected " + what + ", from 0 up");
  }
  std::optional<Error> count(std::int32_t& value, const char* what, std::uint64_t record) {
    if (!in.read(value)) return in.truncated(std::string("the number of ") + what);
    if (value >= 0 && static_cast<std::uint64_t>(value) <= in.left() / record) return {};
    return in.refuse("found " + std::to_string(value) + " " + what + ", expected at most the " +
                     std::to_string(in.left() / record) + " that the rest of the file can hold");
  }

  std::optional<Error> lens();
  std::optional<Error> cameras();
  std::optional<Error> points();
  std::optional<Error> read_markers();
};

std::optional<Error> Reader::lens() {
  std::array<double, 8> k{};
  if (auto e = floats(k, "an intrinsic parameter of the lens")) return e;
  // One focal length, as the file has it, where a model allows it.
  if (k[5] == 0 && k[6] == 0 && k[7] == 0) {
    problem.cameras.push_back({CameraModel::radial, {k[0], k[1], k[2], k[3], k[4]}});
  } else if (k[6] == 0 && k[7] == 0) {
    problem.cameras.push_back({CameraModel::radial_k3, {k[0], k[1], k[2], k[3], k[4], k[5]}});
  } else {
    problem.cameras.push_back(
        {CameraModel::full_opencv, {k[0], k[0], k[1], k[2], k[3], k[4], k[6], k[7], k[5]}});
  }
  return {};
}

std::optional<Error> Reader::cameras() {
  std::int32_t count_of = 0;
  if (auto e = count(count_of, "cameras", kCameraBytes)) return e;
  for (std::int32_t i = 0; i < count_of; ++i) {
    const std::uint64_t begin = in.at();
    std::int32_t image = 0;
    std::array<double, 9> columns{};
    Pose pose;
    if (auto e = id(image, "the number of an image")) return e;
    if (auto e = floats(columns, "an entry of a rotation")) return e;
    if (auto e = floats(pose.translation, "an entry of a translation")) return e;
    const std::array<double, 9> R{columns[0], columns[3], columns[6], columns[1], columns[4],
                                  columns[7], columns[2], columns[5], columns[8]};
    if (const char* found = no_rotation(R))
      return in.refuse_at(begin, std::string("found ") + found + ", expected a rotation");
    if (!image_of.emplace(image, problem.num_images()).second)
      return in.refuse_at(begin, "found image " + std::to_string(image) +
                                     " a second time, expected numbers that differ");
    pose.rotation = rotation_from_stated(R);
    problem.add_image(pose, 0u);
    metadata.image_ids.push_back(static_cast<std::uint32_t>(image));
    metadata.stated_rotations.insert(metadata.stated_rotations.end(), R.begin(), R.end());
  }
  return {};
}

std::optional<Error> Reader::points() {
  std::int32_t count_of = 0;
  if (auto e = count(count_of, "points", kPointBytes)) return e;
  for (std::int32_t i = 0; i < count_of; ++i) {
    const std::uint64_t begin = in.at();
    std::int32_t track = 0;
    std::array<double, 3> X{};
    if (auto e = id(track, "the number of a track")) return e;
    if (auto e = floats(X, "a coordinate of a point")) return e;
    if (!point_of.emplace(track, problem.num_points()).second)
      return in.refuse_at(begin, "found track " + std::to_string(track) +
                                     " a second time, expected numbers that differ");
    problem.add_point(X[0], X[1], X[2]);
    metadata.point_ids.push_back(static_cast<std::uint64_t>(track));
  }
  return {};
}

std::optional<Error> Reader::read_markers() {
  std::int32_t count_of = 0;
  if (auto e = count(count_of, "markers", kMarkerBytes)) return e;
  for (std::int32_t i = 0; i < count_of; ++i) {
    std::int32_t image = 0, track = 0;
    std::array<double, 2> xy{};
    if (auto e = id(image, "the number of an image")) return e;
    if (auto e = id(track, "the number of a track")) return e;
    if (auto e = floats(xy, "x or y of a marker")) return e;
    if (const auto found = image_of.find(image); found != image_of.end()) {
      markers.push_back({found->second, track, xy[0], xy[1]});
    } else {
      ++homeless;
    }
  }
  return in.check_end();
}

/// Markers become the features of their images, and observations where their track has a point.
void place_markers(Reader& reader) {
  Problem& problem = reader.problem;
  SceneMetadata& metadata = reader.metadata;
  metadata.feature_begin.assign(problem.num_images() + 1, 0);
  for (const Marker& marker : reader.markers) ++metadata.feature_begin[marker.image + 1];
  for (std::size_t j = 0; j < problem.num_images(); ++j)
    metadata.feature_begin[j + 1] += metadata.feature_begin[j];
  metadata.feature_xy.resize(2 * reader.markers.size());
  std::vector<std::uint32_t> next(problem.num_images(), 0);
  for (const Marker& marker : reader.markers) {
    const std::uint32_t feature = next[marker.image]++;
    double* xy = &metadata.feature_xy[2 * (metadata.feature_begin[marker.image] + feature)];
    xy[0] = marker.x, xy[1] = marker.y;
    const auto point = reader.point_of.find(marker.track);
    if (point == reader.point_of.end()) continue;
    problem.add_observation(marker.image, point->second, marker.x, marker.y);
    metadata.observation_feature.push_back(feature);
  }
}

}  // namespace

Result<Problem> parse_libmv(std::string_view bytes, const std::string& name,
                            std::vector<std::string>& notes) {
  Reader reader{ByteCursor(bytes, name), {}, {}, {}, {}, {}};
  std::uint8_t order = 0, space = 0;
  if (!reader.in.read(order) || !reader.in.read(space))
    return reader.in.truncated("the order of bytes and the space of markers");
  if (order == 'V') reader.in.big_endian();
  if (auto e = reader.lens()) return *e;
  if (auto e = reader.cameras()) return *e;
  if (auto e = reader.points()) return *e;
  if (auto e = reader.read_markers()) return *e;
  place_markers(reader);
  if (reader.homeless > 0)
    notes.push_back(std::to_string(reader.homeless) +
                    " markers are of images that have no camera, and were left out");
  Problem& problem = reader.problem;
  if (const std::size_t unobserving = reader.markers.size() - problem.num_observations())
    notes.push_back(std::to_string(unobserving) + " markers are of tracks that have no point");
  auto source = std::make_shared<SourceFiles>();
  source->format = "libmv";
  source->libmv_space = static_cast<char>(space);
  reader.metadata.source = std::move(source);
  reader.metadata.state_hash = state_hash(problem);
  problem.metadata = std::make_shared<const SceneMetadata>(std::move(reader.metadata));
  return std::move(problem);
}

}  // namespace sheaf
