// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/camera_model.h"
#include "io/byte_cursor.h"
#include "io/colmap_parts.h"

namespace sheaf {
namespace {

/// Least sizes of records: what a count promises is held against the bytes that are left. A camera
/// of a model that is not known may have no parameter at all, and is to be named as such.
constexpr std::uint64_t kLeastCamera = 24;
constexpr std::uint64_t kLeastImage = 4 + 7 * 8 + 4 + 1 + 8;
constexpr std::uint64_t kFeature = 24;
constexpr std::uint64_t kLeastPoint = 8 + 3 * 8 + 3 + 8 + 8;
constexpr std::uint64_t kTrackElement = 8;

template <class... Values>
bool read_all(ByteCursor& in, Values&... values) {
  return (in.read(values) && ...);
}

template <class Values>
bool read_list(ByteCursor& in, Values& values) {
  for (auto& value : values)
    if (!in.read(value)) return false;
  return true;
}

std::string of(const char* record, std::uint64_t i, std::uint64_t count) {
  return std::string("the rest of ") + record + " " + std::to_string(i + 1) + " of " +
         std::to_string(count);
}

std::string known_models() {
  std::string out;
  for (std::size_t i = 1; i < kCameraModels; ++i) {
    const auto model = static_cast<CameraModel>(i);
    if (colmap_id(model) < 0) continue;
    out += (i > 1 ? ", " : "") + std::to_string(colmap_id(model)) + " " +
           std::string(to_string(model));
  }
  return out;
}

}  // namespace

std::optional<Error> read_cameras_binary(std::string_view bytes, const std::string& name,
                                         ColmapDraft& draft) {
  ByteCursor in(bytes, name);
  std::uint64_t count;
  if (auto e = in.read_count("cameras", kLeastCamera, count)) return e;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t begin = in.at();
    std::uint32_t id;
    std::int32_t model_id;
    Camera camera;
    camera.parameters.fill(0);
    if (!read_all(in, id, model_id)) return in.truncated(of("camera", i, count));
    const auto model = camera_model_of_colmap(model_id);
    if (!model)
      return in.refuse("found camera model " + std::to_string(model_id) +
                       ", expected one that Sheaf knows: " + known_models());
    camera.model = *model;
    if (!read_all(in, camera.width_px, camera.height_px))
      return in.truncated(of("camera", i, count));
    for (std::size_t k = 0; k < parameter_count(*model); ++k)
      if (!in.read(camera.parameters[k])) return in.truncated(of("camera", i, count));
    if (auto refusal = draft.add_camera(id, camera)) return in.refuse_at(begin, *refusal);
  }
  return in.check_end();
}

std::optional<Error> read_images_binary(std::string_view bytes, const std::string& name,
                                        ColmapDraft& draft) {
  ByteCursor in(bytes, name);
  std::uint64_t count;
  if (auto e = in.read_count("images", kLeastImage, count)) return e;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t begin = in.at();
    std::uint32_t id, camera_id;
    std::array<double, 7> pose;
    std::string image_name;
    std::uint64_t features;
    if (!in.read(id) || !read_list(in, pose) || !in.read(camera_id) || !in.read_name(image_name))
      return in.truncated(of("image", i, count));
    if (auto e = in.read_count("features", kFeature, features)) return e;
    if (auto refusal = draft.add_image(id, pose, camera_id, std::move(image_name), in.at()))
      return in.refuse_at(begin, *refusal);
    for (std::uint64_t k = 0; k < features; ++k) {
      const std::uint64_t at = in.at();
      double x, y;
      std::uint64_t point_id;
      if (!read_all(in, x, y, point_id)) return in.truncated(of("image", i, count));
      if (auto refusal = draft.add_feature(x, y, point_id)) return in.refuse_at(at, *refusal);
    }
  }
  return in.check_end();
}

std::optional<Error> read_points_binary(std::string_view bytes, const std::string& name,
                                        ColmapDraft& draft) {
  ByteCursor in(bytes, name);
  std::uint64_t count;
  if (auto e = in.read_count("points", kLeastPoint, count)) return e;
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t begin = in.at();
    std::uint64_t id, length;
    std::array<double, 3> xyz;
    std::array<std::uint8_t, 3> colour;
    double error_px;
    if (!in.read(id) || !read_list(in, xyz) || !read_list(in, colour) || !in.read(error_px))
      return in.truncated(of("point", i, count));
    if (auto refusal = draft.add_point(id, xyz, colour, error_px))
      return in.refuse_at(begin, *refusal);
    if (auto e = in.read_count("track elements", kTrackElement, length)) return e;
    for (std::uint64_t k = 0; k < length; ++k) {
      const std::uint64_t at = in.at();
      std::uint32_t image_id, feature;
      if (!read_all(in, image_id, feature)) return in.truncated(of("point", i, count));
      if (auto refusal = draft.add_track_element(image_id, feature))
        return in.refuse_at(at, *refusal);
    }
  }
  return in.check_end();
}

}  // namespace sheaf
