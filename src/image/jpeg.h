// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "image/grey.h"
#include "image/image_bounds.h"
#include "sheaf/error.h"

namespace sheaf {

/// The samples of a JPEG file, grey or colour, as they are stored: a camera's note on how it was
/// held turns nothing. Errors: ErrorCode::unreadable_input with `name` in front, also for what is
/// out of bounds and for more scans than a progressive image needs.
Result<Raster> decode_jpeg(std::string_view bytes, const std::string& name,
                           const ImageBounds& bounds = {});

/// PNG, JPEG or binary PGM, told by the first bytes.
Result<Raster> decode_image(std::string_view bytes, const std::string& name,
                            const ImageBounds& bounds = {});

}  // namespace sheaf
