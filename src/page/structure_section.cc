// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/structure_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "chart/number_text.h"
#include "chart/plot.h"
#include "inspect/clean.h"
#include "page/html.h"

namespace sheaf {
namespace {

constexpr std::size_t kShades = 5;

/// Bars of counts with their labels below and, where there is room, the counts above.
struct Bars {
  std::vector<std::string> labels;
  std::vector<std::uint64_t> counts;
  std::vector<const char*> classes;
};

std::string bar_chart(const std::string& title, const std::string& note, const Bars& bars) {
  const std::uint64_t top = *std::max_element(bars.counts.begin(), bars.counts.end());
  Plot plot({0, double(bars.counts.size())}, {0, 1.14 * double(top)}, {.top = 8});
  const double width = (plot.right() - plot.left()) / double(bars.counts.size());
  for (std::size_t k = 0; k < bars.counts.size(); ++k) {
    const double x = plot.left() + width * double(k), y = plot.y(double(bars.counts[k]));
    if (bars.counts[k] > 0)
      plot.rectangle(x + 1, y, width - 2, std::max(0.7, plot.bottom() - y), bars.classes[k]);
    plot.text(x + width / 2, plot.bottom() + 17, bars.labels[k], "a", Anchor::middle);
    if (bars.counts[k] > 0 && (width > 25 || bars.counts[k] == top))
      plot.text(x + width / 2, y - 5, grouped(std::int64_t(bars.counts[k])), "a", Anchor::middle);
  }
  plot.path("M" + coordinate(plot.left()) + " " + coordinate(plot.bottom()) + "H" +
                coordinate(plot.right()),
            "ax");
  return figure(title, note, plot.svg(title));
}

std::string track_chart(const PageScene& scene) {
  constexpr std::uint32_t kMost = 12;
  const std::uint32_t longest = *std::max_element(scene.track.begin(), scene.track.end());
  const std::uint32_t top = std::clamp(longest, 2u, kMost);
  Bars bars;
  const std::uint64_t once = std::uint64_t(std::count(scene.track.begin(), scene.track.end(), 1u));
  for (std::uint32_t length = once > 0 ? 1 : 2; length <= top; ++length) {
    const bool last = length == top;
    bars.labels.push_back(std::to_string(length) + (last && longest > top ? "+" : ""));
    bars.counts.push_back(
        std::uint64_t(std::count_if(scene.track.begin(), scene.track.end(), [&](std::uint32_t t) {
          return t == length || (last && t > length);
        })));
    bars.classes.push_back(length < 2 ? "bat" : length == 2 ? "ba2" : "ba");
  }
  return bar_chart("Track length",
                   "points by the number of images that see them; two cannot check one another",
                   bars);
}

std::string angle_chart(const PageScene& scene, int threads) {
  static constexpr std::array<double, 8> kEdges = {0.5, 1, 2, 4, 8, 16, 32, 64};
  static constexpr std::array<const char*, 9> kLabels = {"< ½",  "½–1",   "1–2",   "2–4", "4–8",
                                                         "8–16", "16–32", "32–64", "> 64"};
  Bars bars;
  bars.labels.assign(kLabels.begin(), kLabels.end());
  bars.counts.assign(kLabels.size(), 0);
  bars.classes.assign(kLabels.size(), "ba");
  bars.classes[0] = "bat";
  bars.classes[1] = "ba2";
  // Of many points a sample tells as much.
  constexpr std::size_t kMost = 200000;
  const std::size_t step = 1 + scene.num_points() / kMost;
  std::vector<bool> sampled(scene.result.num_observations());
  for (std::size_t i = 0; i < sampled.size(); ++i)
    sampled[i] = scene.result.observation_point[i] % step == 0;
  const std::vector<double> angles = ray_angles_deg(scene.result, sampled, threads);
  for (std::size_t p = 0; p < angles.size(); ++p) {
    if (p % step != 0 || scene.track[p] < 2 || !std::isfinite(angles[p])) continue;
    ++bars.counts[std::size_t(std::upper_bound(kEdges.begin(), kEdges.end(), angles[p]) -
                              kEdges.begin())];
  }
  if (*std::max_element(bars.counts.begin(), bars.counts.end()) == 0) return "";
  return bar_chart("Angle of rays",
                   "points by the widest angle at which two images see them, degrees; under 1° the "
                   "depth hardly counts",
                   bars);
}

/// Images by blocks, as many a side as a drawing takes; the most common points of any pair.
struct Blocks {
  std::size_t side = 0, step = 1;
  std::vector<std::uint32_t> most;
};

Blocks blocks_of(const PageScene& scene, std::size_t largest) {
  Blocks blocks;
  blocks.step = std::max<std::size_t>(1, (scene.num_images() + largest - 1) / largest);
  blocks.side = (scene.num_images() + blocks.step - 1) / blocks.step;
  blocks.most.assign(blocks.side * blocks.side, 0);
  for (const Link& link : scene.links) {
    const std::size_t a = link.a / blocks.step, b = link.b / blocks.step;
    for (const std::size_t k : {a * blocks.side + b, b * blocks.side + a})
      blocks.most[k] = std::max(blocks.most[k], link.points);
  }
  return blocks;
}

/// Round numbers, evenly spaced in the logarithm; the first is 1.
std::array<double, kShades> shade_bounds(const PageScene& scene) {
  std::vector<float> counts;
  for (const Link& link : scene.links) counts.push_back(static_cast<float>(link.points));
  const double low = std::max(1.0, quantile(counts, 0.05));
  const double high = std::max(low + 1, quantile(counts, 1));
  std::array<double, kShades> bounds{1};
  for (std::size_t k = 1; k < kShades; ++k) {
    const double at = low * std::pow(high / low, double(k) / kShades);
    const double unit = std::pow(10.0, std::floor(std::log10(at)) - 1);
    bounds[k] = std::max(bounds[k - 1] + 1, std::round(std::round(at / unit) * unit));
  }
  return bounds;
}

std::string covisibility_chart(const PageScene& scene) {
  constexpr double kSide = 224, kLeft = 34;
  if (scene.num_images() < 2 || scene.links.empty()) return "";
  const Blocks blocks = blocks_of(scene, 120);
  const auto bounds = shade_bounds(scene);
  const double cell = kSide / double(blocks.side);
  std::array<std::string, kShades> paths;
  for (std::size_t y = 0; y < blocks.side; ++y)
    for (std::size_t x = 0; x < blocks.side; ++x) {
      const double v = blocks.most[y * blocks.side + x];
      if (v < 1) continue;
      const auto shade =
          std::size_t(std::upper_bound(bounds.begin(), bounds.end(), v) - bounds.begin()) - 1;
      paths[shade] += "M" + coordinate(kLeft + double(x) * cell) + " " +
                      coordinate(double(y) * cell) + "h" + coordinate(cell + 0.05) + "v" +
                      coordinate(cell + 0.05) + "h-" + coordinate(cell + 0.05) + "z";
    }
  Drawing out;
  out.rectangle(kLeft, 0, kSide, kSide, "mx");
  for (std::size_t k = 0; k < kShades; ++k) out.path(paths[k], "d" + std::to_string(k));
  const std::size_t step = std::max<std::size_t>(1, (blocks.side + 7) / 8);
  for (std::size_t i = 0; i < blocks.side; i += step)
    out.text(kLeft - 6, (double(i) + 0.5) * cell + 4, std::to_string(i * blocks.step), "a",
             Anchor::end);
  const double x = kLeft + kSide + 18;
  out.text(x, 10, "points in", "a");
  out.text(x, 24, "common", "a");
  for (std::size_t k = kShades; k-- > 0;) {
    const double y = 36 + 20 * double(kShades - 1 - k);
    out.rectangle(x, y, 14, 14, "d" + std::to_string(k));
    out.text(x + 21, y + 11, "≥ " + grouped(std::int64_t(bounds[k])), "a");
  }
  const double pairs = double(scene.num_images()) * double(scene.num_images() - 1) / 2;
  out.text(x, 160, percent(double(scene.links.size()) / pairs) + " of", "a");
  out.text(x, 174, grouped(std::int64_t(pairs)) + " pairs", "a");
  return figure(
      "Co-visibility",
      "image by image, in the order of the file; the pattern of the reduced camera matrix",
      out.svg(360, kSide + 2, "Points that two images have in common"));
}

/// A matrix's non-zero entries on pixels, as horizontal runs in four shades.
void draw_pattern(Drawing& out, const PatternGrid& grid, double x0, double y0, double scale) {
  const int rows = grid.rows().pixels(), columns = grid.columns().pixels();
  std::array<std::string, 4> paths;
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns;) {
      const auto shade = [&](int column) {
        const double d = grid.density(r, column);
        return d <= 0 ? -1 : std::min(3, static_cast<int>(std::sqrt(d) * 4));
      };
      const int level = shade(c);
      int end = c + 1;
      while (end < columns && shade(end) == level) ++end;
      if (level >= 0)
        paths[std::size_t(level)] += "M" + coordinate(x0 + c * scale) + " " +
                                     coordinate(y0 + r * scale) + "h" +
                                     coordinate((end - c) * scale) + "v" + coordinate(scale) +
                                     "h-" + coordinate((end - c) * scale) + "z";
      c = end;
    }
  for (std::size_t k = 0; k < paths.size(); ++k) out.path(paths[k], "d" + std::to_string(k + 1));
  out.rectangle(x0, y0, columns * scale, rows * scale, "mx");
}

std::string pattern_charts(const PageScene& scene) {
  constexpr std::uint64_t kMost = 3000000;
  if (scene.result.num_observations() > kMost || scene.links.empty()) return "";
  const Tracks tracks = tracks_of(scene.result);
  const PatternGrid jacobian = jacobian_pattern(scene.result, tracks, 112, 112, 48);
  const PatternGrid hessian = hessian_pattern(scene.result, tracks, 112, 48);
  Drawing left, right;
  draw_pattern(left, jacobian, 0, 0, 2);
  draw_pattern(right, hessian, 0, 0, 2);
  const auto beside = [](Drawing& out, const char* what, std::uint64_t nonzeros) {
    out.text(238, 12, what, "a");
    out.text(238, 28, digits(double(nonzeros), 3), "t b");
    out.text(238, 43, "not zero", "a");
  };
  beside(left, "entries", jacobian.nonzeros());
  beside(right, "entries", hessian.nonzeros());
  return figure("Jacobian",
                "rows are observations by point; columns are images (left of the step) and points",
                left.svg(360, 226, "Pattern of the Jacobian")) +
         figure("Normal matrix",
                "images first, then points, whose part is block diagonal: what makes them cheap to "
                "eliminate",
                right.svg(360, 226, "Pattern of the normal matrix"));
}

}  // namespace

std::string structure_words(const PageScene& scene) {
  std::uint64_t seen = 0, twice = 0;
  for (const std::uint32_t t : scene.track) {
    seen += t > 0;
    twice += t == 2;
  }
  std::vector<float> counts;
  for (std::size_t i = 0; i < scene.num_images(); ++i)
    counts.push_back(static_cast<float>(scene.observations(i)));
  if (seen == 0) return "";
  return percent(double(twice) / double(seen)) +
         " of the points are seen by two images only; an image has " +
         grouped(std::int64_t(quantile(counts, 0.5))) + " observations in the median, " +
         grouped(std::int64_t(quantile(counts, 0))) + " at least.";
}

std::string structure_section(const PageScene& scene, int threads) {
  if (scene.num_points() == 0 || scene.order.empty()) return "";
  return "<div class=\"grid\">" + covisibility_chart(scene) + track_chart(scene) +
         angle_chart(scene, threads) + pattern_charts(scene) + "</div>";
}

}  // namespace sheaf
