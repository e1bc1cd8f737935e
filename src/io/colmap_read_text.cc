// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "geometry/camera_model.h"
#include "io/colmap_parts.h"
#include "io/line_cursor.h"

namespace sheaf {
namespace {

template <class Values>
bool read_reals(LineCursor& in, Values& values) {
  for (double& value : values)
    if (!in.read_real(value)) return false;
  return true;
}

std::string known_models() {
  std::string out;
  for (std::size_t i = 1; i < kCameraModels; ++i)
    out += (i > 1 ? ", " : "") + std::string(to_string(static_cast<CameraModel>(i)));
  return out;
}

std::optional<Error> read_features(LineCursor& in, ColmapDraft& draft) {
  while (!in.line_ended()) {
    double x, y;
    if (!in.read_real(x)) return in.refuse("a finite number, x of a feature (x, y, point id)");
    if (!in.read_real(y)) return in.refuse("a finite number, y of a feature (x, y, point id)");
    std::int64_t point_id;
    if (!in.read_integer(point_id) || point_id < -1)
      return in.refuse("the id of a point, or -1 (features are x, y, point id)");
    if (auto refusal = draft.add_feature(
            x, y, point_id < 0 ? ColmapDraft::kNoPoint : static_cast<std::uint64_t>(point_id)))
      return in.refuse_as(*refusal);
  }
  return {};
}

}  // namespace

std::optional<Error> read_cameras_text(std::string_view text, const std::string& name,
                                       ColmapDraft& draft) {
  LineCursor in(text, name);
  while (in.next_record()) {
    std::uint32_t id;
    if (!in.read_integer(id)) return in.refuse("the id of a camera");
    std::string_view word;
    std::optional<CameraModel> model;
    if (in.read_word(word)) model = camera_model_named(word);
    if (!model || *model == CameraModel::bal)
      return in.refuse("a camera model that Sheaf knows: " + known_models());
    Camera camera;
    camera.model = *model;
    camera.parameters.fill(0);
    if (!in.read_integer(camera.width_px)) return in.refuse("the width of the images, pixels");
    if (!in.read_integer(camera.height_px)) return in.refuse("the height of the images, pixels");
    const auto names = parameter_names(*model);
    for (std::size_t k = 0; k < names.size(); ++k)
      if (!in.read_real(camera.parameters[k]))
        return in.refuse("a finite number, " + std::string(names[k]) + " of " + std::string(word));
    if (in.read_word(word))
      return in.refuse("the end of the line behind the " + std::to_string(names.size()) +
                       " parameters of " + std::string(to_string(*model)));
    if (auto refusal = draft.add_camera(id, camera)) return in.refuse_as(*refusal);
  }
  return {};
}

std::optional<Error> read_images_text(std::string_view text, const std::string& name,
                                      ColmapDraft& draft) {
  LineCursor in(text, name);
  while (in.next_record()) {
    std::uint32_t id, camera_id;
    std::array<double, 7> pose;
    if (!in.read_integer(id)) return in.refuse("the id of an image");
    if (!read_reals(in, pose))
      return in.refuse("a finite number, one of qw qx qy qz tx ty tz of image " +
                       std::to_string(id));
    if (!in.read_integer(camera_id))
      return in.refuse("the id of the camera of image " + std::to_string(id));
    if (in.rest().find_first_of(std::string_view("\0\r", 2)) != std::string_view::npos)
      return in.refuse_as("found a zero byte or half a line's end, expected the name of image " +
                          std::to_string(id));
    if (auto refusal =
            draft.add_image(id, pose, camera_id, std::string(in.rest()), in.line_number() + 1))
      return in.refuse_as(*refusal);
    // The features stand on the next line, which may be blank.
    if (!in.next_line())
      return in.refuse_at(in.line_number() + 1,
                          "found the end of the file, expected the features of image " +
                              std::to_string(id) + " (a line, blank for none)");
    if (auto e = read_features(in, draft)) return e;
  }
  return {};
}

std::optional<Error> read_points_text(std::string_view text, const std::string& name,
                                      ColmapDraft& draft) {
  LineCursor in(text, name);
  while (in.next_record()) {
    std::uint64_t id;
    std::array<double, 3> xyz;
    std::array<std::uint8_t, 3> colour;
    double error_px;
    if (!in.read_integer(id)) return in.refuse("the id of a point");
    if (!read_reals(in, xyz)) return in.refuse("a finite number, one of x, y, z of a point");
    for (std::uint8_t& c : colour)
      if (!in.read_integer(c)) return in.refuse("one of r, g, b of a point, 0 to 255");
    if (!in.read_real(error_px)) return in.refuse("a finite number, the error of a point");
    if (auto refusal = draft.add_point(id, xyz, colour, error_px)) return in.refuse_as(*refusal);
    while (!in.line_ended()) {
      std::uint32_t image_id, feature;
      if (!in.read_integer(image_id))
        return in.refuse("the id of an image, in the track of point " + std::to_string(id));
      if (!in.read_integer(feature))
        return in.refuse("the number of a feature, in the track of point " + std::to_string(id));
      if (auto refusal = draft.add_track_element(image_id, feature)) return in.refuse_as(*refusal);
    }
  }
  return {};
}

}  // namespace sheaf
