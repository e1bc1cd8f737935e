// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/openmvg.h"

#include <array>
#include <cmath>
#include <map>

#include "io/json_reading.h"
#include "io/json_text.h"
#include "io/view_model.h"

namespace sheaf {
namespace {

using Kind = JsonValue::Kind;

/// What cereal adds to the ids of pointers and types where they occur first.
constexpr double kFirst = 2147483648.0;

/// A whole panorama; OpenMVG and EQUIRECTANGULAR agree on those alone.
CameraOfFile panorama_of(double width, double height) {
  return {{CameraModel::equirectangular,
           {width, height},
           static_cast<std::uint64_t>(width),
           static_cast<std::uint64_t>(height)}};
}

class Reading : JsonReading {
 public:
  explicit Reading(const FormatInput& input) : JsonReading(input.name), input_(input) {}

  Result<Problem> run() {
    const JsonValue& root = *input_.json;
    each(root, "intrinsics", [this](const JsonValue& v) { read_intrinsic(v); });
    each(root, "extrinsics", [this](const JsonValue& v) { read_pose(v); });
    each(root, "views", [this](const JsonValue& v) { read_view(v); });
    if (error_) return *error_;
    model_.place_views(input_.notes);
    each(root, "structure", [this](const JsonValue& v) { read_landmark(v); });
    if (error_) return *error_;
    if (strays_ > 0)
      input_.notes.push_back(std::to_string(strays_) +
                             " observations are of views that are no images, and were left out");
    model_.metadata().point_colours.clear();
    return model_.take("openmvg", json_members(root, {"sfm_data_version", "views", "intrinsics",
                                                      "extrinsics", "structure"}));
  }

 private:
  std::uint32_t id(const JsonValue& object, const std::string& key) {
    const double x = number(object, key);
    if (error_ || (x >= 0 && x <= ViewModel::kNone && x == std::floor(x)))
      return static_cast<std::uint32_t>(x);
    return refuse(*object.find(key), "\"" + key + "\": an id, 0 to 2^32 - 1"), 0;
  }

  template <std::size_t kCount>
  std::array<double, kCount> list(const JsonValue& object, const std::string& key) {
    const JsonValue* v = need(object, key);
    return v == nullptr ? std::array<double, kCount>() : numbers<kCount>(*v, key);
  }

  void check(const JsonValue& v, const std::string& found, const char* expected) {
    if (!found.empty()) refuse(v.line, found, expected);
  }

  /// "value" of an item of a list that cereal made of a map.
  const JsonValue* value_of(const JsonValue& v) {
    if (v.kind != Kind::object) return refuse(v, "an object with \"key\" and \"value\""), nullptr;
    return need(v, "value");
  }

  /// What a pointer points to, which stands where it occurs first.
  const JsonValue* data_of(const JsonValue& value, std::map<double, const JsonValue*>& known) {
    const JsonValue* wrapper = need(value, "ptr_wrapper");
    if (wrapper == nullptr) return nullptr;
    double pointer = number(*wrapper, "id");
    if (error_) return nullptr;
    const JsonValue* data = wrapper->find("data");
    if (pointer >= kFirst) pointer -= kFirst;
    if (data != nullptr) known[pointer] = data;
    const auto at = known.find(pointer);
    if (at == known.end() || at->second->kind != Kind::object)
      return refuse(*wrapper, "\"data\": an object, or the id of a pointer before"), nullptr;
    return at->second;
  }

  /// The name of a type, which stands where it occurs first.
  std::string type_of(const JsonValue& value) {
    double type = number(value, "polymorphic_id");
    if (error_) return {};
    if (type >= kFirst) type -= kFirst;
    if (value.find("polymorphic_name") != nullptr) types_[type] = text(value, "polymorphic_name");
    const auto at = types_.find(type);
    if (at != types_.end()) return at->second;
    return refuse(value.line, "an id of a type that no \"polymorphic_name\" was given to", "one"),
           std::string();
  }

  void read_intrinsic(const JsonValue& v) {
    const JsonValue* value = value_of(v);
    if (value == nullptr) return;
    const std::uint32_t key = id(v, "key");
    const std::string type = type_of(*value);
    const JsonValue* data = error_ ? nullptr : data_of(*value, intrinsics_);
    if (data == nullptr) return;
    // Some types have the members of a pinhole in an object of their own.
    const JsonValue* base = data->find("value0");
    const JsonValue& of_pinhole = base != nullptr && base->kind == Kind::object ? *base : *data;
    const auto width = number(of_pinhole, "width"), height = number(of_pinhole, "height");
    if (!error_ && !(width >= 0 && width <= 1e9 && height >= 0 && height <= 1e9))
      refuse(data->line, "an absurd size of images", "a number of pixels");
    if (!error_ && type == "spherical" && !(width == 2 * height && width > 0))
      refuse(data->line, "a spherical lens whose images are not twice as wide as high",
             "a whole panorama");
    if (!error_ && type == "spherical")
      return check(v, model_.add_intrinsic(key, panorama_of(width, height), ""), "ids that differ");
    BrownLens lens;
    lens.fx = lens.fy = above_zero(of_pinhole, "focal_length");
    const auto centre = list<2>(of_pinhole, "principal_point");
    lens.cx = centre[0], lens.cy = centre[1];
    if (error_) return;
    const CameraOfFile camera =
        camera_of_type(*value, *data, type, lens, static_cast<std::uint64_t>(width),
                       static_cast<std::uint64_t>(height));
    if (!error_) check(v, model_.add_intrinsic(key, camera, ""), "ids that differ");
  }

