// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/projection_figure.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "platform/real_text.h"
#include "report/palette.h"

namespace sheaf {
namespace {

constexpr double kWide = 720, kLeft = 16, kTop = 44, kBar = 150;

std::string colour(Color c) {
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", unsigned(c.red), unsigned(c.green),
                unsigned(c.blue));
  return text;
}
std::string at(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", x);
  return text;
}
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else if (static_cast<unsigned char>(c) >= 0x20)
      out += c;
  }
  return out;
}

/// The picture of one grid; lengths of the figure's own.
class Figure {
 public:
  Figure(const Camera& camera, const ProjectionUncertainty& of) : of_(of) {
    scale_ = kWide / static_cast<double>(camera.width_px);
    tall_ = scale_ * static_cast<double>(camera.height_px);
    for (std::size_t k = 0; k < of.pixels.size(); ++k) values_.push_back(of.worst_direction(k));
    for (const double x : values_)
      if (std::isfinite(x)) sorted_.push_back(x);
    std::sort(sorted_.begin(), sorted_.end());
    // The corners of a wide lens may know nothing: shades end where nine tenths of the nodes do.
    if (!sorted_.empty()) {
      low_ = sorted_.front();
      high_ = sorted_[(sorted_.size() - 1) * 9 / 10];
    }
    if (!(high_ > low_)) high_ = low_ + std::max(1e-12, std::abs(low_));
  }

  std::string draw(const std::string& title) const {
    const double width = kWide + 2 * kLeft + kBar, height = kTop + tall_ + kLeft;
    std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + at(width) +
                      "\" height=\"" + at(height) + "\" viewBox=\"0 0 " + at(width) + " " +
                      at(height) + "\" font-family=\"sans-serif\" font-size=\"13\" fill=\"" +
                      colour(kInk) + "\">\n<rect width=\"100%\" height=\"100%\" fill=\"" +
                      colour(kPaper) + "\"/>\n<text x=\"" + at(kLeft) +
                      "\" y=\"28\" font-size=\"16\">" + escaped(title) + "</text>\n";
    add_cells(out);
    for (const double level : levels()) add_line(level, out);
    out += "<rect x=\"" + at(kLeft) + "\" y=\"" + at(kTop) + "\" width=\"" + at(kWide) +
           "\" height=\"" + at(tall_) + "\" fill=\"none\" stroke=\"" + colour(kInk) + "\"/>\n";
    add_bar(out);
    return out + "</svg>\n";
  }

 private:
  std::size_t node(std::uint32_t row, std::uint32_t column) const {
    return std::size_t(row) * of_.grid.columns + column;
  }
  double x_of(std::size_t k) const { return kLeft + scale_ * of_.pixels[k][0]; }
  double y_of(std::size_t k) const { return kTop + scale_ * of_.pixels[k][1]; }
  Color shade(double value) const {
    return std::isfinite(value) ? size_shade(std::clamp((value - low_) / (high_ - low_), 0.0, 1.0))
                                : kRule;
  }

  void add_cells(std::string& out) const {
    out += "<g shape-rendering=\"crispEdges\">\n";
    for (std::uint32_t r = 0; r + 1 < of_.grid.rows; ++r)
      for (std::uint32_t c = 0; c + 1 < of_.grid.columns; ++c) {
        const std::size_t a = node(r, c), b = node(r + 1, c + 1);
        const double mean =
            (values_[a] + values_[node(r, c + 1)] + values_[node(r + 1, c)] + values_[b]) / 4;
        out += "<rect x=\"" + at(x_of(a)) + "\" y=\"" + at(y_of(a)) + "\" width=\"" +
               at(x_of(b) - x_of(a) + 0.1) + "\" height=\"" + at(y_of(b) - y_of(a) + 0.1) +
               "\" fill=\"" + colour(shade(mean)) + "\"/>\n";
      }
    out += "</g>\n";
  }

  /// Round values, four to nine of them between the ends of the shades.
  std::vector<double> levels() const {
    const double span = high_ - low_, unit = std::pow(10, std::floor(std::log10(span / 4)));
    double step = unit;
    for (const double by : {2.0, 5.0})
      if (span / (by * unit) >= 4) step = by * unit;
    std::vector<double> out;
    for (double level = step * std::ceil(low_ / step); level <= high_; level += step)
      if (level > low_) out.push_back(level);
    return out;
  }

  /// Where the level crosses each triangle of each cell; its value once, at the crossing that is
  /// lowest in the image.
  void add_line(double level, std::string& out) const {
    std::string path;
    double label_x = 0, label_y = -1;
    for (std::uint32_t r = 0; r + 1 < of_.grid.rows; ++r)
      for (std::uint32_t c = 0; c + 1 < of_.grid.columns; ++c) {
        const std::size_t a = node(r, c), b = node(r, c + 1), d = node(r + 1, c),
                          e = node(r + 1, c + 1);
        for (const auto& [p, q, s] : {std::array{a, b, d}, std::array{b, e, d}}) {
          std::vector<std::array<double, 2>> ends;
          for (const auto& [u, v] : {std::array{p, q}, std::array{q, s}, std::array{s, p}}) {
            const double from = values_[u], to = values_[v];
            if (!std::isfinite(from) || !std::isfinite(to) || (from < level) == (to < level))
              continue;
            const double t = (level - from) / (to - from);
            ends.push_back({x_of(u) + t * (x_of(v) - x_of(u)), y_of(u) + t * (y_of(v) - y_of(u))});
          }
          if (ends.size() != 2) continue;
          path += "M" + at(ends[0][0]) + " " + at(ends[0][1]) + "L" + at(ends[1][0]) + " " +
                  at(ends[1][1]);
          if (ends[0][1] > label_y) label_x = ends[0][0], label_y = ends[0][1];
        }
      }
    if (path.empty()) return;
    out += "<path d=\"" + path + "\" fill=\"none\" stroke=\"" + colour(kInk) +
           "\" stroke-width=\"1\"/>\n<text x=\"" +
           at(std::clamp(label_x, kLeft + 14, kLeft + kWide - 14)) + "\" y=\"" +
           at(std::min(label_y, kTop + tall_ - 4)) +
           "\" text-anchor=\"middle\" stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\">" +
           few_digits(level, 3) + "</text>\n";
  }

  void add_bar(std::string& out) const {
    constexpr int kSteps = 64;
    const double x = kLeft + kWide + 20, tall = std::min(tall_, 240.0);
    for (int k = 0; k < kSteps; ++k)
      out += "<rect x=\"" + at(x) + "\" y=\"" + at(kTop + tall * (kSteps - 1 - k) / kSteps) +
             "\" width=\"18\" height=\"" + at(tall / kSteps + 0.5) + "\" fill=\"" +
             colour(size_shade((k + 0.5) / kSteps)) + "\"/>\n";
    const auto say = [&](double y, const std::string& text) {
      out += "<text x=\"" + at(x + 26) + "\" y=\"" + at(y) + "\">" + text + "</text>\n";
    };
    say(kTop + 10, few_digits(high_, 3) + " px");
    say(kTop + tall, few_digits(low_, 3) + " px");
    if (!sorted_.empty() && sorted_.back() > high_)
      say(kTop + 28, "at most " + few_digits(sorted_.back(), 3));
  }

  const ProjectionUncertainty& of_;
  double scale_ = 1, tall_ = 0, low_ = 0, high_ = 0;
  std::vector<double> values_, sorted_;
};

}  // namespace

std::string projection_figure(const Camera& camera, const ProjectionUncertainty& of,
                              const std::string& title) {
  return Figure(camera, of).draw(title);
}

}  // namespace sheaf
