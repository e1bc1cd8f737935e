// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/alicevision.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "io/json_reading.h"
#include "io/json_text.h"
#include "io/view_model.h"
#include "platform/real_text.h"
#include "scene/stated_rotation.h"

namespace sheaf {
namespace {

using Kind = JsonValue::Kind;
using Version = std::array<int, 3>;

std::optional<double> real_of(const JsonValue& v) {
  if (v.kind == Kind::number && std::isfinite(v.number)) return v.number;
  if (v.kind != Kind::text) return {};
  double x;
  const char* const end = v.text.data() + v.text.size();
  const auto [stop, error] = read_real(v.text.data(), end, x);
  if (error != std::errc() || stop != end || !std::isfinite(x)) return {};
  return x;
}

bool is_true(const JsonValue* v) {
  return v != nullptr && ((v->kind == Kind::boolean && v->boolean) || v->text == "true" ||
                          v->text == "1" || v->number == 1);
}

class Reading : JsonReading {
 public:
  explicit Reading(const FormatInput& input) : JsonReading(input.name), input_(input) {}

  Result<Problem> run() {
    const JsonValue& root = *input_.json;
    read_version(root);
    each(root, "intrinsics", [this](const JsonValue& v) { read_intrinsic(v); });
    each(root, "poses", [this](const JsonValue& v) { read_pose(v); });
    each(root, "rigs", [this](const JsonValue& v) { read_rig(v); });
    each(root, "views", [this](const JsonValue& v) { read_view(v); });
    if (error_) return *error_;
    model_.place_views(input_.notes);
    each(root, "structure", [this](const JsonValue& v) { read_landmark(v); });
    if (error_) return *error_;
    if (root.find("structure") == nullptr)
      input_.notes.push_back(
          "the file has no structure, and so neither points nor observations: of Meshroom's the "
          "one that StructureFromMotion writes has them");
    if (strays_ > 0)
      input_.notes.push_back(std::to_string(strays_) +
                             " observations are of views that are no images, and were left out");
    return model_.take("alicevision", json_members(root, {"version", "views", "intrinsics", "poses",
                                                          "rigs", "structure"}));
  }

 private:
  void read_version(const JsonValue& root) {
    const JsonValue* v = need(root, "version");
    if (v == nullptr) return;
    if (v->kind != Kind::list || v->items.empty() || v->items.size() > 3)
      return refuse(*v, "\"version\": a list of three numbers");
    for (std::size_t k = 0; k < v->items.size(); ++k) {
      const auto x = real_of(v->items[k]);
      if (!x || !(*x >= 0 && *x < 1000)) return refuse(v->items[k], "a number of the version");
      version_[k] = static_cast<int>(*x);
    }
  }

  double real(const JsonValue& object, const std::string& key,
              std::optional<double> otherwise = {}) {
    if (otherwise && object.find(key) == nullptr) return *otherwise;
    const JsonValue* v = need(object, key);
    if (v == nullptr) return 0;
    const auto x = real_of(*v);
    if (!x) refuse(*v, "\"" + key + "\": a finite number");
    return x.value_or(0);
  }

  std::uint32_t id(const JsonValue& object, const std::string& key) {
    if (object.find(key) == nullptr) return ViewModel::kNone;
    const double x = real(object, key);
    if (error_ || (x >= 0 && x <= ViewModel::kNone && x == std::floor(x)))
      return static_cast<std::uint32_t>(x);
    return refuse(*object.find(key), "\"" + key + "\": an id, 0 to 2^32 - 1"), 0;
  }

  template <std::size_t kCount>
  std::array<double, kCount> reals(const JsonValue& object, const std::string& key) {
    std::array<double, kCount> out{};
    const JsonValue* list = object.kind == Kind::object ? need(object, key) : nullptr;
    if (list == nullptr) return out;
    const std::string expected =
        "\"" + key + "\": a list of " + std::to_string(kCount) + " finite numbers";
    if (list->kind != Kind::list || list->items.size() != kCount)
      return refuse(*list, expected), out;
    for (std::size_t k = 0; k < kCount; ++k) {
      const auto x = real_of(list->items[k]);
      if (!x) refuse(list->items[k], expected);
      out[k] = x.value_or(0);
    }
    return out;
  }

  void check(const JsonValue& v, const std::string& found, const char* expected) {
    if (!found.empty()) refuse(v.line, found, expected);
  }

