// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nanobind/nanobind.h>

#include <vector>

#include "sheaf/camera.h"

namespace sheaf {

namespace nb = nanobind;

/// The structured type of an array of lenses: model, parameters, width_px, height_px; laid out as
/// `Camera` is.
nb::object camera_dtype();

/// Lenses from an array of that type, or from a sequence of (model, parameters), with or without
/// (..., width_px, height_px); the model is its name. Throws Error (usage) for a model that is not
/// known and another number of parameters than it has.
std::vector<Camera> cameras_from(nb::handle given);

/// (model, parameters, width_px, height_px), as sheaf.Camera.
nb::object camera_object(const Camera& camera);

}  // namespace sheaf
