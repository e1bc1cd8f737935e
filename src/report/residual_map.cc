// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/residual_map.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "image/canvas.h"
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

void draw_panel(const GreyImage& grey, const std::vector<PatchSight>& sights, double scale,
                const std::string& caption, int left, int width, int height, ResidualMap& map) {
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      map.image.set(left + x, map.top + y, grey_shade(pale_grey(grey, map, x, y)));
  draw_frame(map.image, left, map.top, left + width, map.top + height, kFaint);
  for (const PatchSight& sight : sights)
    fill_circle(map.image, left + map.placed(sight.x), map.top + map.placed(sight.y), kRadius,
                size_shade(sight.rms_grey / scale));
  std::string words = caption + ": " + std::to_string(sights.size()) + " patches";
  if (!sights.empty()) words += ", median " + number(sights[sights.size() / 2].rms_grey);
  draw_text(map.image, left, map.top - 28, words, 2, kInk);
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

ResidualMap draw_residual_map(const PatchComparison& comparison, const GreyImage& grey,
                              std::uint32_t image, double scale) {
  ResidualMap map{Image(0, 0, kPaper)};
  map.zoom = std::max(1, kPanel / grey.width);
  map.shrink = map.zoom > 1 ? 1 : (grey.width + kMostPanel - 1) / kMostPanel;
  const int width = grey.width * map.zoom / map.shrink;
  const int height = grey.height * map.zoom / map.shrink;
  map.image = Image(2 * kMargin + 2 * width + kGap, kTop + height + kFoot, kPaper);
  map.left_before = kMargin, map.left_after = kMargin + width + kGap, map.top = kTop;
  draw_text(map.image, kMargin, 24, "image " + std::to_string(image) + ": residuals of its patches",
            3, kInk);
  draw_panel(grey, sights_in(comparison.before, image), scale, "before", map.left_before, width,
             height, map);
  draw_panel(grey, sights_in(comparison.after, image), scale, "after", map.left_after, width,
             height, map);
  draw_colour_bar(map.image, kMargin, kTop + height + 16, size_shade, 0, 1, "0",
                  number(scale) + " and more", "rms of a patch, grey levels");
  return map;
}

}  // namespace sheaf
