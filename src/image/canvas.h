// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "image/image.h"

namespace sheaf {

/// All of these leave out what lies outside of the image.

/// Pixels x0 <= x < x1, y0 <= y < y1.
void fill_rectangle(Image& image, int x0, int y0, int x1, int y1, Color color);
/// A frame one pixel wide around them, just outside.
void draw_frame(Image& image, int x0, int y0, int x1, int y1, Color color);

/// From one pixel's centre to another's, smooth at its edges; `strength` in [0, 1] mixes the colour
/// with what is there.
void draw_line(Image& image, double x0, double y0, double x1, double y1, double width, Color color,
               double strength = 1);
void fill_circle(Image& image, double x, double y, double radius, Color color);

/// Letters 5 x 7 (9 with descenders), 6 apart, times `scale`. (x, y) is the top left corner. What
/// is not printable ASCII is drawn as '?'.
void draw_text(Image& image, int x, int y, const std::string& text, int scale, Color color);
/// Upwards, as beside a vertical axis; (x, y) is the bottom left corner of what is drawn.
void draw_text_upwards(Image& image, int x, int y, const std::string& text, int scale, Color color);
int text_width(const std::string& text, int scale);

}  // namespace sheaf
