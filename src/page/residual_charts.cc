// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/residual_charts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "chart/number_text.h"
#include "chart/plot.h"
#include "page/html.h"

namespace sheaf {
namespace {

std::string px(double x) { return with_unit(x, "px"); }

std::vector<double> evenly(double low, double high, std::size_t count) {
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i)
    out.push_back(low + (high - low) * double(i) / double(count - 1));
  return out;
}

std::vector<double> evenly_in_log(double low, double high, std::size_t count) {
  std::vector<double> out = evenly(std::log(low), std::log(high), count);
  for (double& x : out) x = std::exp(x);
  return out;
}

/// Density of both components in units of 1 / sigma, between -reach and reach.
struct Histogram {
  std::vector<double> heights;
  double beyond = 0;  ///< the share that lies outside
};

Histogram histogram(const StateNumbers& state, double reach, std::size_t bins, double sigma) {
  Histogram out;
  std::vector<std::uint64_t> counts(bins, 0);
  std::uint64_t outside = 0;
  const double scale = double(bins) / (2 * reach);
  for (const std::vector<float>* values : {&state.x, &state.y})
    for (const float v : *values) {
      if (!std::isfinite(v)) continue;
      const double at = (v + reach) * scale;
      if (at >= 0 && at < double(bins))
        ++counts[std::size_t(at)];
      else
        ++outside;
    }
  const double all = std::max(1.0, 2 * double(state.counted));
  for (const std::uint64_t c : counts) out.heights.push_back(double(c) / all * scale * sigma);
  out.beyond = double(outside) / all;
  return out;
}

/// The component that nine in ten do not exceed.
double reach_of(const PageScene& scene) {
  const StateNumbers& state =
      scene.has_start && scene.before.counted > 0 ? scene.before : scene.after;
  std::vector<float> sizes;
  for (std::size_t i = 0; i < state.x.size(); ++i)
    if (std::isfinite(state.x[i])) {
      sizes.push_back(std::abs(state.x[i]));
      sizes.push_back(std::abs(state.y[i]));
    }
  return std::clamp(quantile(sizes, 0.9), 5 * scene.sigma, 9 * scene.sigma);
}

/// Heights of a histogram's steps at a place.
double height_at(const std::vector<double>& heights, double reach, double x) {
  const double at = (x + reach) / (2 * reach) * double(heights.size());
  return heights[std::size_t(std::clamp(at, 0.0, double(heights.size() - 1)))];
}

bool shows_start(const PageScene& scene) { return scene.has_start && scene.before.counted > 0; }

/// A share of residuals longer than each of the edges of bins that are even in the logarithm.
struct Tail {
  std::vector<double> length, share;
};

Tail tail_of(const StateNumbers& state, double low, double high) {
  constexpr double kBinsADecade = 40;
  const double scale = kBinsADecade / std::log(10.0);
  const auto bins = static_cast<std::size_t>(std::ceil(std::log(high / low) * scale)) + 1;
  std::vector<std::uint64_t> counts(bins + 1, 0);
  for (const float e : state.length) {
    if (!std::isfinite(e)) continue;
    const double at = e > low ? std::ceil(std::log(e / low) * scale) : 0;
    ++counts[std::size_t(std::min(at, double(bins)))];
  }
  Tail out;
  std::uint64_t longer = state.counted;
  for (std::size_t b = 0; b < bins; ++b) {
    longer -= counts[b];
    if (longer == 0) break;
    out.length.push_back(low * std::exp(double(b) / scale));
    out.share.push_back(double(longer) / double(state.counted));
  }
  return out;
}

/// Beside the line where it passes a share.
void label_line(Plot& plot, const Tail& tail, double share, const std::string& text,
                const std::string& classes, double width) {
  if (tail.length.empty()) return;
  std::size_t best = 0;
  for (std::size_t k = 1; k < tail.share.size(); ++k)
    if (std::abs(std::log(tail.share[k] / share)) < std::abs(std::log(tail.share[best] / share)))
      best = k;
  const double x = plot.x(tail.length[best]);
  const bool ends = x + 7 + 6.5 * double(text.size()) > width;
  plot.text(x + (ends ? -7 : 7), plot.y(tail.share[best]) - 3, text, classes,
            ends ? Anchor::end : Anchor::start);
}

std::string share_words(double share) {
  const int power = static_cast<int>(std::lround(std::log10(share)));
  if (power == 0) return "all";
  if (power >= -4) return percent(share, 1);
  return "1 in " + tick_text(std::pow(10.0, -power));
}

/// Squares of one density as one path each, darker where there is more.
void draw_density(Drawing& out, const std::vector<double>& density, std::size_t side, double x0,
                  double y0, double cell, double top, const std::string& more) {
  constexpr std::array<double, 6> kLevels = {0.012, 0.06, 0.16, 0.36, 0.65, 1e9};
  for (std::size_t level = 0; level + 1 < kLevels.size(); ++level) {
    std::string d;
    const auto in = [&](std::size_t x, std::size_t y) {
      const double v = density[y * side + x] / top;
      return v >= kLevels[level] && v < kLevels[level + 1];
    };
    for (std::size_t y = 0; y < side; ++y)
      for (std::size_t x = 0; x < side; ++x) {
        if (!in(x, y)) continue;
        std::size_t end = x;
        while (end < side && in(end, y)) ++end;
        const std::string width = coordinate(double(end - x) * cell), tall = coordinate(cell);
        d += "M" + coordinate(x0 + double(x) * cell) + " " + coordinate(y0 + double(y) * cell) +
             "h" + width + "v" + tall + "h-" + width + "z";
        x = end - 1;
      }
    out.path(d, "d" + std::to_string(level) + more);
  }
}

struct Density {
  std::vector<double> cells;
  double inside = 0;  ///< the share within the square
  double top = 0;
};

Density density_of(const StateNumbers& state, double reach, std::size_t side) {
  Density out;
  out.cells.assign(side * side, 0);
  std::uint64_t inside = 0;
  for (std::size_t i = 0; i < state.x.size(); ++i) {
    const double x = (state.x[i] / reach + 1) / 2 * double(side);
    const double y = (state.y[i] / reach + 1) / 2 * double(side);
    if (!(x >= 0 && x < double(side) && y >= 0 && y < double(side))) continue;
    out.cells[std::size_t(y) * side + std::size_t(x)] += 1;
    ++inside;
  }
  out.inside = double(inside) / std::max(1.0, double(state.counted));
  out.top = *std::max_element(out.cells.begin(), out.cells.end());
  return out;
}

/// 1.4826 times the median of |values|: sigma where they are normal.
double robust_sigma(const std::vector<float>& values) {
  std::vector<float> sizes;
  for (const float v : values)
    if (std::isfinite(v)) sizes.push_back(std::abs(v));
  return 1.4826 * quantile(sizes, 0.5);
}

}  // namespace

