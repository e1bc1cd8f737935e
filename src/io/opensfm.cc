// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/opensfm.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <unordered_map>

#include "geometry/rotation.h"
#include "io/brown_lens.h"
#include "io/json_reading.h"
#include "io/json_text.h"
#include "io/tab_fields.h"
#include "scene/source_files.h"

namespace sheaf {
namespace {

using Kind = JsonValue::Kind;

class Reading : JsonReading {
 public:
  explicit Reading(const FormatInput& input) : JsonReading(input.name), input_(input) {
    source_.format = "opensfm";
  }

  Result<Problem> run() {
    const JsonValue& root = *input_.json;
    const JsonValue& first = root.kind == Kind::list ? root.items[0] : root;
    if (root.items.size() > 1)
      note(std::to_string(root.items.size() - 1) +
           " further reconstructions of the file were left out");
    source_.root_members = json_members(
        first, {"cameras", "shots", "points", "pano_shots", "rig_cameras", "rig_instances"});
    each_member(first, "cameras", [this](auto& id, auto& v) { read_camera(id, v); });
    each_member(first, "shots", [this](auto& id, auto& v) { read_shot(id, v); });
    if (first.find("points") != nullptr)
      each_member(first, "points", [this](auto& id, auto& v) { read_point(id, v); });
    if (!error_) note_rigs(first);
    if (!error_ && !number_points()) note("points are numbered: their ids are no numbers");
    if (!error_) read_tracks();
    if (error_) return *error_;
    return take();
  }

 private:
  void note(std::string sentence) { input_.notes.push_back(std::move(sentence)); }

  template <class Read>
  void each_member(const JsonValue& object, const std::string& key, Read read) {
    const JsonValue* members = error_ ? nullptr : need(object, key);
    if (members == nullptr) return;
    if (members->kind != Kind::object) return refuse(*members, "\"" + key + "\": an object");
    for (const JsonMember& member : members->members)
      if (!error_) read(member.name, member.value);
  }

  double optional(const JsonValue& object, const std::string& key) {
    return object.find(key) == nullptr ? 0 : number(object, key);
  }

  std::uint64_t size(const JsonValue& object, const std::string& key) {
    constexpr double kMost = 1e9;
    const double x = number(object, key);
    if (error_ || (x >= 1 && x <= kMost && x == std::floor(x)))
      return static_cast<std::uint64_t>(x);
    refuse(*object.find(key), "\"" + key +
                                  "\": a number of pixels, without which measurements "
                                  "have no unit");
    return 0;
  }

  void read_camera(const std::string& id, const JsonValue& v) {
    if (v.kind != Kind::object) return refuse(v, "a camera: an object");
    const std::uint64_t width = size(v, "width"), height = size(v, "height");
    if (error_) return;
    const std::string type = v.find("projection_type") ? text(v, "projection_type") : "perspective";
    const auto side = static_cast<double>(std::max(width, height));
    if (type == "spherical") return read_panorama(id, v, width, height);
    BrownLens lens;
    lens.cx = static_cast<double>(width) / 2 + side * optional(v, "c_x");
    lens.cy = static_cast<double>(height) / 2 + side * optional(v, "c_y");
    const bool one = type == "perspective" || type == "fisheye" || v.find("focal") != nullptr;
    lens.fx = side * above_zero(v, one ? "focal" : "focal_x");
    lens.fy = one ? lens.fx : side * above_zero(v, "focal_y");
    lens.k = {optional(v, "k1"), optional(v, "k2"), optional(v, "k3")};
    lens.p = {optional(v, "p1"), optional(v, "p2")};
    if (error_) return;
    CameraOfFile out;
    if (type == "perspective") {
      out = camera_of(lens, {2}, width, height);
    } else if (type == "brown" || type == "radial" || type == "simple_radial") {
      const int radial = type == "brown" ? 3 : type == "radial" ? 2 : 1;
      out = camera_of(lens, {radial, type == "brown", true}, width, height);
    } else if (type == "fisheye") {
      out.camera = {CameraModel::radial_fisheye,
                    {lens.fx, lens.cx, lens.cy, lens.k[0], lens.k[1]},
                    width,
                    height};
    } else if (type == "fisheye_opencv") {
      out.camera = {
          CameraModel::opencv_fisheye,
          {lens.fx, lens.fy, lens.cx, lens.cy, lens.k[0], lens.k[1], lens.k[2], optional(v, "k4")},
          width,
          height};
    } else {
      return refuse(*v.find("projection_type"),
                    "a lens that Sheaf has a model of: perspective, simple_radial, radial, brown, "
                    "fisheye, fisheye_opencv or spherical");
    }
    add_camera(id, v, out);
  }

