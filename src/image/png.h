// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "image/grey.h"
#include "image/image.h"
#include "image/image_bounds.h"
#include "sheaf/error.h"

namespace sheaf {

/// The bytes of a PNG file, 8 bits a channel. Errors: ErrorCode::unwritable_output, as for an image
/// without pixels.
Result<std::string> encode_png(const Image& image);

/// A grey or colour PNG of 8 or 16 bits. Errors as above.
Result<std::string> encode_png(const Raster& raster);

/// The samples of a PNG file, grey or colour, of 8 or 16 bits; palettes become colours, fewer bits
/// become 8, transparency is left out. Errors: ErrorCode::unreadable_input with `name` in front,
/// also for what is out of bounds.
Result<Raster> decode_png(std::string_view bytes, const std::string& name,
                          const ImageBounds& bounds = {});

}  // namespace sheaf