bool looks_same(const PageScene& scene) {
  return shows_start(scene) &&
         std::abs(scene.before.rms - scene.after.rms) <= 0.02 * scene.after.rms;
}

double share_beyond(const StateNumbers& state, double length_px) {
  std::uint64_t longer = 0;
  for (const float e : state.length) longer += e > length_px ? 1 : 0;
  return double(longer) / std::max(1.0, double(state.counted));
}

std::string distribution_chart(const PageScene& scene) {
  constexpr std::size_t kBins = 72;
  const double sigma = scene.sigma, reach = reach_of(scene);
  const bool start = shows_start(scene) && !looks_same(scene);
  const Histogram after = histogram(scene.after, reach, kBins, sigma);
  const Histogram before = start ? histogram(scene.before, reach, kBins, sigma) : Histogram();
  const std::vector<double> edges = evenly(-reach, reach, kBins + 1),
                            xs = evenly(-reach, reach, 121);
  std::vector<double> gauss;
  for (const double x : xs)
    gauss.push_back(std::exp(-0.5 * x * x / (sigma * sigma)) / std::sqrt(2 * std::numbers::pi));
  double top = 0.4;
  for (const double h : after.heights) top = std::max(top, h);
  for (const double h : before.heights) top = std::max(top, h);
  Plot plot({-reach, reach}, {0, 1.1 * top});
  plot.steps(edges, after.heights, "fill", true);
  plot.steps(edges, after.heights, "after");
  if (start) plot.steps(edges, before.heights, "before");
  plot.line(xs, gauss, "model");
  plot.axis_x(round_ticks(-reach, reach, 6), "px");
  const bool both = shows_start(scene) && !start;
  plot.text(plot.x(0.35 * sigma) + 9, plot.y(height_at(after.heights, reach, 0.35 * sigma)) + 2,
            both              ? "before and after"
            : scene.has_start ? "after"
                              : "residuals",
            "t b");
  plot.text(plot.x(1.2 * sigma) + 7, plot.y(0.3989 * std::exp(-0.72)), "Gaussian, σ " + px(sigma),
            "t m");
  if (start) {
    const auto from = before.heights.begin() + std::ptrdiff_t(0.86 * kBins);
    const double high = *std::max_element(from, before.heights.end());
    plot.text(plot.right(), std::min(plot.y(high) - 8, plot.bottom() - 12), "before", "t bf",
              Anchor::end);
  }
  plot.text(plot.left(), 20, "beyond ±" + px(reach), "a");
  if (start) plot.text(plot.left(), 35, "before " + percent(before.beyond), "t bf");
  plot.text(plot.left(), start ? 50 : 35, (start ? "after " : "") + percent(after.beyond), "t b");
  return figure("Distribution", "both components of every residual",
                plot.svg("Histogram of the residuals’ components, with a Gaussian"));
}

