// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "chart/axis.h"

namespace sheaf {

/// Where a text stands to its place.
enum class Anchor { start, middle, end };

/// Pieces of SVG. Colours and strokes are classes, which the page's style gives meanings: `after`,
/// `before`, `model`, `look`; so light, dark and print need no second drawing.
class Drawing {
 public:
  void raw(const std::string& svg) { out_ += svg; }
  /// An empty path is not drawn.
  void path(const std::string& d, const std::string& classes);
  void circle(double x, double y, double radius, const std::string& classes);
  void rectangle(double x, double y, double width, double height, const std::string& classes);
  /// The text is escaped here.
  void text(double x, double y, const std::string& text, const std::string& classes,
            Anchor anchor = Anchor::start);
  /// Upwards, as beside a vertical axis; (x, y) is on the letters' line.
  void text_upwards(double x, double y, const std::string& text, const std::string& classes,
                    Anchor anchor = Anchor::start);
  /// The pixels of a PNG file, stretched to this place.
  void picture(double x, double y, double width, double height, const std::string& png);
  /// A bar of shades, a PNG of one row of kBarShades pixels, between the labels of its two ends
  /// with what it shows above; (x, y) is its top left corner, text included.
  static constexpr int kBarShades = 320;
  void shade_bar(double x, double y, const std::string& png, const std::string& low,
                 const std::string& high, const std::string& what);
  const std::string& content() const { return out_; }
  /// As an image of this size, whose label is read where it cannot be seen; scales to its place.
  std::string svg(double width, double height, const std::string& label) const;

 private:
  std::string out_;
};

/// "M x y", "L x y" ...: a line through places of a drawing.
std::string polyline(const std::vector<double>& x, const std::vector<double>& y);

/// Lengths of a drawing that holds one chart, margins for the axes included.
struct PlotFrame {
  double width = 360, height = 224;
  double left = 8, right = 8, top = 12, bottom = 34;
};

/// A chart: values on two axes.
class Plot : public Drawing {
 public:
  using Words = std::function<std::string(double)>;

  /// x and y: the ends of their values; `from` and `to` are set here.
  Plot(Axis x, Axis y, const PlotFrame& frame = {});

  double x(double value) const { return x_(value); }
  double y(double value) const { return y_(value); }
  double left() const { return x_.from; }
  double right() const { return x_.to; }
  double top() const { return y_.to; }
  double bottom() const { return y_.from; }

  void line(const std::vector<double>& x, const std::vector<double>& y, const std::string& classes);
  /// A histogram's outline over edges (one more than heights); closed: down to the axis, to fill.
  void steps(const std::vector<double>& edges, const std::vector<double>& heights,
             const std::string& classes, bool closed = false);
  /// Between two lines, held within the frame.
  void band(const std::vector<double>& x, const std::vector<double>& low,
            const std::vector<double>& high, const std::string& classes);
  /// The unit stands behind the last tick.
  void axis_x(const std::vector<double>& ticks, const std::string& unit = "",
              const Words& words = nullptr);
  void axis_y(const std::vector<double>& ticks, const std::string& unit = "",
              const Words& words = nullptr);
  std::string svg(const std::string& label) const {
    return Drawing::svg(frame_.width, frame_.height, label);
  }

 private:
  PlotFrame frame_;
  Axis x_, y_;
};

}  // namespace sheaf