  void read_panorama(const std::string& id, const JsonValue& v, std::uint64_t width,
                     std::uint64_t height) {
    CameraOfFile out;
    out.camera = {CameraModel::equirectangular,
                  {static_cast<double>(width), static_cast<double>(height)},
                  width,
                  height};
    if (!is_whole_panorama(out.camera))
      return refuse(v.line, "a spherical lens whose images are not twice as wide as high",
                    "a whole panorama");
    add_camera(id, v, out);
  }

  void add_camera(const std::string& id, const JsonValue& v, const CameraOfFile& out) {
    if (!camera_of_id_.emplace(id, problem_.cameras.size()).second)
      return refuse(v.line, "camera " + sheaf::quoted(id) + " twice", "ids that differ");
    problem_.cameras.push_back(out.camera);
    source_.unknown_parameters.push_back(out.unknown);
    source_.camera_names.push_back(id);
    source_.camera_members.push_back(
        json_members(v, {"projection_type", "width", "height", "focal", "focal_x", "focal_y", "c_x",
                         "c_y", "k1", "k2", "k3", "k4", "p1", "p2"}));
  }

  void read_shot(const std::string& id, const JsonValue& v) {
    if (v.kind != Kind::object) return refuse(v, "a shot: an object");
    Pose pose;
    const JsonValue *rotation = need(v, "rotation"), *translation = need(v, "translation");
    const std::string camera = text(v, "camera");
    if (error_) return;
    const Vector3<double> turn = numbers<3>(*rotation, "rotation");
    pose.translation = numbers<3>(*translation, "translation");
    const auto at = camera_of_id_.find(camera);
    if (at == camera_of_id_.end())
      refuse(*v.find("camera"),
             "the id of one of the " + std::to_string(problem_.cameras.size()) + " cameras");
    if (!(std::hypot(turn[0], turn[1], turn[2]) < 1e6))
      refuse(*rotation, "an angle-axis in radians, not one of more than a million");
    if (!error_ && !image_of_id_.emplace(id, problem_.num_images()).second)
      refuse(v.line, "shot " + sheaf::quoted(id) + " twice", "names that differ");
    if (error_) return;
    pose.rotation = quaternion_from_angle_axis(turn);
    problem_.add_image(pose, at->second);
    problem_.bal_angle_axis.insert(problem_.bal_angle_axis.end(), turn.begin(), turn.end());
    metadata_.image_names.push_back(id);
    source_.image_members.push_back(json_members(v, {"rotation", "translation", "camera"}));
  }

  void read_point(const std::string& id, const JsonValue& v) {
    const JsonValue* at = v.kind == Kind::object ? need(v, "coordinates") : nullptr;
    if (at == nullptr) return error_ ? void() : refuse(v, "a point: an object");
    const auto X = numbers<3>(*at, "coordinates");
    std::array<std::uint8_t, 3> colour{128, 128, 128};
    if (const JsonValue* stated = v.find("color")) {
      const auto levels = numbers<3>(*stated, "color");
      for (std::size_t k = 0; k < 3; ++k)
        colour[k] = static_cast<std::uint8_t>(std::lround(std::clamp(levels[k], 0.0, 255.0)));
    }
    if (!error_ && !point_of_id_.emplace(id, problem_.num_points()).second)
      refuse(v.line, "point " + sheaf::quoted(id) + " twice", "ids that differ");
    if (error_) return;
    problem_.add_point(X[0], X[1], X[2]);
    point_names_.push_back(id);
    metadata_.point_colours.push_back(colour);
  }

  /// OpenSfM's tracks are texts, which are numbers as it makes them.
  bool number_points() {
    for (const std::string& id : point_names_) {
      std::uint64_t number;
      const auto [end, error] = std::from_chars(id.data(), id.data() + id.size(), number);
      const bool plain =
          error == std::errc() && end == id.data() + id.size() && (id.size() == 1 || id[0] != '0');
      if (!plain) return metadata_.point_ids.clear(), false;
      metadata_.point_ids.push_back(number);
    }
    return true;
  }

