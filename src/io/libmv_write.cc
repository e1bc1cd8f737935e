// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "geometry/rotation.h"
#include "io/libmv.h"
#include "io/source_files.h"
#include "scene/camera_frame.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

/// f, cx, cy, k1, k2, k3, p1, p2.
using LibmvLens = std::array<double, 8>;

Error refuse(const std::string& what) { return Error(ErrorCode::usage, "libmv's files " + what); }

bool is_polynomial(CameraModel model) {
  switch (model) {
    case CameraModel::simple_pinhole:
    case CameraModel::pinhole:
    case CameraModel::simple_radial:
    case CameraModel::radial:
    case CameraModel::opencv:
    case CameraModel::full_opencv:
      return true;
    default:
      return false;
  }
}

Result<LibmvLens> libmv_lens(const Camera& camera) {
  const std::string model(to_string(camera.model));
  if (!is_polynomial(camera.model))
    return refuse("hold one focal length, k1, k2, k3, p1 and p2, and the lens is " + model);
  LibmvLens out{};
  const std::vector<std::string_view> names = parameter_names(camera.model);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string_view name = names[i];
    const double value = camera.parameters[i];
    const auto place = name == "f" || name == "fx"   ? 0
                       : name == "cx"                ? 1
                       : name == "cy"                ? 2
                       : name == "k" || name == "k1" ? 3
                       : name == "k2"                ? 4
                       : name == "k3"                ? 5
                       : name == "p1"                ? 6
                       : name == "p2"                ? 7
                                                     : -1;
    if (place >= 0) {
      out[static_cast<std::size_t>(place)] = value;
    } else if (value != (name == "fy" ? out[0] : 0)) {
      return refuse("hold one focal length, k1, k2, k3, p1 and p2; the " + model + " lens has " +
                    std::string(name) + " = " + std::to_string(value) +
                    (name == "fy" ? ", another than fx" : ""));
    }
  }
  return out;
}

struct Writer {
  std::string out;

  void word(std::uint32_t bits) {
    for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(bits >> shift & 0xff);
  }
  void integer(std::uint64_t value) { word(static_cast<std::uint32_t>(value)); }
  void real(double value) { word(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
};

void put_image(const Problem& problem, std::size_t j, bool as_read, Writer& writer) {
  Matrix3<double> R = matrix_from_quaternion(problem.poses[j].rotation);
  if (const double* stated = as_read ? stated_numbers(problem, j, 9) : nullptr)
    std::copy_n(stated, 9, R.begin());
  for (std::size_t column = 0; column < 3; ++column)
    for (std::size_t row = 0; row < 3; ++row) writer.real(R[3 * row + column]);
  for (const double t : problem.poses[j].translation) writer.real(t);
}

/// Numbers that fit into the file's int32: the ids, or else the indices.
template <class Id>
std::vector<std::uint64_t> numbers_of(const std::vector<Id>& ids, std::size_t count) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
  std::vector<std::uint64_t> out(ids.begin(), ids.end());
  bool fits = out.size() == count;
  for (const std::uint64_t id : out) fits = fits && id <= kMost;
  if (fits) return out;
  out.resize(count);
  for (std::size_t i = 0; i < count; ++i) out[i] = i;
  return out;
}

}  // namespace

Result<std::string> format_libmv(const Problem& given) {
  Problem turned;
  const Problem& problem = *without_bal_cameras(given, turned);
  if (problem.cameras.size() != 1)
    return refuse("hold one lens for all images, and there are " +
                  std::to_string(problem.cameras.size()));
  if (problem.num_observations() > std::numeric_limits<std::int32_t>::max())
    return refuse("hold at most 2^31 - 1 markers");
  const Result<LibmvLens> lens = libmv_lens(problem.cameras[0]);
  if (!lens.ok()) return lens.error();
  static const SceneMetadata kNone;
  const SceneMetadata& metadata = problem.metadata ? *problem.metadata : kNone;
  const auto images = numbers_of(metadata.image_ids, problem.num_images());
  const auto tracks = numbers_of(metadata.point_ids, problem.num_points());
  const bool own = metadata.source && metadata.source->format == "libmv";
  const bool as_read = is_as_read(given, "libmv");

  Writer writer;
  writer.out = {'v', own ? metadata.source->libmv_space : 'P'};
  for (const double k : lens.value()) writer.real(k);
  writer.integer(problem.num_images());
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    writer.integer(images[j]);
    put_image(problem, j, as_read, writer);
  }
  writer.integer(problem.num_points());
  for (std::size_t p = 0; p < problem.num_points(); ++p) {
    writer.integer(tracks[p]);
    for (std::size_t k = 0; k < 3; ++k) writer.real(problem.points[3 * p + k]);
  }
  writer.integer(problem.num_observations());
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    writer.integer(images[problem.observation_image[i]]);
    writer.integer(tracks[problem.observation_point[i]]);
    writer.real(problem.observation_xy[2 * i]);
    writer.real(problem.observation_xy[2 * i + 1]);
  }
  return std::move(writer.out);
}

}  // namespace sheaf
