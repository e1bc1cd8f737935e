// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/pattern_figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "image/canvas.h"
#include "inspect/network_view.h"
#include "inspect/pattern.h"

namespace sheaf {
namespace {

constexpr Color kWhite{255, 255, 255}, kBlack{20, 20, 20}, kGrey{110, 110, 110}, kRule{190, 60, 30};
constexpr int kPanel = 640, kGap = 60, kLeft = 90, kTop = 120, kLegend = 130;
constexpr int kCameraShare = kPanel * 3 / 10;  // of an axis that also holds the points
constexpr std::size_t kMostLinks = 6000;

/// From the lightest shade that is told from white (0) to the darkest (1).
Color shade(double t) {
  const double s = std::clamp(t, 0.0, 1.0);
  const auto mix = [&](double light, double dark) {
    return static_cast<std::uint8_t>(std::lround(light + s * (dark - light)));
  };
  return {mix(178, 8), mix(205, 29), mix(235, 88)};
}

// Four decades below full, then the lightest.
Color density_shade(double density) {
  return density > 0 ? shade(1 + std::log10(density) / 4) : kWhite;
}

Color count_shade(double count, double largest) {
  if (count <= 0) return kWhite;
  return shade(largest > 1 ? std::log(count) / std::log(largest) : 1);
}

std::string grouped(std::uint64_t n) {
  std::string digits = std::to_string(n);
  for (int at = static_cast<int>(digits.size()) - 3; at > 0; at -= 3)
    digits.insert(static_cast<std::size_t>(at), ",");
  return digits;
}

std::string percent(double part) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g%%", 100 * part);
  return text;
}

/// A panel's place, with what is written around it.
struct Panel {
  Image& image;
  int x, y;

  void frame(const std::string& title, const std::string& subtitle) const {
    draw_frame(image, x, y, x + kPanel, y + kPanel, kBlack);
    draw_text(image, x, y - 50, title, 2, kBlack);
    draw_text(image, x, y - 26, subtitle, 2, kGrey);
  }
  void label_below(const std::string& text, int from, int to, int line = 0) const {
    draw_text(image, x + (from + to - text_width(text, 2)) / 2, y + kPanel + 10 + 24 * line, text,
              2, kBlack);
  }
  void label_left(const std::string& text, int from, int to) const {
    draw_text_upwards(image, x - 28, y + (from + to + text_width(text, 2)) / 2, text, 2, kBlack);
  }
};

std::string size_text(double entries) {
  if (entries >= 100) return grouped(static_cast<std::uint64_t>(std::llround(entries)));
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", entries);
  return text;
}

/// What a pixel of the points' bands stands for.
std::string pixel_text(const PatternGrid& grid) {
  const auto size = [](const PatternAxis::Band& band) {
    return size_text(static_cast<double>(band.end - band.begin) / band.pixels);
  };
  return "pixel (points) " + size(grid.rows().bands.back()) + " x " +
         size(grid.columns().bands.back());
}

void draw_grid(const Panel& panel, const PatternGrid& grid) {
  for (int y = 0; y < grid.rows().pixels(); ++y)
    for (int x = 0; x < grid.columns().pixels(); ++x)
      panel.image.set(panel.x + x, panel.y + y, density_shade(grid.density(y, x)));
  for (std::size_t k = 1; k < grid.columns().bands.size(); ++k) {
    const int at = panel.x + grid.columns().bands[k].first_pixel;
    fill_rectangle(panel.image, at, panel.y, at + 1, panel.y + kPanel, kRule);
  }
  for (std::size_t k = 1; k < grid.rows().bands.size(); ++k) {
    const int at = panel.y + grid.rows().bands[k].first_pixel;
    fill_rectangle(panel.image, panel.x, at, panel.x + kPanel, at + 1, kRule);
  }
}

void draw_jacobian(const Panel& panel, const Problem& problem, const Tracks& tracks,
                   PatternCounts& counts) {
  const PatternGrid grid = jacobian_pattern(problem, tracks, kPanel, kPanel, kCameraShare);
  const PatternColumns columns(problem);
  counts.jacobian_rows = 2 * problem.num_observations();
  counts.jacobian_columns = columns.camera_side + columns.points;
  counts.reduced_columns = columns.camera_side;
  counts.jacobian_nonzeros = grid.nonzeros();
  draw_grid(panel, grid);
  panel.frame(
      "Jacobian " + grouped(counts.jacobian_rows) + " x " + grouped(counts.jacobian_columns),
      grouped(grid.nonzeros()) + " nonzeros; " + pixel_text(grid));
  panel.label_below("cameras", 0, kCameraShare);
  panel.label_below(grouped(columns.camera_side), 0, kCameraShare, 1);
  panel.label_below("points " + grouped(columns.points), kCameraShare, kPanel);
  panel.label_left("residuals, sorted by point", 0, kPanel);
}

void draw_hessian(const Panel& panel, const Problem& problem, const Tracks& tracks,
                  PatternCounts& counts) {
  const PatternGrid grid = hessian_pattern(problem, tracks, kPanel, kCameraShare);
  counts.hessian_nonzeros = grid.nonzeros();
  draw_grid(panel, grid);
  panel.frame("Hessian J'J " + grouped(counts.jacobian_columns) + " square",
              grouped(grid.nonzeros()) + " nonzeros; " + pixel_text(grid));
  panel.label_below("cameras", 0, kCameraShare);
  panel.label_below("points", kCameraShare, kPanel);
  panel.label_left("points", kCameraShare, kPanel);
  panel.label_left("cameras", 0, kCameraShare);
}

void draw_reduced(const Panel& panel, const ReducedPattern& reduced, std::uint64_t images,
                  const PatternCounts& counts) {
  const double largest = std::max<std::uint32_t>(reduced.strongest, 1);
  for (int y = 0; y < kPanel; ++y)
    for (int x = 0; x < kPanel; ++x) {
      const int row = y * reduced.size / kPanel, column = x * reduced.size / kPanel;
      const double points =
          reduced.largest[std::size_t(row) * std::size_t(reduced.size) + std::size_t(column)];
      panel.image.set(panel.x + x, panel.y + y, count_shade(points, largest));
    }
  const std::uint64_t size = std::uint64_t(reduced.size), pooled = (images + size - 1) / size;
  panel.frame(
      "Reduced camera matrix " + grouped(counts.reduced_columns) + " square",
      grouped(reduced.links) + " pairs (" + percent(counts.fill) + ")" +
          (pooled > 1 ? "; a pixel: the most of " + grouped(pooled) + " x " + grouped(pooled)
                      : " of images share points"));
  panel.label_below("images 0 to " + grouped(images - 1), 0, kPanel);
  panel.label_left("images", 0, kPanel);
}

// Straight, or bent sideways by a part of its length, so that links of images on a line show.
void draw_link(Image& image, const std::array<double, 2>& a, const std::array<double, 2>& b,
               double bend, double strength) {
  const int pieces = bend > 0 ? 24 : 1;
  const double side_x = bend * (b[1] - a[1]), side_y = -bend * (b[0] - a[0]);
  std::array<double, 2> from = a;
  for (int k = 1; k <= pieces; ++k) {
    const double t = static_cast<double>(k) / pieces, bow = 2 * t * (1 - t);
    const std::array<double, 2> to = {a[0] + t * (b[0] - a[0]) + bow * side_x,
                                      a[1] + t * (b[1] - a[1]) + bow * side_y};
    draw_line(image, from[0], from[1], to[0], to[1], 1.3, shade(strength), 0.15 + 0.75 * strength);
    from = to;
  }
}

void draw_network(const Panel& panel, const NetworkView& view, const std::vector<Link>& links,
                  const ReducedPattern& reduced) {
  const auto place = [&](std::uint32_t image, bool along) {
    const auto& p = view.places[image];
    return along ? panel.x + 20 + p[0] * (kPanel - 40)
                 : panel.y + kPanel - 20 - p[1] * (kPanel - 40);
  };
  for (const Link& link : links) {
    const double strength = std::log1p(link.points) / std::log1p(reduced.strongest);
    draw_link(panel.image, {place(link.a, true), place(link.a, false)},
              {place(link.b, true), place(link.b, false)}, view.aspect < 0.2 ? 0.8 : 0, strength);
  }
  const double radius = view.places.size() > 400 ? 2 : 4;
  for (std::uint32_t j = 0; j < view.places.size(); ++j)
    fill_circle(panel.image, place(j, true), place(j, false), radius, kRule);
  panel.frame("Network of " + grouped(view.places.size()) + " images",
              links.size() == reduced.links ? grouped(reduced.links) + " links: points in common"
                                            : "the " + grouped(links.size()) + " strongest of " +
                                                  grouped(reduced.links) + " links");
  panel.label_below(
      "camera centres in the plane of their widest spread" +
          (view.beyond > 0 ? "; " + grouped(view.beyond) + " beyond, at the edge" : std::string()),
      0, kPanel);
}

void draw_bar(Image& image, int x, int y, const std::string& low, const std::string& high,
              const std::string& what) {
  constexpr int kWidth = 320;
  draw_text(image, x, y, what, 2, kBlack);
  for (int k = 0; k < kWidth; ++k)
    fill_rectangle(image, x + k, y + 28, x + k + 1, y + 48, shade(k / (kWidth - 1.0)));
  draw_text(image, x, y + 56, low, 2, kBlack);
  draw_text(image, x + kWidth - text_width(high, 2), y + 56, high, 2, kBlack);
}

}  // namespace