  /// Focal lengths in pixels, as the versions state them.
  void read_focals(const JsonValue& v, double width, BrownLens& lens) {
    if (version_ < Version{1, 2, 0}) {
      lens.fx = lens.fy = real(v, "pxFocalLength");
    } else if (version_ < Version{1, 2, 2}) {
      const auto f = reals<2>(v, "pxFocalLength");
      lens.fx = f[0], lens.fy = f[1];
    } else {
      const double ratio = real(v, "pixelRatio", 1.0);
      const double f = real(v, "focalLength") / real(v, "sensorWidth", 36.0) * width;
      lens.fx = version_ < Version{1, 2, 11} ? f : f / ratio;
      lens.fy = version_ < Version{1, 2, 5}    ? f / ratio
                : version_ < Version{1, 2, 11} ? f * ratio
                                               : f;
    }
    if (!error_ &&
        !(lens.fx > 0 && lens.fy > 0 && std::isfinite(lens.fx) && std::isfinite(lens.fy)))
      refuse(v.line, "no focal length above 0", "one (intrinsics that nothing estimated have -1)");
  }

  std::string type_of(const JsonValue& v) {
    std::string type = text(v, "type");
    if (version_ >= Version{1, 2, 8} && type == "pinhole" && v.find("distortionType") != nullptr) {
      type = text(v, "distortionType");
      if (type == "none") type = "pinhole";
      const JsonValue* undistortion = v.find("undistortionType");
      if (undistortion != nullptr && undistortion->text != "none" && !undistortion->text.empty())
        refuse(*undistortion, "\"undistortionType\": none, as undistortions have no model here");
    }
    return type;
  }

  void read_intrinsic(const JsonValue& v) {
    if (v.kind != Kind::object) return refuse(v, "intrinsics: an object");
    const std::uint32_t key = id(v, "intrinsicId");
    const double width = real(v, "width"), height = real(v, "height");
    if (!error_ && !(width >= 0 && width <= 1e9 && height >= 0 && height <= 1e9))
      refuse(v.line, "an absurd size of images", "a number of pixels");
    BrownLens lens;
    auto centre = reals<2>(v, "principalPoint");
    const std::string type = type_of(v);
    if (error_) return;
    if (version_ >= Version{1, 2, 1}) centre[0] += width / 2, centre[1] += height / 2;
    lens.cx = centre[0], lens.cy = centre[1];
    read_focals(v, width, lens);
    if (error_) return;
    const CameraOfFile out = lens_of(v, type, lens, width, height);
    if (error_) return;
    check(
        v,
        model_.add_intrinsic(
            key, out,
            json_members(v, {"intrinsicId", "width", "height", "sensorWidth", "sensorHeight",
                             "type", "focalLength", "pxFocalLength", "pixelRatio", "principalPoint",
                             "distortionType", "distortionParams", "undistortionType",
                             "undistortionParams", "undistortionOffset", "pxInitialFocalLength",
                             "offsetLocked", "scaleLocked", "distortionLocked"})),
        "ids that differ");
  }

  CameraOfFile lens_of(const JsonValue& v, const std::string& type, BrownLens lens, double width,
                       double height) {
    const auto w = static_cast<std::uint64_t>(width), h = static_cast<std::uint64_t>(height);
    const int radial = type == "pinhole"                         ? 0
                       : type == "radial1" || type == "radialk1" ? 1
                       : type == "radial3" || type == "radialk3" ? 3
                       : type == "brown"                         ? 5
                       : type == "fisheye4" || type == "fisheye" ? 4
                       : type == "fisheye1"                      ? -1
                                                                 : -2;
    if (radial == -2)
      return refuse(v.line, "a lens of the type " + type,
                    "one that Sheaf has a model of: pinhole, radial1, radial3, brown, fisheye4 or "
                    "fisheye1"),
             CameraOfFile();
    std::array<double, 5> k{};
    if (radial != 0) read_distortion(v, static_cast<std::size_t>(std::abs(radial)), k);
    CameraOfFile out;
    if (type == "fisheye1") {
      out.camera = {CameraModel::fov, {lens.fx, lens.fy, lens.cx, lens.cy, k[0]}, w, h};
    } else if (radial == 4) {
      out.camera = {CameraModel::opencv_fisheye,
                    {lens.fx, lens.fy, lens.cx, lens.cy, k[0], k[1], k[2], k[3]},
                    w,
                    h};
    } else {
      lens.k = {k[0], k[1], k[2]};
      lens.p = {k[3], k[4]};
      out = camera_of(lens, {std::min(radial, 3), radial == 5, false}, w, h);
    }
    return out;
  }

  void read_distortion(const JsonValue& v, std::size_t count, std::array<double, 5>& out) {
    const JsonValue* list = need(v, "distortionParams");
    if (list == nullptr || (list->kind == Kind::text && list->text.empty())) return;
    if (list->kind != Kind::list || list->items.size() != count)
      return refuse(*list, "\"distortionParams\": a list of " + std::to_string(count) + " numbers");
    for (std::size_t k = 0; k < count; ++k) {
      const auto x = real_of(list->items[k]);
      if (!x) refuse(list->items[k], "a finite number, a coefficient of distortion");
      out[k] = x.value_or(0);
    }
  }