  void note_rigs(const JsonValue& first) {
    const JsonValue* instances = first.find("rig_instances");
    if (instances == nullptr) return;
    std::size_t images = 0;
    for (const JsonMember& member : instances->members)
      if (const JsonValue* ids = member.value.find("rig_camera_ids"))
        images += ids->members.size() > 1 ? ids->members.size() : 0;
    if (images > 0)
      note(std::to_string(images) + " images of rigs are read as images that move by themselves");
  }

  void read_tracks() {
    constexpr const char* kTracks = "tracks.csv";
    if (!input_.beside.has || !input_.beside.has(kTracks))
      return note("there is no tracks.csv beside it, and so no observation");
    const Result<std::string> text = input_.beside.bytes(kTracks);
    if (!text.ok()) return void(error_ = text.error());
    source_.beside = input_.beside.folder / kTracks;
    TabFields in(text.value(), input_.beside.name(kTracks));
    int version = 0;
    std::size_t others = 0;
    for (bool first = true; in.next_line(); first = false) {
      constexpr std::string_view kMark = "OPENSFM_TRACKS_VERSION_v";
      if (first && in.line().starts_with(kMark)) {
        version = in.line().substr(kMark.size()) == "1" ? 1 : 2;
        continue;
      }
      if (!in.line().empty()) others += read_track(in, version);
      if (error_) return;
    }
    if (others > 0)
      note(std::to_string(others) +
           " lines of tracks.csv are of images or points that the "
           "reconstruction has not, and were left out");
  }

  /// 1 where the line is of an image or a point that is not there.
  std::size_t read_track(TabFields& in, int version) {
    std::string_view shot, track;
    std::uint32_t feature = 0;
    std::array<double, 2> xy{};
    double scale = 0;
    const auto stop = [&](const char* expected) { return error_ = in.refuse(expected), 0; };
    if (!in.text(shot)) return stop("the name of a shot");
    if (!in.text(track)) return stop("the id of a track, behind a tab");
    if (!in.number(feature)) return stop("the number of a feature, behind a tab");
    if (!in.number(xy[0]) || !in.number(xy[1])) return stop("a finite number, x or y of a feature");
    if (version > 0 && !in.number(scale)) return stop("a finite number, the scale of a feature");
    const auto image = image_of_id_.find(std::string(shot));
    const auto point = point_of_id_.find(std::string(track));
    if (image == image_of_id_.end() || point == point_of_id_.end()) return 1;
    const Camera& camera = problem_.cameras[problem_.image_camera[image->second]];
    const double side = static_cast<double>(std::max(camera.width_px, camera.height_px));
    const std::array<double, 2> px{side * xy[0] + static_cast<double>(camera.width_px) / 2,
                                   side * xy[1] + static_cast<double>(camera.height_px) / 2};
    if (!std::isfinite(px[0]) || !std::isfinite(px[1]))
      return stop("a measurement that is finite in pixels");
    problem_.add_observation(image->second, point->second, px[0], px[1]);
    metadata_.observation_feature.push_back(feature);
    source_.feature_scales.push_back(scale);
    source_.normalised_xy.insert(source_.normalised_xy.end(), xy.begin(), xy.end());
    return 0;
  }

  Problem take() {
    metadata_.state_hash = state_hash(problem_);
    metadata_.source = std::make_shared<const SourceFiles>(std::move(source_));
    problem_.metadata = std::make_shared<const SceneMetadata>(std::move(metadata_));
    return std::move(problem_);
  }

  const FormatInput& input_;
  Problem problem_;
  SceneMetadata metadata_;
  SourceFiles source_;
  std::vector<std::string> point_names_;
  std::unordered_map<std::string, std::uint32_t> camera_of_id_, image_of_id_, point_of_id_;
};

}  // namespace

bool is_opensfm(const JsonValue& root) {
  const JsonValue* first = root.kind == Kind::object                        ? &root
                           : root.kind == Kind::list && !root.items.empty() ? &root.items[0]
                                                                            : nullptr;
  return first != nullptr && first->kind == Kind::object && first->find("cameras") != nullptr &&
         first->find("shots") != nullptr;
}

Result<Problem> parse_opensfm(const FormatInput& input) { return Reading(input).run(); }

}  // namespace sheaf