  CameraOfFile camera_of_type(const JsonValue& value, const JsonValue& data,
                              const std::string& type, BrownLens lens, std::uint64_t width,
                              std::uint64_t height) {
    if (type == "pinhole") return camera_of(lens, {}, width, height);
    if (type == "pinhole_radial_k1") {
      lens.k[0] = list<1>(data, "disto_k1")[0];
      return camera_of(lens, {1}, width, height);
    }
    if (type == "pinhole_radial_k3") {
      lens.k = list<3>(data, "disto_k3");
      // Without the third coefficient there is a model of one focal length.
      return camera_of(lens, {lens.k[2] == 0 ? 2 : 3}, width, height);
    }
    if (type == "pinhole_brown_t2") {
      const auto k = list<5>(data, "disto_t2");
      lens.k = {k[0], k[1], k[2]};
      lens.p = {k[3], k[4]};
      return camera_of(lens, {3, true}, width, height);
    }
    if (type == "fisheye") {
      const auto k = list<4>(data, "fisheye");
      return {{CameraModel::opencv_fisheye,
               {lens.fx, lens.fx, lens.cx, lens.cy, k[0], k[1], k[2], k[3]},
               width,
               height}};
    }
    refuse(value.line, "a lens of the type " + type,
           "one that Sheaf has a model of: pinhole, pinhole_radial_k1, pinhole_radial_k3, "
           "pinhole_brown_t2, fisheye or spherical");
    return {};
  }

  void read_pose(const JsonValue& v) {
    const JsonValue* value = value_of(v);
    if (value == nullptr) return;
    const std::uint32_t key = id(v, "key");
    const JsonValue* rows = need(*value, "rotation");
    const auto centre = list<3>(*value, "center");
    if (rows == nullptr || error_) return;
    if (rows->kind != Kind::list || rows->items.size() != 3)
      return refuse(*rows, "\"rotation\": three rows of three numbers");
    std::array<double, 9> R{};
    for (std::size_t r = 0; r < 3; ++r) {
      const auto row = numbers<3>(rows->items[r], "rotation");
      std::copy(row.begin(), row.end(), R.begin() + static_cast<std::ptrdiff_t>(3 * r));
    }
    if (!error_) check(*value, model_.add_pose(key, R, centre), "a rotation, and ids that differ");
  }

  void read_view(const JsonValue& v) {
    const JsonValue* value = value_of(v);
    const JsonValue* data = value != nullptr ? data_of(*value, views_) : nullptr;
    if (data == nullptr) return;
    ViewModel::View view;
    view.id = id(v, "key");
    view.pose = id(*data, "id_pose");
    view.intrinsic = id(*data, "id_intrinsic");
    const JsonValue *folder = data->find("local_path"), *file = need(*data, "filename");
    if (error_) return;
    view.name = (folder != nullptr ? folder->text : "") + file->text;
    view.members = json_members(
        *data, {"local_path", "filename", "width", "height", "id_view", "id_intrinsic", "id_pose"});
    view.whole = json_members(*data, {});
    check(v, model_.add_view(std::move(view)), "ids that differ");
  }

  void read_landmark(const JsonValue& v) {
    const JsonValue* value = value_of(v);
    if (value == nullptr) return;
    const std::uint32_t key = id(v, "key");
    const auto X = list<3>(*value, "X");
    if (error_) return;
    check(v, model_.add_point(key, X, {}), "ids that differ");
    each(*value, "observations", [this](const JsonValue& o) {
      const JsonValue* observed = value_of(o);
      if (observed == nullptr) return;
      const std::uint32_t view = id(o, "key"), feature = id(*observed, "id_feat");
      const auto xy = list<2>(*observed, "x");
      if (!error_) strays_ += !model_.add_observation(view, feature, xy, 0);
    });
  }

  const FormatInput& input_;
  ViewModel model_;
  std::map<double, const JsonValue*> intrinsics_, views_;
  std::map<double, std::string> types_;
  std::size_t strays_ = 0;
};

}  // namespace

bool is_openmvg(const JsonValue& root) {
  return root.kind == Kind::object && root.find("sfm_data_version") != nullptr;
}

Result<Problem> parse_openmvg(const FormatInput& input) { return Reading(input).run(); }

}  // namespace sheaf
