// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "image/grey.h"
#include "image/image_bounds.h"
#include "sheaf/error.h"

namespace sheaf {

inline constexpr std::string_view kPgmMark = "P5";

/// The samples of a binary PGM file as they are stored: 8 bits up to a largest value of 255, above
/// that 16, the high byte first. Errors: ErrorCode::unreadable_input with `name` in front.
Result<Raster> decode_pgm(std::string_view bytes, const std::string& name,
                          const ImageBounds& bounds = {});

}  // namespace sheaf