std::string tail_chart(const PageScene& scene) {
  const double sigma = scene.sigma, low = 0.1 * sigma;
  const bool start = shows_start(scene) && !looks_same(scene);
  double longest = scene.after.q99;
  for (const float e : scene.after.length)
    if (e > longest) longest = e;
  if (start) longest = std::max(longest, 3 * scene.before.q99);
  const double high = std::min(2.2 * std::max(longest, 4 * sigma), 1e5 * sigma);
  const double least = std::clamp(0.5 / double(scene.after.counted), 1e-7, 0.05);
  Plot plot({low, high, 0, 0, true}, {least, 1, 0, 0, true}, {.left = 46});
  plot.axis_y(decade_ticks(least, 1, 6), "", share_words);
  plot.axis_x(decade_ticks(low, high), "px");
  const Tail after = tail_of(scene.after, low, high);
  std::vector<double> x, noise, found;
  for (std::size_t k = 0; k < after.length.size(); ++k) {
    if (after.length[k] <= 2.5 * sigma) continue;
    x.push_back(after.length[k]);
    const double z = after.length[k] / sigma;
    noise.push_back(std::max(std::exp(-0.5 * z * z), least));
    found.push_back(std::max(after.share[k], noise.back()));
  }
  plot.band(x, noise, found, "lookfill");
  const Tail before = start ? tail_of(scene.before, low, high) : Tail();
  if (start) plot.line(before.length, before.share, "before");
  plot.line(after.length, after.share, "after");
  const std::vector<double> xs = evenly_in_log(low, sigma * std::sqrt(2 * std::log(1 / least)), 80);
  std::vector<double> rayleigh;
  for (const double l : xs) rayleigh.push_back(std::exp(-0.5 * l * l / (sigma * sigma)));
  plot.line(xs, rayleigh, "model");
  if (start) label_line(plot, before, 0.25, "before", "t bf", 360);
  label_line(plot, after, 6e-4,
             scene.has_start ? (start ? "after" : "before and after") : "residuals", "t b", 360);
  plot.text(plot.x(xs.back()) - 6, plot.bottom() - 8, "Gaussian", "t m", Anchor::end);
  const double q99 = scene.after.q99;
  plot.circle(plot.x(q99), plot.y(0.01), 3, "dot");
  const double label = std::min(plot.x(q99) + 8, 360.0 - 118);
  plot.text(label, plot.y(0.01) + (label < plot.x(q99) + 8 ? -7 : 4),
            "1" + std::string(kThinSpace) + "% beyond " + px(q99), "t at");
  return figure("Tail",
                "share of observations off by more than x; tinted: more than noise explains",
                plot.svg("Share of observations whose residual is longer than x"));
}

std::string direction_chart(const PageScene& scene) {
  constexpr std::size_t kCells = 41;
  constexpr double kSide = 172, kTop = 8, kWide = 360;
  const double reach = 4.2 * scene.sigma;
  const bool start = shows_start(scene) && !looks_same(scene);
  const Density after = density_of(scene.after, reach, kCells);
  const Density before = start ? density_of(scene.before, reach, kCells) : Density();
  const double top = std::max(1.0, after.top);
  Drawing out;
  for (const bool result : {false, true}) {
    if (!result && !start) continue;
    const StateNumbers& state = result ? scene.after : scene.before;
    const Density& density = result ? after : before;
    const double x0 = result && start ? kWide - kSide : 0, cx = x0 + kSide / 2,
                 cy = kTop + kSide / 2;
    draw_density(out, density.cells, kCells, x0, kTop, kSide / kCells, top, "");
    for (const double k : {1.0, 2.0, 3.0})
      out.circle(cx, cy, k * scene.sigma / reach * kSide / 2, "ri");
    out.path("M" + coordinate(x0) + " " + coordinate(cy) + "h172M" + coordinate(cx) + " 8v172",
             "gr");
    if (density.inside < 0.2)
      out.text(cx, kTop + 8,
               density.inside < 0.005 ? "nearly all lie outside"
                                      : percent(1 - density.inside) + " lie outside",
               "t m", Anchor::middle);
    if (result)
      for (const double k : {1.0, 3.0}) {
        const double at = k * scene.sigma / reach * kSide / 2 * 0.7071;
        out.text(cx + at + 2, cy - at - 2, tick_text(k) + "σ", "a");
      }
    if (scene.has_start)
      out.text(x0, kTop + kSide + 16, result ? (start ? "after" : "before and after") : "before",
               result ? "t b" : "t bf");
    out.text(
        x0, kTop + kSide + (scene.has_start ? 31 : 16),
        "σ " + digits(robust_sigma(state.x)) + " across, " + px(robust_sigma(state.y)) + " down",
        "a");
  }
  return figure("Direction", "residual vectors; round and centred if only noise is left",
                out.svg(kWide, 224, "Density of residual vectors"));
}

}  // namespace sheaf
