// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "camera_records.h"

#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <cstring>
#include <string>

#include "arrays.h"
#include "options/words.h"
#include "sheaf/error.h"

namespace sheaf {
namespace {

std::string numbered(std::size_t i) { return "cameras[" + std::to_string(i) + "]: "; }

CameraModel model_named(const std::string& name, std::size_t i) {
  if (const auto model = camera_model_named(name)) return *model;
  std::vector<std::string> known;
  for (std::size_t m = 0; m < kCameraModels; ++m)
    known.emplace_back(to_string(static_cast<CameraModel>(m)));
  throw Error(ErrorCode::usage,
              numbered(i) + "found the model '" + name + "', expected one of " + listed(known));
}

Camera camera_from(nb::handle given, std::size_t i) {
  const nb::sequence parts = nb::cast<nb::sequence>(given);
  const std::size_t count = nb::len(parts);
  if (count != 2 && count != 4)
    throw Error(ErrorCode::usage,
                numbered(i) +
                    "expected (model, parameters) or (model, parameters, width_px, "
                    "height_px)");
  Camera out;
  out.model = model_named(nb::cast<std::string>(nb::str(nb::object(parts[0]))), i);
  const std::vector<double> parameters =
      reals_from(nb::object(parts[1]), (numbered(i) + "parameters").c_str(), 1);
  const std::size_t expected = parameter_count(out.model);
  if (parameters.size() != expected)
    throw Error(ErrorCode::usage, numbered(i) + "found " + std::to_string(parameters.size()) +
                                      " parameters, expected the " + std::to_string(expected) +
                                      " of " + std::string(to_string(out.model)) + ": " +
                                      listed([&] {
                                        std::vector<std::string> names;
                                        for (const auto name : parameter_names(out.model))
                                          names.emplace_back(name);
                                        return names;
                                      }()));
  out.parameters = {};
  for (std::size_t k = 0; k < expected; ++k) out.parameters[k] = parameters[k];
  if (count == 4) {
    out.width_px = nb::cast<std::uint64_t>(nb::object(parts[2]));
    out.height_px = nb::cast<std::uint64_t>(nb::object(parts[3]));
  }
  return out;
}

std::vector<Camera> cameras_from_records(nb::handle array) {
  const nb::object numpy = nb::module_::import_("numpy");
  const nb::object bytes =
      numpy.attr("ascontiguousarray")(array).attr("reshape")(-1).attr("view")("uint8");
  const auto data = nb::cast<nb::ndarray<const std::uint8_t, nb::device::cpu>>(bytes);
  std::vector<Camera> out(data.size() / sizeof(Camera));
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::uint8_t* record = data.data() + i * sizeof(Camera);
    const std::uint8_t model = record[offsetof(Camera, model)];
    if (model >= kCameraModels)
      throw Error(ErrorCode::usage, numbered(i) + "found the model number " +
                                        std::to_string(model) + ", expected less than " +
                                        std::to_string(kCameraModels));
    std::memcpy(static_cast<void*>(&out[i]), record, sizeof(Camera));
  }
  return out;
}

}  // namespace

nb::object camera_dtype() {
  nb::dict layout;
  const nb::list names, formats, offsets;
  const auto field = [&](const char* name, nb::object format, std::size_t offset) {
    nb::cast<nb::list>(names).append(name);
    nb::cast<nb::list>(formats).append(format);
    nb::cast<nb::list>(offsets).append(offset);
  };
  field("model", nb::str("u1"), offsetof(Camera, model));
  field("parameters", nb::make_tuple("f8", kMaxCameraParameters), offsetof(Camera, parameters));
  field("width_px", nb::str("u8"), offsetof(Camera, width_px));
  field("height_px", nb::str("u8"), offsetof(Camera, height_px));
  layout["names"] = names;
  layout["formats"] = formats;
  layout["offsets"] = offsets;
  layout["itemsize"] = sizeof(Camera);
  return nb::module_::import_("numpy").attr("dtype")(layout);
}

std::vector<Camera> cameras_from(nb::handle given) {
  const bool records = nb::hasattr(given, "dtype") && given.attr("dtype").equal(camera_dtype());
  if (records) return cameras_from_records(given);
  std::vector<Camera> out;
  for (nb::handle camera : nb::borrow<nb::object>(given))
    out.push_back(camera_from(camera, out.size()));
  return out;
}

nb::object camera_object(const Camera& camera) {
  if (static_cast<std::size_t>(camera.model) >= kCameraModels)
    throw Error(ErrorCode::usage, "found the model number " +
                                      std::to_string(static_cast<int>(camera.model)) +
                                      ", expected less than " + std::to_string(kCameraModels));
  const nb::object type = nb::module_::import_("sheaf._records").attr("Camera");
  return type(nb::cast(std::string(to_string(camera.model))),
              array_of(camera.parameters.data(), {parameter_count(camera.model)}), camera.width_px,
              camera.height_px);
}

}  // namespace sheaf
