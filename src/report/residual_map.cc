// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/residual_map.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "chart/number_text.h"
#include "chart/svg_file.h"
#include "image/png.h"
#include "report/palette.h"

namespace sheaf {
namespace {

constexpr int kMargin = 24, kGap = 24, kTop = 108, kFoot = 104;
constexpr int kPanel = 640;       // wide, at least; small images are enlarged
constexpr int kMostPanel = 1280;  // large ones are reduced
constexpr double kRadius = 3;
constexpr double kLeastScale = 4;  // grey levels

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", x);
  return text;
}

std::vector<PatchSight> sights_in(const PatchStage& stage, std::uint32_t image) {
  std::vector<PatchSight> out;
  for (const PatchSight& sight : stage.seen)
    if (sight.image == image) out.push_back(sight);
  std::stable_sort(out.begin(), out.end(), [](const PatchSight& a, const PatchSight& b) {
    return a.rms_grey < b.rms_grey;
  });
  return out;
}

/// The mean of the image's pixels that a panel's pixel stands for, lightened.
double pale_grey(const GreyImage& grey, const ResidualMap& map, int x, int y) {
  double sum = 0;
  for (int j = 0; j < map.shrink; ++j)
    for (int i = 0; i < map.shrink; ++i) {
      const int column = std::min(x * map.shrink / map.zoom + i, grey.width - 1);
      const int row = std::min(y * map.shrink / map.zoom + j, grey.height - 1);
      sum += grey.pixels[std::size_t(row) * std::size_t(grey.width) + std::size_t(column)];
    }
  return 64 + 0.7 * sum / (map.shrink * map.shrink);
}

/// A picture of the panel's size; the same before and after.
Image panel_image(const GreyImage& grey, const ResidualMap& map, int width, int height) {
  Image out(width, height, kPaper);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) out.set(x, y, grey_shade(pale_grey(grey, map, x, y)));
  return out;
}

std::string hexadecimal(Color c) {
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", unsigned(c.red), unsigned(c.green),
                unsigned(c.blue));
  return text;
}

/// The worst are drawn last.
void draw_panel(const std::string& png, const std::vector<PatchSight>& sights, double scale,
                const std::string& caption, double left, const ResidualMap& map, Drawing& out) {
  const double width = map.image.width, height = map.image.height;
  out.picture(left, map.top, width, height, png);
  out.rectangle(left, map.top, width, height, "fr");
  for (const PatchSight& sight : sights)
    out.raw("<circle cx=\"" + coordinate(left + map.placed(sight.x) + 0.5) + "\" cy=\"" +
            coordinate(map.top + map.placed(sight.y) + 0.5) + "\" r=\"" + coordinate(kRadius) +
            "\" fill=\"" + hexadecimal(size_shade(sight.rms_grey / scale)) + "\"/>");
  std::string words = caption + ": " + count_text(sights.size(), "patch", "patches");
  if (!sights.empty()) words += ", median " + number(sights[sights.size() / 2].rms_grey);
  out.text(left, map.top - 10, words, "b");
}

}  // namespace

double rms_scale(const PatchComparison& comparison) {
  std::vector<double> sizes;
  for (const PatchSight& sight : comparison.before.seen) sizes.push_back(sight.rms_grey);
  if (sizes.empty()) return kLeastScale;
  const auto at =
      sizes.begin() + static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(sizes.size() - 1));
  std::nth_element(sizes.begin(), at, sizes.end());
  return std::max(kLeastScale, std::ceil(*at));
}

Result<ResidualMap> draw_residual_map(const PatchComparison& comparison, const GreyImage& grey,
                                      std::uint32_t image, double scale) {
  ResidualMap map;
  map.zoom = std::max(1, kPanel / grey.width);
  map.shrink = map.zoom > 1 ? 1 : (grey.width + kMostPanel - 1) / kMostPanel;
  const int width = grey.width * map.zoom / map.shrink;
  const int height = grey.height * map.zoom / map.shrink;
  map.image = panel_image(grey, map, width, height);
  const Result<std::string> png = encode_png(map.image);
  if (!png.ok()) return png.error();
  map.left_before = kMargin, map.left_after = kMargin + width + kGap, map.top = kTop;
  const std::string title = "Image " + std::to_string(image) + ": residuals of its patches";
  Drawing out;
  out.text(kMargin, 44, title, "h");
  draw_panel(png.value(), sights_in(comparison.before, image), scale, "before", map.left_before,
             map, out);
  draw_panel(png.value(), sights_in(comparison.after, image), scale, "after", map.left_after, map,
             out);
  const Result<void> bar =
      draw_colour_bar(out, kMargin, kTop + height + 16, size_shade, 0, 1, "0",
                      number(scale) + " and more", "rms of a patch, grey levels");
  if (!bar.ok()) return bar.error();
  map.svg = svg_file(out, 2 * kMargin + 2 * width + kGap, kTop + height + kFoot, title);
  return map;
}

}  // namespace sheaf