Result<PatternFigure> draw_patterns(const Problem& problem, const std::string& title) {
  if (problem.num_images() == 0 || problem.num_points() == 0 || problem.num_observations() == 0)
    return Error(ErrorCode::usage,
                 "a problem without images, points or observations has no pattern");
  const int step = kPanel + kGap + kLeft + 20;
  const int height = kTop + 2 * (kPanel + kTop) + kLegend;
  PatternFigure figure{Image(kLeft + 2 * step, height, kWhite), {}};
  Image& image = figure.image;
  const Tracks tracks = tracks_of(problem);
  std::vector<Link> links;
  const ReducedPattern reduced = reduced_pattern(problem, tracks, kPanel, kMostLinks, links);
  const double n = static_cast<double>(problem.num_images());
  figure.counts.links = reduced.links;
  figure.counts.strongest_link = reduced.strongest;
  figure.counts.fill = n > 1 ? static_cast<double>(reduced.links) / (n * (n - 1) / 2) : 0;

  draw_text(image, kLeft, 20, title, 3, kBlack);
  const int left = kLeft, right = kLeft + step, top = kTop + 20, below = top + kPanel + kTop;
  draw_jacobian({image, right, top}, problem, tracks, figure.counts);
  draw_hessian({image, left, below}, problem, tracks, figure.counts);
  draw_reduced({image, right, below}, reduced, problem.num_images(), figure.counts);
  draw_network({image, left, top}, widest_view(problem), links, reduced);
  const int foot = below + kPanel + 70;
  draw_bar(image, left, foot, "1/10,000", "full", "part of a pixel's entries that is not zero");
  draw_bar(image, right, foot, "1", grouped(reduced.strongest), "points in common (white: none)");
  return figure;
}

}  // namespace sheaf
