// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "sheaf/camera.h"
#include "sheaf/loss.h"

namespace sheaf {

/// Whether it is one of the enumeration's values: callers may have made it from any integer.
constexpr bool is_known(CameraModel model) {
  return static_cast<std::size_t>(model) < kCameraModels;
}
constexpr bool is_known(LossKind kind) { return kind <= LossKind::geman_mcclure; }

}  // namespace sheaf
