// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "chart/plot.h"

#include <algorithm>

#include "chart/number_text.h"
#include "platform/base64.h"

namespace sheaf {
namespace {

/// How far beyond its frame a line is drawn: far enough to leave the page's sight.
constexpr double kBeyond = 400;

std::string label_of(double tick, bool last, const std::string& unit, const Plot::Words& words) {
  const std::string text = words ? words(tick) : tick_text(tick);
  return last && !unit.empty() ? text + kThinSpace + unit : text;
}

std::string anchored(Anchor anchor) {
  return anchor == Anchor::start    ? ""
         : anchor == Anchor::middle ? " text-anchor=\"middle\""
                                    : " text-anchor=\"end\"";
}

}  // namespace

void Drawing::path(const std::string& d, const std::string& classes) {
  if (!d.empty()) out_ += "<path d=\"" + d + "\" class=\"" + classes + "\"/>";
}

void Drawing::circle(double x, double y, double radius, const std::string& classes) {
  out_ += "<circle cx=\"" + coordinate(x) + "\" cy=\"" + coordinate(y) + "\" r=\"" +
          coordinate(radius) + "\" class=\"" + classes + "\"/>";
}

void Drawing::rectangle(double x, double y, double width, double height,
                        const std::string& classes) {
  out_ += "<rect x=\"" + coordinate(x) + "\" y=\"" + coordinate(y) + "\" width=\"" +
          coordinate(width) + "\" height=\"" + coordinate(height) + "\" class=\"" + classes +
          "\"/>";
}

void Drawing::text(double x, double y, const std::string& text, const std::string& classes,
                   Anchor anchor) {
  out_ += "<text x=\"" + coordinate(x) + "\" y=\"" + coordinate(y) + "\" class=\"" + classes +
          "\"" + anchored(anchor) + ">" + escaped(text) + "</text>";
}

void Drawing::text_upwards(double x, double y, const std::string& text, const std::string& classes,
                           Anchor anchor) {
  out_ += "<text transform=\"translate(" + coordinate(x) + " " + coordinate(y) +
          ") rotate(-90)\" class=\"" + classes + "\"" + anchored(anchor) + ">" + escaped(text) +
          "</text>";
}

void Drawing::shade_bar(double x, double y, const std::string& png, const std::string& low,
                        const std::string& high, const std::string& what) {
  text(x, y + 14, what, "");
  picture(x, y + 24, kBarShades, 16, png);
  text(x, y + 58, low, "m");
  text(x + kBarShades, y + 58, high, "m", Anchor::end);
}

void Drawing::picture(double x, double y, double width, double height, const std::string& png) {
  out_ += "<image x=\"" + coordinate(x) + "\" y=\"" + coordinate(y) + "\" width=\"" +
          coordinate(width) + "\" height=\"" + coordinate(height) +
          "\" preserveAspectRatio=\"none\" href=\"data:image/png;base64," + base64(png) + "\"/>";
}

std::string Drawing::svg(double width, double height, const std::string& label) const {
  return "<svg viewBox=\"0 0 " + coordinate(width) + " " + coordinate(height) +
         "\" role=\"img\" aria-label=\"" + escaped(label) + "\">" + out_ + "</svg>";
}

std::string polyline(const std::vector<double>& x, const std::vector<double>& y) {
  std::string d;
  for (std::size_t i = 0; i < x.size(); ++i)
    d += (i == 0 ? "M" : "L") + coordinate(x[i]) + " " + coordinate(y[i]);
  return d;
}

Plot::Plot(Axis x, Axis y, const PlotFrame& frame) : frame_(frame), x_(x), y_(y) {
  if (!(x_.high > x_.low)) x_.high = x_.low + (x_.logarithmic ? x_.low : 1);
  if (!(y_.high > y_.low)) y_.high = y_.low + (y_.logarithmic ? y_.low : 1);
  x_.from = frame.left;
  x_.to = frame.width - frame.right;
  y_.from = frame.height - frame.bottom;
  y_.to = frame.top;
}

void Plot::line(const std::vector<double>& x, const std::vector<double>& y,
                const std::string& classes) {
  std::vector<double> u, v;
  for (std::size_t i = 0; i < x.size(); ++i) {
    u.push_back(std::clamp(this->x(x[i]), left() - kBeyond, right() + kBeyond));
    v.push_back(std::clamp(this->y(y[i]), top() - kBeyond, bottom() + kBeyond));
  }
  path(polyline(u, v), classes);
}

void Plot::steps(const std::vector<double>& edges, const std::vector<double>& heights,
                 const std::string& classes, bool closed) {
  std::string d;
  for (std::size_t i = 0; i < heights.size(); ++i) {
    const std::string level = coordinate(y(heights[i]));
    if (i == 0) d = "M" + coordinate(x(edges[0])) + " " + (closed ? coordinate(bottom()) : level);
    if (i > 0 || closed) d += "V" + level;
    d += "H" + coordinate(x(edges[i + 1]));
  }
  path(closed && !d.empty() ? d + "V" + coordinate(bottom()) + "Z" : d, classes);
}

void Plot::band(const std::vector<double>& x, const std::vector<double>& low,
                const std::vector<double>& high, const std::string& classes) {
  std::vector<double> u, v;
  const auto put = [&](double at, double value) {
    u.push_back(this->x(at));
    v.push_back(std::clamp(y(value), top(), bottom()));
  };
  for (std::size_t i = 0; i < x.size(); ++i) put(x[i], high[i]);
  for (std::size_t i = x.size(); i-- > 0;) put(x[i], low[i]);
  if (!u.empty()) path(polyline(u, v) + "Z", classes);
}

void Plot::axis_x(const std::vector<double>& ticks, const std::string& unit, const Words& words) {
  path("M" + coordinate(left()) + " " + coordinate(bottom()) + "H" + coordinate(right()), "ax");
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double at = x(ticks[i]);
    path("M" + coordinate(at) + " " + coordinate(bottom()) + "v4", "ax");
    const Anchor anchor = at > right() - 14                     ? Anchor::end
                          : at < left() + 3 && frame_.left < 12 ? Anchor::start
                                                                : Anchor::middle;
    text(at, bottom() + 17, label_of(ticks[i], i + 1 == ticks.size(), unit, words), "a", anchor);
  }
}

void Plot::axis_y(const std::vector<double>& ticks, const std::string& unit, const Words& words) {
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    const double at = y(ticks[i]);
    path("M" + coordinate(left()) + " " + coordinate(at) + "H" + coordinate(right()), "gr");
    text(left() - 6, at + 4, label_of(ticks[i], i + 1 == ticks.size(), unit, words), "a",
         Anchor::end);
  }
}

}  // namespace sheaf
