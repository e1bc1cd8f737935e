// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "chart/plot.h"
#include "image/image.h"
#include "sheaf/error.h"

namespace sheaf {

constexpr Color kPaper{255, 255, 255}, kInk{28, 32, 40}, kFaint{120, 126, 136},
    kRule{208, 212, 218};

/// A grey level of 0 to 255, rounded and held within.
Color grey_shade(double level);

/// From blue (-1) over white to red (1), told apart with any kind of colour vision.
Color signed_shade(double t);

/// From blue (0) over yellow to red (1): small to large.
Color size_shade(double t);

/// A bar of shades between two values with its ends' labels below and what it shows above; (x, y)
/// is its top left corner, text included. Errors: as encode_png.
Result<void> draw_colour_bar(Drawing& out, double x, double y, Color (*shade)(double), double from,
                             double to, const std::string& low, const std::string& high,
                             const std::string& what);

}  // namespace sheaf
