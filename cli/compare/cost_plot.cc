// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "compare/cost_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace sheaf {
namespace {

// Okabe and Ito's palette, told apart with any kind of colour vision; dashes differ as well.
const char* const kColours[] = {"#000000", "#D55E00", "#0072B2", "#009E73",
                                "#CC79A7", "#E69F00", "#56B4E9"};
const char* const kDashes[] = {"", "7 3", "2 3", "10 3 2 3", "12 4", "4 2", "1 2"};
constexpr int kKinds = 7;
constexpr double kWidth = 960, kHeight = 480, kLeft = 84, kRight = 320, kTop = 48, kBottom = 56;
constexpr double kFloor = 1e-8;

struct Axis {
  double low, high;  ///< of the values
  double from, to;   ///< pixels
  double operator()(double value) const {
    const double share = std::log10(value / low) / std::log10(high / low);
    return from + std::clamp(share, 0.0, 1.0) * (to - from);
  }
};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else
      out += c;
  }
  return out;
}

std::string text(double x, double y, const std::string& anchor, const std::string& what) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\">{}</text>\n", x, y, anchor,
                     escaped(what));
}

// A power of ten each; where few fit, twice and five times as well.
std::vector<double> ticks(const Axis& axis) {
  const int first = static_cast<int>(std::floor(std::log10(axis.low)));
  const int last = static_cast<int>(std::ceil(std::log10(axis.high)));
  const std::vector<double> factors =
      last - first > 3 ? std::vector<double>{1} : std::vector<double>{1, 2, 5};
  std::vector<double> out;
  for (int e = first; e <= last; ++e)
    for (const double factor : factors) {
      const double value = factor * std::pow(10, e);
      if (value >= axis.low * 0.999 && value <= axis.high * 1.001) out.push_back(value);
    }
  return out;
}

std::string axes(const Axis& x, const Axis& y) {
  std::string out;
  for (const double value : ticks(x)) {
    out += fmt::format("<path d=\"M{0:.1f},{1:.1f}V{2:.1f}\" stroke=\"#ddd\"/>\n", x(value), y.to,
                       y.from);
    out += text(x(value), y.from + 18, "middle", fmt::format("{:g}", value));
  }
  for (const double value : ticks(y)) {
    out += fmt::format("<path d=\"M{0:.1f},{1:.1f}H{2:.1f}\" stroke=\"#ddd\"/>\n", x.from, y(value),
                       x.to);
    out += text(x.from - 8, y(value) + 4, "end", fmt::format("{:g}", value));
  }
  out += text((x.from + x.to) / 2, kHeight - 14, "middle", "seconds, set-up included");
  out += fmt::format(
      "<text transform=\"translate(18,{:.1f}) rotate(-90)\" text-anchor=\"middle\">cost / best "
      "cost - 1</text>\n",
      (y.from + y.to) / 2);
  return out;
}

double gap(double cost, double best) { return std::max(cost / best - 1, kFloor); }

std::string curve(const CostTrace& trace, double best, const Axis& x, const Axis& y, int kind) {
  std::string path, marks;
  for (const auto& [seconds, cost] : trace) {
    if (!std::isfinite(cost) || seconds <= 0) continue;
    const double a = x(seconds), b = y(gap(cost, best));
    path += fmt::format("{}{:.1f},{:.1f}", path.empty() ? "M" : "L", a, b);
    marks += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"{}\"/>\n", a, b,
                         kColours[kind]);
  }
  if (path.empty()) return "";
  return fmt::format(
             "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.8\" "
             "stroke-dasharray=\"{}\"/>\n",
             path, kColours[kind], kDashes[kind]) +
         marks;
}

std::string legend(const std::string& label, double y, int kind) {
  const double x = kWidth - kRight + 14;
  return fmt::format(
             "<path d=\"M{0:.1f},{1:.1f}h26\" stroke=\"{2}\" stroke-width=\"1.8\" "
             "stroke-dasharray=\"{3}\"/>\n<circle cx=\"{4:.1f}\" cy=\"{1:.1f}\" r=\"3\" "
             "fill=\"{2}\"/>\n",
             x, y, kColours[kind], kDashes[kind], x + 13) +
         text(x + 34, y + 4, "start", label);
}

}  // namespace

std::string cost_plot(const std::string& title,
                      const std::vector<std::pair<std::string, CostTrace>>& curves, double best) {
  double first = 1e300, last = 0, highest = 10 * kFloor;
  for (const auto& [label, trace] : curves)
    for (const auto& [seconds, cost] : trace) {
      if (!std::isfinite(cost) || seconds <= 0) continue;
      first = std::min(first, seconds);
      last = std::max(last, seconds);
      highest = std::max(highest, gap(cost, best));
    }
  if (last <= 0) first = 0.1, last = 1;
  const Axis x{first / 1.2, last * 1.2, kLeft, kWidth - kRight};
  const Axis y{kFloor / 1.5, highest * 1.6, kHeight - kBottom, kTop};
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\" font-family=\"sans-serif\" font-size=\"12\" fill=\"#222\">\n<rect "
      "width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n<text x=\"{2}\" y=\"24\" "
      "font-size=\"15\">{3}</text>\n",
      kWidth, kHeight, kLeft, escaped(title));
  out += axes(x, y);
  for (std::size_t k = curves.size(); k-- > 0;) {
    const int kind = static_cast<int>(k) % kKinds;
    out += curve(curves[k].second, best, x, y, kind);
    out += legend(curves[k].first, kTop + 12 + 22 * static_cast<double>(k), kind);
  }
  return out + "</svg>\n";
}

}  // namespace sheaf
