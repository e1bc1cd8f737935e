// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/photometric_section.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "chart/number_text.h"
#include "chart/plot.h"
#include "image/png.h"
#include "page/html.h"
#include "page/page_scene.h"
#include "page/thumbnails.h"
#include "report/palette.h"

namespace sheaf {
namespace {

constexpr double kPatch = 44;  ///< side of a drawn patch

std::vector<float> sizes_of(const PatchStage& stage) {
  std::vector<float> out;
  for (const PatchSight& sight : stage.seen)
    if (std::isfinite(sight.rms_grey)) out.push_back(static_cast<float>(sight.rms_grey));
  return out;
}

/// The pattern's pixels k as a picture; what the pattern lacks is paper.
std::string picture(const PatchScene& scene, const std::vector<double>& greys, double low,
                    double high) {
  Image image(scene.grid.width, scene.grid.rows, kPaper);
  for (std::size_t k = 0; k < greys.size(); ++k) {
    const std::uint32_t cell = scene.grid.place[k];
    const int x = static_cast<int>(std::lround(scene.grid.dx[cell])) - scene.grid.left;
    const int y = static_cast<int>(std::lround(scene.grid.dy[cell])) - scene.grid.top;
    image.set(x, y, grey_shade(255 * (greys[k] - low) / std::max(1.0, high - low)));
  }
  const Result<std::string> bytes = encode_png(image);
  return bytes.ok() ? bytes.value() : "";
}

void draw_picture(Drawing& out, double x, double y, const std::string& png) {
  out.picture(x, y, kPatch, kPatch, png);
}

std::vector<double> reference_of(const PatchScene& scene, std::uint32_t point) {
  std::vector<double> greys;
  for (const std::uint32_t cell : scene.grid.place)
    greys.push_back(scene.references[scene.grid.cells() * point + cell]);
  return greys;
}

/// A point: its reference, then what each image shows, the start above the result.
std::string strip(const PatchComparison& comparison, const PatchFit& fit) {
  constexpr std::size_t kMostImages = 8;
  const PatchScene& scene = comparison.scene;
  const std::vector<double> reference = reference_of(scene, fit.point);
  const auto [least, most] = std::minmax_element(reference.begin(), reference.end());
  const double middle = (*least + *most) / 2, half = std::max(16.0, 0.65 * (*most - *least));
  const double low = middle - half, high = middle + half;
  Drawing out;
  out.text(0, 14, "point " + std::to_string(fit.point), "t b");
  out.text(0, 40, "before " + digits(fit.before), "t bf");
  out.text(0, 88, "after " + digits(fit.after), "t b");
  draw_picture(out, 96, 44, picture(scene, reference, low, high));
  out.text(96, 14, "reference", "a");
  double x = 166;
  std::size_t shown = 0;
  for (std::uint32_t image = 0; image < scene.num_images() && shown < kMostImages; ++image) {
    const Sight sight{fit.point, image};
    const PatchGreys before = greys_of(scene, comparison.before, sight);
    const PatchGreys after = greys_of(scene, comparison.after, sight);
    if (before.grey.empty() && after.grey.empty()) continue;
    out.text(x, 14, "image " + std::to_string(image), "a");
    for (const bool result : {false, true}) {
      const PatchGreys& greys = result ? after : before;
      const double y = result ? 68 : 20;
      if (greys.grey.empty())
        out.rectangle(x, y, kPatch, kPatch, "mx");
      else
        draw_picture(out, x, y, picture(scene, greys.grey, low, high));
    }
    x += 56;
    ++shown;
  }
  // On a phone it scrolls by itself rather than shrink to nothing.
  const std::string label = "Patches of point " + std::to_string(fit.point);
  return "<div class=\"strip\">" + scrolling(label, out.svg(620, 118, label)) + "</div>";
}

std::string strips(const PhotometricPart& part) {
  constexpr std::size_t kRows = 4;
  const std::vector<PatchFit> fits = rank_patches(*part.comparison);
  const std::size_t rows = std::min(kRows, fits.size());
  std::string worst, middle;
  for (std::size_t k = 0; k < rows; ++k) {
    worst += strip(*part.comparison, fits[k]);
    middle += strip(*part.comparison, fits[(fits.size() - rows) / 2 + k]);
  }
  const std::string note =
      "what the images show, their brightness taken out, start above result; rms in grey levels";
  if (rows == 0) return "";
  return part_heading("The patches that fit worst", note) + "<div class=\"strips\">" + worst +
         "</div>" + part_heading("Patches in the middle", "half fit better, half worse") +
         "<div class=\"strips\">" + middle + "</div>";
}

std::string fit_chart(const PhotometricPart& part) {
  constexpr std::size_t kBins = 60;
  std::vector<float> before = sizes_of(part.comparison->before),
                     after = sizes_of(part.comparison->after);
  if (after.empty()) return "";
  const double high = std::max(1e-6, std::max(quantile(before, 0.95), quantile(after, 0.95)));
  std::vector<double> edges;
  for (std::size_t k = 0; k <= kBins; ++k) edges.push_back(high * double(k) / kBins);
  const auto heights = [&](const std::vector<float>& values) {
    std::vector<double> out(kBins, 0);
    for (const float v : values)
      if (v < high) out[std::size_t(v / high * kBins)] += 1.0 / double(values.size());
    return out;
  };
  const std::vector<double> a = heights(after), b = heights(before);
  const double top =
      std::max(*std::max_element(a.begin(), a.end()), *std::max_element(b.begin(), b.end()));
  Plot plot({0, high}, {0, 1.15 * top});
  plot.steps(edges, a, "fill", true);
  plot.steps(edges, b, "before");
  plot.steps(edges, a, "after");
  plot.axis_x(round_ticks(0, high), "grey levels");
  const auto name = [&](const std::vector<double>& h, const char* text, const char* classes) {
    const auto at = std::max_element(h.begin(), h.end()) - h.begin();
    plot.text(plot.x(edges[std::size_t(at)]) + 8, plot.y(h[std::size_t(at)]) - 4, text, classes);
  };
  if (!before.empty()) name(b, "before", "t bf");
  name(a, "after", "t b");
  return figure("Fit", "patches by the rms of their residuals",
                plot.svg("Histogram of the patches' residuals before and after"));
}

std::string brightness_table(const PhotometricPart& part) {
  if (part.brightness->empty()) return "";
  std::string body;
  for (std::size_t i = 0; i < part.brightness->size(); ++i)
    body += "<tr><th scope=\"row\">image " + std::to_string(i) + "</th><td>" +
            decimals((*part.brightness)[i].a, 4) + "</td><td>" +
            decimals((*part.brightness)[i].b, 2) + "</td></tr>";
  return "<figure><figcaption><b>Brightness</b> <span>an image is a times the reference plus b "
         "grey "
         "levels</span></figcaption>" +
         scrolling(
             "Brightness of the images",
             "<table "
             "class=\"num\"><thead><tr><th>image</th><th>a</th><th>b</th></tr></thead><tbody>" +
                 body + "</tbody></table>") +
         "</figure>";
}

/// A place as a dot of a path: a line of no length with round ends.
std::string dot(double x, double y) { return "M" + coordinate(x) + " " + coordinate(y) + "h0"; }

std::string map_of(const PhotometricPart& part, std::uint32_t image, double limit) {
  const GreyImage& grey = (*part.images)[image];
  std::array<std::string, 2> dots;
  std::array<std::vector<float>, 2> sizes;
  std::array<std::size_t, 2> stages{};
  for (const PatchStage* stage : {&part.comparison->before, &part.comparison->after}) {
    const bool result = stage == &part.comparison->after;
    for (const PatchSight& sight : stage->seen) {
      if (sight.image != image) continue;
      ++stages[result];
      sizes[result].push_back(static_cast<float>(sight.rms_grey));
      if (result) dots[sight.rms_grey > limit] += dot(sight.x, sight.y);
    }
  }
  Drawing out;
  const std::string width = std::to_string(grey.width), height = std::to_string(grey.height);
  out.raw("<image class=\"ph\" width=\"" + width + "\" height=\"" + height +
          "\" preserveAspectRatio=\"none\" href=\"data:image/jpeg;base64," + grey_thumbnail(grey) +
          "\"/>");
  out.path(dots[0], "pd");
  out.path(dots[1], "pd pl");
  const std::string words = sizes[1].empty() ? "no patch"
                                             : count_text(stages[1], "patch", "patches") +
                                                   ", median " + digits(quantile(sizes[0], 0.5)) +
                                                   " → " + digits(quantile(sizes[1], 0.5));
  return "<figure class=\"shot\">" +
         out.svg(grey.width, grey.height, "Residuals in image " + std::to_string(image)) +
         "<div class=\"cap\"><b>image " + std::to_string(image) + "</b><span>" + words +
         "</span></div></figure>";
}

std::string maps(const PhotometricPart& part) {
  constexpr std::size_t kMost = 12;
  std::vector<float> after = sizes_of(part.comparison->after);
  const double limit = 3 * quantile(after, 0.5);
  std::string shots;
  for (std::size_t i = 0; i < std::min(kMost, part.images->size()); ++i)
    shots += map_of(part, static_cast<std::uint32_t>(i), limit);
  return part_heading("Where patches fit", "result; a dot for each patch, accent: above " +
                                               digits(limit) +
                                               " grey levels, three times the median") +
         "<div class=\"shots\">" + shots + "</div>";
}

}  // namespace

std::string photometric_words(const PhotometricPart& part) {
  std::vector<float> before = sizes_of(part.comparison->before),
                     after = sizes_of(part.comparison->after);
  if (after.empty()) return "No patch is seen.";
  return count_text(after.size(), "patch", "patches") + " seen; the median one is off by " +
         digits(quantile(after, 0.5)) + " grey levels, before by " + digits(quantile(before, 0.5)) +
         ".";
}

std::string photometric_section(const PhotometricPart& part) {
  return "<div class=\"grid\">" + fit_chart(part) + brightness_table(part) + "</div>" +
         strips(part) + maps(part);
}

}  // namespace sheaf
