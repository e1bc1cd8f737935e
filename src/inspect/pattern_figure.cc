// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/pattern_figure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "chart/number_text.h"
#include "chart/svg_file.h"
#include "image/png.h"
#include "inspect/network_view.h"
#include "inspect/pattern.h"

namespace sheaf {
namespace {

constexpr int kPanel = 640, kGap = 60, kLeft = 90, kTop = 120, kLegend = 130;
constexpr int kCameraShare = kPanel * 3 / 10;  // of an axis that also holds the points
constexpr std::size_t kMostLinks = 6000;
constexpr std::uint16_t kWhite = 255;

/// From the lightest grey that is told from white (0) to the darkest (1).
std::uint16_t shade(double t) {
  return static_cast<std::uint16_t>(std::lround(214 - 191 * std::clamp(t, 0.0, 1.0)));
}

// Four decades below full, then the lightest.
std::uint16_t density_shade(double density) {
  return density > 0 ? shade(1 + std::log10(density) / 4) : kWhite;
}

std::uint16_t count_shade(double count, double largest) {
  if (count <= 0) return kWhite;
  return shade(largest > 1 ? std::log(count) / std::log(largest) : 1);
}

std::string whole(std::uint64_t n) { return grouped(static_cast<std::int64_t>(n)); }

/// A panel's place, with what is written around it.
struct Panel {
  Drawing& out;
  double x, y;

