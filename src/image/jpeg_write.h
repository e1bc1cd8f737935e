// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sheaf {

/// The bytes of a baseline JPEG file of grey levels, row by row from the top left. quality: 1 to
/// 100, as libjpeg counts it. Empty where the image has no pixels or libjpeg refuses it.
std::string encode_grey_jpeg(const std::vector<std::uint8_t>& grey, int width, int height,
                             int quality);

}  // namespace sheaf
