// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "chart/plot.h"

namespace sheaf {

/// A drawing as a file of its own: on white, with the style of its classes inside and a title that
/// is read where it cannot be seen. Beside those of the page's charts there are `h` (a heading),
/// `link` (a line among thousands) and `rule` (a line between parts). Lengths are pixels.
std::string svg_file(const Drawing& drawing, double width, double height, const std::string& title);

}  // namespace sheaf
