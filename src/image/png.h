// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "image/image.h"
#include "sheaf/error.h"

namespace sheaf {

/// The bytes of a PNG file, 8 bits a channel. Errors: ErrorCode::unwritable_output, as for an image
/// without pixels.
Result<std::string> encode_png(const Image& image);

}  // namespace sheaf