  /// Rotations stand by columns.
  Pose read_transform(const JsonValue& v, std::array<double, 9>& R, std::array<double, 3>& centre) {
    const auto columns = reals<9>(v, "rotation");
    centre = reals<3>(v, "center");
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c) R[3 * r + c] = columns[3 * c + r];
    return {};
  }

  void read_pose(const JsonValue& v) {
    if (v.kind != Kind::object) return refuse(v, "a pose: an object");
    const std::uint32_t key = id(v, "poseId");
    const JsonValue* pose = need(v, "pose");
    const JsonValue* transform = pose != nullptr ? need(*pose, "transform") : nullptr;
    if (transform == nullptr) return;
    std::array<double, 9> R{};
    std::array<double, 3> centre{};
    read_transform(*transform, R, centre);
    if (!error_)
      check(*transform, model_.add_pose(key, R, centre), "a rotation, and ids that differ");
  }

  void read_rig(const JsonValue& v) {
    if (v.kind != Kind::object) return refuse(v, "a rig: an object");
    std::vector<Pose>& sub_poses = rigs_[id(v, "rigId")];
    each(v, "subPoses", [&](const JsonValue& sub) {
      const JsonValue* pose = sub.kind == Kind::object ? need(sub, "pose") : nullptr;
      if (pose == nullptr) return;
      std::array<double, 9> R{};
      std::array<double, 3> centre{};
      read_transform(*pose, R, centre);
      if (error_) return;
      if (const char* found = no_rotation(R)) return refuse(pose->line, found, "a rotation");
      Pose& out = sub_poses.emplace_back();
      out.rotation = rotation_from_stated(R);
      out.translation = translation_of(out.rotation, centre);
    });
  }

  void read_view(const JsonValue& v) {
    if (v.kind != Kind::object) return refuse(v, "a view: an object");
    ViewModel::View view;
    view.id = id(v, "viewId");
    view.pose = id(v, "poseId");
    view.intrinsic = id(v, "intrinsicId");
    const JsonValue* path = v.find("path");
    view.name = path != nullptr ? path->text : std::string();
    const std::uint32_t rig = id(v, "rigId"), sub = id(v, "subPoseId");
    const JsonValue* independent = v.find("isPoseIndependant");
    if (rig != ViewModel::kNone && independent != nullptr && !is_true(independent)) {
      const auto at = rigs_.find(rig);
      if (at == rigs_.end() || sub >= at->second.size())
        return refuse(v.line, "a view of a rig or a sub-pose that is not there", "those of a rig");
      view.sub_pose = at->second[sub];
    }
    if (error_) return;
    view.members = json_members(v, {"viewId", "poseId", "intrinsicId", "path", "width", "height",
                                    "rigId", "subPoseId", "isPoseIndependant"});
    view.whole = json_members(v, {});
    check(v, model_.add_view(std::move(view)), "ids that differ");
  }

  void read_landmark(const JsonValue& v) {
    if (v.kind != Kind::object) return refuse(v, "a landmark: an object");
    const auto X = reals<3>(v, "X");
    std::array<std::uint8_t, 3> colour{128, 128, 128};
    if (v.find("color") != nullptr) {
      const auto levels = reals<3>(v, "color");
      for (std::size_t k = 0; k < 3; ++k)
        colour[k] = static_cast<std::uint8_t>(std::lround(std::clamp(levels[k], 0.0, 255.0)));
    }
    const std::uint32_t key = id(v, "landmarkId");
    if (error_) return;
    check(v, model_.add_point(key, X, colour), "ids that differ");
    const JsonValue* observations = v.find("observations");
    if (observations == nullptr || observations->kind != Kind::list) return;
    for (const JsonValue& o : observations->items) {
      if (error_) return;
      if (o.kind != Kind::object) return refuse(o, "an observation: an object");
      const std::uint32_t view = id(o, "observationId");
      const auto xy = reals<2>(o, "x");
      const std::uint32_t feature = id(o, "featureId");
      const double scale = real(o, "scale", 0.0);
      if (!error_) strays_ += !model_.add_observation(view, feature, xy, scale);
    }
  }

  const FormatInput& input_;
  Version version_{};
  ViewModel model_;
  std::unordered_map<std::uint32_t, std::vector<Pose>> rigs_;
  std::size_t strays_ = 0;
};

}  // namespace

bool is_alicevision(const JsonValue& root) {
  return root.kind == Kind::object && root.find("version") != nullptr &&
         root.find("views") != nullptr && root.find("intrinsics") != nullptr;
}

Result<Problem> parse_alicevision(const FormatInput& input) { return Reading(input).run(); }

}  // namespace sheaf
