// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "chart/svg_file.h"

#include "chart/number_text.h"

namespace sheaf {
namespace {

// Of the page's style what files need, in its light colours.
constexpr const char* kStyle =
    "text{font:14px system-ui,-apple-system,\"Segoe UI\",sans-serif;fill:#17191c}"
    ".h{font-size:20px;font-weight:600}.b{font-weight:600}.a,.m{fill:#5f656d}"
    ".t{paint-order:stroke;stroke:#fff;stroke-width:3px;stroke-linejoin:round}"
    ".ax,.fr{fill:none;stroke:#5f656d}.gr,.mx{fill:none;stroke:#e2e4e7}"
    ".rule{fill:none;stroke:#92989f}.after{fill:none;stroke:#17191c;stroke-width:1.2}"
    ".link{fill:none;stroke:#17191c;stroke-width:1.2}.ha{fill:#17191c}"
    "image{image-rendering:pixelated}";

}  // namespace

std::string svg_file(const Drawing& drawing, double width, double height,
                     const std::string& title) {
  const std::string w = coordinate(width), h = coordinate(height);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" + w + "\" height=\"" + h +
         "\" viewBox=\"0 0 " + w + " " + h + "\" role=\"img\">\n<title>" + escaped(title) +
         "</title>\n<style>" + kStyle +
         "</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n" + drawing.content() +
         "\n</svg>\n";
}

}  // namespace sheaf
