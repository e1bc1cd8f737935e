// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "geometry/rotation.h"
#include "io/brown_lens.h"
#include "io/file_numbers.h"
#include "io/libmv.h"
#include "scene/camera_frame.h"
#include "scene/source_files.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

/// f, cx, cy, k1, k2, k3, p1, p2.
using LibmvLens = std::array<double, 8>;

Error refuse(const std::string& what) { return Error(ErrorCode::usage, "libmv's files " + what); }

Result<LibmvLens> libmv_lens(const Camera& camera) {
  const Result<BrownLens> lens = brown_lens(camera);
  if (!lens.ok()) return refuse("hold one focal length; " + std::string(lens.error().what()));
  const auto& [fx, fy, cx, cy, k, p] = lens.value();
  if (fx != fy)
    return refuse("hold one focal length, and the " + std::string(to_string(camera.model)) +
                  " lens has fy = " + std::to_string(fy) + ", another than fx");
  return LibmvLens{fx, cx, cy, k[0], k[1], k[2], p[0], p[1]};
}

struct Writer {
  std::string out;
  bool overflows = false;  ///< a number is beyond single precision

  void word(std::uint32_t bits) {
    for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(bits >> shift & 0xff);
  }
  void integer(std::uint64_t value) { word(static_cast<std::uint32_t>(value)); }
  void real(double value) {
    const bool fits = std::abs(value) <= double(std::numeric_limits<float>::max());
    overflows = overflows || !fits;
    word(std::bit_cast<std::uint32_t>(fits ? static_cast<float>(value) : 0.0F));
  }
};

void put_image(const Problem& problem, std::size_t j, bool as_read, Writer& writer) {
  Matrix3<double> R = matrix_from_quaternion(problem.poses[j].rotation);
  if (const double* stated = as_read ? stated_numbers(problem, j, 9) : nullptr)
    std::copy_n(stated, 9, R.begin());
  for (std::size_t column = 0; column < 3; ++column)
    for (std::size_t row = 0; row < 3; ++row) writer.real(R[3 * row + column]);
  for (const double t : problem.poses[j].translation) writer.real(t);
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
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
  const auto images = numbers_of(metadata.image_ids, problem.num_images(), kMost);
  const auto tracks = numbers_of(metadata.point_ids, problem.num_points(), kMost);
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
  if (writer.overflows) return refuse("hold single precision, and a number is beyond its range");
  return std::move(writer.out);
}

}  // namespace sheaf
