// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/rig_configuration_file.h"

#include <cmath>
#include <optional>

#include "geometry/rotation.h"
#include "io/byte_source.h"
#include "io/json_lines.h"

namespace sheaf {
namespace {

using Kind = JsonValue::Kind;

class Reading {
 public:
  explicit Reading(std::string name) : name_(std::move(name)) {}

  Result<RigConfigurationFile> run(const JsonValue& root) {
    if (root.kind != Kind::list) return refuse(root, "a list of rigs");
    for (const JsonValue& rig : root.items)
      if (auto e = read_rig(rig)) return *e;
    if (unused_ > 0)
      out_.notes.push_back(std::to_string(unused_) +
                           " cameras of the rig configuration state camera_model_name or "
                           "camera_params, which are not used: lenses are the model's");
    return std::move(out_);
  }

 private:
  Error refuse(const JsonValue& found, const std::string& expected) const {
    return refuse(found.line, found.shown(), expected);
  }
  Error refuse(std::uint64_t line, const std::string& found, const std::string& expected) const {
    return Error(ErrorCode::unreadable_input, name_ + ":" + std::to_string(line) + ": found " +
                                                  found + ", expected " + expected);
  }

  std::optional<Error> read_rig(const JsonValue& rig) {
    if (rig.kind != Kind::object) return refuse(rig, "a rig: an object with \"cameras\"");
    const JsonValue* cameras = rig.find("cameras");
    if (cameras == nullptr) return refuse(rig.line, "a rig without \"cameras\"", "a list of them");
    if (cameras->kind != Kind::list || cameras->items.empty())
      return refuse(*cameras, "a list of a rig's cameras");
    out_.rigs.emplace_back();
    std::size_t references = 0;
    for (const JsonValue& camera : cameras->items) {
      if (auto e = read_camera(camera)) return e;
      references += out_.rigs.back().cameras.back().reference;
    }
    if (references == 1) return {};
    return refuse(rig.line, "a rig with " + std::to_string(references) + " reference sensors",
                  "one camera with \"ref_sensor\": true");
  }

  std::optional<Error> read_camera(const JsonValue& camera) {
    if (camera.kind != Kind::object)
      return refuse(camera, "a camera: an object with \"image_prefix\"");
    RigCamera& out = out_.rigs.back().cameras.emplace_back();
    const JsonValue* prefix = camera.find("image_prefix");
    if (prefix == nullptr)
      return refuse(camera.line, "a camera without \"image_prefix\"",
                    "what its images' names begin with");
    if (prefix->kind != Kind::text)
      return refuse(*prefix, "a text, what the camera's images' names begin with");
    out.image_prefix = prefix->text;
    if (const JsonValue* reference = camera.find("ref_sensor")) {
      if (reference->kind != Kind::boolean) return refuse(*reference, "true or false");
      out.reference = reference->boolean;
    }
    unused_ +=
        camera.find("camera_model_name") != nullptr || camera.find("camera_params") != nullptr;
    return read_pose(camera, out);
  }

  std::optional<Error> read_pose(const JsonValue& camera, RigCamera& out) {
    const JsonValue* rotation = camera.find("cam_from_rig_rotation");
    const JsonValue* translation = camera.find("cam_from_rig_translation");
    if (rotation == nullptr && translation == nullptr) return {};
    const JsonValue& either = rotation ? *rotation : *translation;
    if (out.reference)
      return refuse(either.line, "a pose of the reference sensor", "none: it is the rig's origin");
    if (rotation == nullptr || translation == nullptr)
      return refuse(either.line,
                    rotation ? "cam_from_rig_rotation alone" : "cam_from_rig_translation alone",
                    "both or neither");
    Pose& pose = out.cam_from_rig.emplace();
    if (auto e = read_numbers(*rotation, "four numbers w, x, y, z", pose.rotation)) return e;
    if (auto e = read_numbers(*translation, "three numbers", pose.translation)) return e;
    double norm2 = 0;
    for (const double q : pose.rotation) norm2 += q * q;
    if (!(norm2 > 1e-12) || !std::isfinite(norm2))
      return refuse(rotation->line, "a quaternion of no direction or an absurd length",
                    "a rotation w, x, y, z");
    pose.rotation = normalized(pose.rotation);
    return {};
  }

  template <std::size_t kCount>
  std::optional<Error> read_numbers(const JsonValue& list, const std::string& expected,
                                    std::array<double, kCount>& out) {
    if (list.kind != Kind::list || list.items.size() != kCount) return refuse(list, expected);
    for (std::size_t k = 0; k < kCount; ++k) {
      if (list.items[k].kind != Kind::number || !std::isfinite(list.items[k].number))
        return refuse(list.items[k], "one of " + expected);
      out[k] = list.items[k].number;
    }
    return {};
  }

  std::string name_;
  RigConfigurationFile out_;
  std::size_t unused_ = 0;
};

}  // namespace

Result<RigConfigurationFile> parse_rig_configuration(const std::string& text,
                                                     const std::string& name) {
  const Result<JsonValue> root = parse_json(text, name);
  if (!root.ok()) return root.error();
  return Reading(name).run(root.value());
}

Result<RigConfigurationFile> read_rig_configuration(const std::filesystem::path& path) {
  const Result<std::string> text = read_text(path);
  if (!text.ok()) return text.error();
  return parse_rig_configuration(text.value(), path.string());
}

}  // namespace sheaf