  void frame(const std::string& title, const std::string& subtitle) const {
    out.rectangle(x, y, kPanel, kPanel, "fr");
    out.text(x, y - 32, title, "b");
    out.text(x, y - 12, subtitle, "m");
  }
  void label_below(const std::string& text, int from, int to, int line = 0) const {
    out.text(x + (from + to) / 2.0, y + kPanel + 20 + 20 * line, text, "", Anchor::middle);
  }
  void label_left(const std::string& text, int from, int to) const {
    out.text_upwards(x - 12, y + (from + to) / 2.0, text, "", Anchor::middle);
  }
  /// Grey levels of a square of pixels, row by row. Errors: as encode_png.
  Result<void> pixels(std::vector<std::uint16_t> greys, int side) const {
    const Result<std::string> png = encode_png(Raster{side, side, 1, 8, std::move(greys)});
    if (!png.ok()) return png.error();
    out.picture(x, y, kPanel, kPanel, png.value());
    return {};
  }
};

std::string size_text(double entries) {
  return entries >= 100 ? whole(static_cast<std::uint64_t>(std::llround(entries)))
                        : digits(entries, 3);
}

/// What a pixel of the points' bands stands for.
std::string pixel_text(const PatternGrid& grid) {
  const auto size = [](const PatternAxis::Band& band) {
    return size_text(static_cast<double>(band.end - band.begin) / band.pixels);
  };
  return "a pixel (points): " + size(grid.rows().bands.back()) + " × " +
         size(grid.columns().bands.back());
}

Result<void> draw_grid(const Panel& panel, const PatternGrid& grid) {
  std::vector<std::uint16_t> greys;
  for (int y = 0; y < kPanel; ++y)
    for (int x = 0; x < kPanel; ++x) greys.push_back(density_shade(grid.density(y, x)));
  if (Result<void> drawn = panel.pixels(std::move(greys), kPanel); !drawn.ok()) return drawn;
  std::string rules;
  for (std::size_t k = 1; k < grid.columns().bands.size(); ++k)
    rules += "M" + coordinate(panel.x + grid.columns().bands[k].first_pixel) + " " +
             coordinate(panel.y) + "v" + std::to_string(kPanel);
  for (std::size_t k = 1; k < grid.rows().bands.size(); ++k)
    rules += "M" + coordinate(panel.x) + " " +
             coordinate(panel.y + grid.rows().bands[k].first_pixel) + "h" + std::to_string(kPanel);
  panel.out.path(rules, "rule");
  return {};
}

Result<void> draw_jacobian(const Panel& panel, const Problem& problem, const Tracks& tracks,
                           PatternCounts& counts) {
  const PatternGrid grid = jacobian_pattern(problem, tracks, kPanel, kPanel, kCameraShare);
  const PatternColumns columns(problem);
  counts.jacobian_rows = 2 * problem.num_observations();
  counts.jacobian_columns = columns.camera_side + columns.points;
  counts.reduced_columns = columns.camera_side;
  counts.jacobian_nonzeros = grid.nonzeros();
  panel.label_below("cameras", 0, kCameraShare);
  panel.label_below(whole(columns.camera_side), 0, kCameraShare, 1);
  panel.label_below("points " + whole(columns.points), kCameraShare, kPanel);
  panel.label_left("residuals, sorted by point", 0, kPanel);
  Result<void> drawn = draw_grid(panel, grid);
  panel.frame("Jacobian " + whole(counts.jacobian_rows) + " × " + whole(counts.jacobian_columns),
              whole(grid.nonzeros()) + " not zero; " + pixel_text(grid));
  return drawn;
}

Result<void> draw_hessian(const Panel& panel, const Problem& problem, const Tracks& tracks,
                          PatternCounts& counts) {
  const PatternGrid grid = hessian_pattern(problem, tracks, kPanel, kCameraShare);
  counts.hessian_nonzeros = grid.nonzeros();
  panel.label_below("cameras", 0, kCameraShare);
  panel.label_below("points", kCameraShare, kPanel);
  panel.label_left("points", kCameraShare, kPanel);
  panel.label_left("cameras", 0, kCameraShare);
  Result<void> drawn = draw_grid(panel, grid);
  panel.frame("Hessian JᵀJ, " + whole(counts.jacobian_columns) + " square",
              whole(grid.nonzeros()) + " not zero; " + pixel_text(grid));
  return drawn;
}

Result<void> draw_reduced(const Panel& panel, const ReducedPattern& reduced, std::uint64_t images,
                          const PatternCounts& counts) {
  const double largest = std::max<std::uint32_t>(reduced.strongest, 1);
  std::vector<std::uint16_t> greys;
  for (const std::uint32_t points : reduced.largest) greys.push_back(count_shade(points, largest));
  const std::uint64_t size = std::uint64_t(reduced.size), pooled = (images + size - 1) / size;
  panel.label_below("images 0 to " + whole(images - 1), 0, kPanel);
  panel.label_left("images", 0, kPanel);
  Result<void> drawn = panel.pixels(std::move(greys), reduced.size);
  panel.frame("Reduced camera matrix, " + whole(counts.reduced_columns) + " square",
              whole(reduced.links) + " pairs (" + percent(counts.fill, 3) + ")" +
                  (pooled > 1 ? "; a pixel: the most of " + whole(pooled) + " × " + whole(pooled)
                              : " of images share points"));
  return drawn;
}

/// Straight, or bent sideways by a part of its length, so that links of images on a line show.
std::string link_path(const std::array<double, 2>& a, const std::array<double, 2>& b, double bend) {
  const auto place = [](double x, double y) { return coordinate(x) + " " + coordinate(y); };
  std::string d = "M" + place(a[0], a[1]);
  if (bend > 0)
    d += "Q" +
         place((a[0] + b[0]) / 2 + bend * (b[1] - a[1]), (a[1] + b[1]) / 2 - bend * (b[0] - a[0])) +
         " ";
  else
    d += "L";
  return d + place(b[0], b[1]);
}

void draw_network(const Panel& panel, const NetworkView& view, const std::vector<Link>& links,
                  const ReducedPattern& reduced) {
  constexpr std::size_t kShades = 8;
  const auto place = [&](std::uint32_t image) {
    const auto& p = view.places[image];
    return std::array{panel.x + 20 + p[0] * (kPanel - 40),
                      panel.y + kPanel - 20 - p[1] * (kPanel - 40)};
  };
  // The weakest come first: strong links lie on top.
  std::array<std::string, kShades> paths;
  for (const Link& link : links) {
    const double strength = std::log1p(link.points) / std::log1p(reduced.strongest);
    paths[std::min(kShades - 1, static_cast<std::size_t>(strength * kShades))] +=
        link_path(place(link.a), place(link.b), view.aspect < 0.2 ? 0.8 : 0);
  }
  for (std::size_t k = 0; k < kShades; ++k) {
    if (paths[k].empty()) continue;
    panel.out.raw("<g opacity=\"" + digits(0.12 + 0.78 * double(k) / (kShades - 1), 2) + "\">");
    panel.out.path(paths[k], "link");
    panel.out.raw("</g>");
  }
  const double radius = view.places.size() > 400 ? 2 : 4;
  for (std::uint32_t j = 0; j < view.places.size(); ++j)
    panel.out.circle(place(j)[0], place(j)[1], radius, "ha");
  panel.frame("Network of " + whole(view.places.size()) + " images",
              links.size() == reduced.links ? whole(reduced.links) + " links: points in common"
                                            : "the " + whole(links.size()) + " strongest of " +
                                                  whole(reduced.links) + " links");
  panel.label_below(
      "camera centres in the plane of their widest spread" +
          (view.beyond > 0 ? "; " + whole(view.beyond) + " beyond, at the edge" : std::string()),
      0, kPanel);
}

Result<void> draw_bar(Drawing& out, double x, double y, const std::string& low,
                      const std::string& high, const std::string& what) {
  constexpr int kWidth = Drawing::kBarShades;
  std::vector<std::uint16_t> greys;
  for (int k = 0; k < kWidth; ++k) greys.push_back(shade(k / (kWidth - 1.0)));
  const Result<std::string> png = encode_png(Raster{kWidth, 1, 1, 8, std::move(greys)});
  if (!png.ok()) return png.error();
  out.shade_bar(x, y, png.value(), low, high, what);
  return {};
}

Result<void> draw_all(const Problem& problem, Drawing& out, PatternCounts& counts) {
  const int step = kPanel + kGap + kLeft + 20;
  const Tracks tracks = tracks_of(problem);
  std::vector<Link> links;
  const ReducedPattern reduced = reduced_pattern(problem, tracks, kPanel, kMostLinks, links);
  const double n = static_cast<double>(problem.num_images());
  counts.links = reduced.links;
  counts.strongest_link = reduced.strongest;
  counts.fill = n > 1 ? static_cast<double>(reduced.links) / (n * (n - 1) / 2) : 0;
  const double left = kLeft, right = kLeft + step, top = kTop + 20, below = top + kPanel + kTop;
  const double foot = below + kPanel + 60;
  draw_network({out, left, top}, widest_view(problem), links, reduced);
  for (const Result<void>& drawn :
       {draw_jacobian({out, right, top}, problem, tracks, counts),
        draw_hessian({out, left, below}, problem, tracks, counts),
        draw_reduced({out, right, below}, reduced, problem.num_images(), counts),
        draw_bar(out, left, foot, "1/10 000", "full", "part of a pixel’s entries that is not zero"),
        draw_bar(out, right, foot, "1", whole(reduced.strongest),
                 "points in common (white: none)")})
    if (!drawn.ok()) return drawn;
  return {};
}

}  // namespace

Result<PatternFigure> draw_patterns(const Problem& problem, const std::string& title) {
  if (problem.num_images() == 0 || problem.num_points() == 0 || problem.num_observations() == 0)
    return Error(ErrorCode::usage,
                 "a problem without images, points or observations has no pattern");
  PatternFigure figure;
  Drawing out;
  out.text(kLeft, 48, title, "h");
  if (const Result<void> drawn = draw_all(problem, out, figure.counts); !drawn.ok())
    return drawn.error();
  figure.svg = svg_file(out, kLeft + 2 * (kPanel + kGap + kLeft + 20),
                        kTop + 2 * (kPanel + kTop) + kLegend, title);
  return figure;
}

}  // namespace sheaf
