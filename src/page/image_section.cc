// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/image_section.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "chart/axis.h"
#include "chart/number_text.h"
#include "chart/plot.h"
#include "page/cell_map.h"
#include "page/html.h"

namespace sheaf {
namespace {

/// Cards' pictures are drawn in thousandths of an image's width.
constexpr double kCard = 1000;

struct CardVectors {
  std::string usual, off;  ///< paths
  double height = 0;
};

std::string whole(double x) { return std::to_string(std::lround(x)); }

/// A fair sample of an image's residuals: the picture of the whole, not of the worst.
CardVectors card_vectors(const PageScene& scene, std::size_t image, double scale) {
  constexpr std::uint64_t kMost = 280;
  constexpr double kLongest = 160;
  const ImageFrame& frame = scene.frames[image];
  const double unit = kCard / (2 * frame.half[0]);
  const std::uint64_t count = scene.observations(image);
  const std::uint64_t step = std::max<std::uint64_t>(1, (count + kMost - 1) / kMost);
  CardVectors out;
  out.height = kCard * frame.half[1] / frame.half[0];
  for (std::uint64_t k = scene.begin[image]; k < scene.begin[image + 1]; k += step) {
    const std::uint64_t o = scene.order[k];
    const double e = scene.after.length[o];
    if (!std::isfinite(e)) continue;
    const double drawn = e * scale * unit,
                 by = scale * unit * (drawn > kLongest ? kLongest / drawn : 1);
    std::string d = "M";
    for (std::size_t j = 0; j < 2; ++j)
      d += (j > 0 ? " " : "") +
           whole((scene.result.observation_xy[2 * o + j] - frame.middle[j] + frame.half[j]) * unit);
    d += "l" + whole(scene.after.x[o] * by) + " " + whole(scene.after.y[o] * by);
    (e > 4 * scene.sigma ? out.off : out.usual) += d;
  }
  return out;
}

std::string card(const PageScene& scene, std::uint32_t image, double scale, double proportion,
                 const Thumbnails& thumbnails) {
  const CardVectors vectors = card_vectors(scene, image, scale);
  const auto shown = thumbnails.find(image);
  const std::string number = std::to_string(image);
  std::string picture;
  if (shown != thumbnails.end())
    picture = "<img src=\"data:image/jpeg;base64," + shown->second + "\" alt=\"\" data-i=\"" +
              number + "\">";
  Drawing lines;
  lines.rectangle(2, 2, kCard - 4, vectors.height - 4, "fr");
  lines.path(vectors.usual, "w1");
  lines.path(vectors.off, "w2");
  return "<button class=\"card\" data-i=\"" + number +
         "\"><span class=\"pic\" style=\"aspect-ratio:1/" + script_number(proportion, 4) + "\">" +
         picture + "<svg viewBox=\"0 0 1000 " + whole(vectors.height) +
         "\" preserveAspectRatio=\"xMidYMid meet\" aria-hidden=\"true\">" + lines.content() +
         "</svg></span><span class=\"cap\"><b>" + escaped(scene.names[image]) + "</b><span>" +
         with_unit(scene.after.image_rms[image], "px") + "</span></span></button>";
}

std::string contact_sheet(const PageScene& scene, const Thumbnails& thumbnails) {
  std::size_t shown = scene.worst.size() <= 24 ? 18 : 12;
  if (scene.worst.size() <= shown + 6) shown = scene.worst.size();
  const double scale = vector_scale(scene);
  std::vector<float> ratios;
  for (const ImageFrame& frame : scene.frames)
    ratios.push_back(static_cast<float>(frame.half[1] / frame.half[0]));
  const double proportion = std::clamp(quantile(ratios, 0.5), 0.2, 3.0);
  std::string cards;
  for (std::size_t k = 0; k < shown; ++k)
    cards += card(scene, scene.worst[k], scale, proportion, thumbnails);
  const std::string title =
      "Residual vectors, " + (shown < scene.worst.size()
                                  ? "the worst " + std::to_string(shown) + " images"
                                  : std::string("the worst image first"));
  return part_heading(title, digits(scale, 2) +
                                 " times enlarged, on one scale; a sample of each image, accent: "
                                 "beyond four times the noise. Choose one for all of it.") +
         "<div class=\"sheet" + (proportion > 1.05 ? " tall" : "") + "\">" + cards + "</div>";
}

/// What the table's rows are drawn with.
struct Dumbbells {
  Axis axis;
  std::vector<double> ticks;
  static constexpr double kWide = 190;
};

Dumbbells dumbbells(const PageScene& scene) {
  std::vector<float> sizes;
  double low = 1e300, high = 0;
  for (const std::uint32_t i : scene.worst) {
    sizes.push_back(static_cast<float>(scene.after.image_rms[i]));
    for (const StateNumbers* state : {&scene.after, &scene.before})
      if (i < state->image_rms.size() && state->image_rms[i] > 0) {
        low = std::min(low, state->image_rms[i]);
        high = std::max(high, state->image_rms[i]);
      }
  }
  const double middle = quantile(sizes, 0.5);
  low = std::max(1e-12, std::min(0.9 * low, 0.5 * middle));
  high = std::max({1.1 * high, 2.5 * middle, 1.01 * low});
  Dumbbells out{{low, high, 6, Dumbbells::kWide - 6, true}, {}};
  for (const double tick : log_ticks(low, high))
    if (tick > 1.05 * low && tick < high / 1.05) out.ticks.push_back(tick);
  return out;
}

std::string small_svg(double height, const std::string& content) {
  const std::string size = "190\" height=\"" + coordinate(height) + "\"";
  return "<svg class=\"sp\" viewBox=\"0 0 190 " + coordinate(height) + "\" width=\"" + size +
         " aria-hidden=\"true\">" + content + "</svg>";
}

std::string dumbbell_head(const Dumbbells& bells) {
  Drawing out;
  for (const double tick : bells.ticks) {
    const double x = bells.axis(tick);
    const bool ends = x > Dumbbells::kWide - 18;
    out.text(ends ? Dumbbells::kWide : x, 12,
             digits(tick, 1) + (tick == bells.ticks.back() ? std::string(kThinSpace) + "px" : ""),
             "a", ends ? Anchor::end : Anchor::middle);
  }
  return small_svg(16, out.content());
}

std::string dumbbell(const Dumbbells& bells, double before, double after, bool off) {
  Drawing out;
  std::string grid;
  for (const double tick : bells.ticks) grid += "M" + coordinate(bells.axis(tick)) + " 0V22";
  out.path(grid, "gr");
  if (std::isfinite(before)) {
    out.path("M" + coordinate(bells.axis(before)) + " 11H" + coordinate(bells.axis(after)),
             "before");
    out.circle(bells.axis(before), 11, 3, "hb");
  }
  out.circle(bells.axis(after), 11, 3.6, off ? "dot" : "ha");
  return small_svg(22, out.content());
}

/// What the table says of an image beside its name and its dumbbell.
struct ImageRow {
  double before = 0, after = 0, median = 0, largest = 0, beyond = 0, covered = 0, turned = 0;
  double position_sigma = 0, rotation_sigma = 0;
  std::uint32_t linked = 0;
};

double turned_deg(const PageScene& scene, std::uint32_t image) {
  if (!scene.has_start || !scene.start_image[image]) return NAN;
  const Matrix3<double> turn = matrix_from_quaternion(scene.onto_result.rotation);
  const Matrix3<double>&A = scene.after.rotation[image], &B = scene.before.rotation[image];
  double trace = 0;  // of A (B turn^T)^T
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) {
      double moved = 0;
      for (std::size_t k = 0; k < 3; ++k) moved += B[3 * i + k] * turn[3 * j + k];
      trace += A[3 * i + j] * moved;
    }
  return std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0)) * 57.29577951308232;
}

double covered_share(const PageScene& scene, std::uint32_t image) {
  const CellMap map = cell_map(scene, scene.after, {image}, 8, 8, HUGE_VAL);
  std::size_t covered = 0;
  for (const std::uint64_t count : map.count) covered += count > 0;
  return double(covered) / 64;
}

ImageRow row_of(const PageScene& scene, std::uint32_t image) {
  ImageRow row;
  std::vector<float> lengths;
  std::uint64_t beyond = 0;
  for (std::uint64_t k = scene.begin[image]; k < scene.begin[image + 1]; ++k) {
    const float e = scene.after.length[scene.order[k]];
    if (!std::isfinite(e)) continue;
    lengths.push_back(e);
    row.largest = std::max(row.largest, double(e));
    beyond += e > 4 * scene.sigma;
  }
  row.beyond = 100 * double(beyond) / std::max(1.0, double(lengths.size()));
  row.median = quantile(lengths, 0.5);
  row.before = scene.has_start ? scene.before.image_rms[image] : NAN;
  row.after = scene.after.image_rms[image];
  row.covered = 100 * covered_share(scene, image);
  row.turned = turned_deg(scene, image);
  return row;
}

std::string cell(double x, int places, const char* classes = "") {
  return std::string("<td") + (*classes == '\0' ? "" : std::string(" class=\"") + classes + "\"") +
         ">" + decimals(x, places) + "</td>";
}

/// How well an image's place and turn are known: scene units and degrees, NaN where they are not.
std::array<double, 2> pose_sigmas(const Covariance& known, std::uint32_t image) {
  if (image >= known.poses.size() || image >= known.centres.size()) return {NAN, NAN};
  const auto& c = known.centres[image];
  const auto& p = known.poses[image];
  return {std::sqrt(c[0] + c[4] + c[8]), std::sqrt(p[21] + p[28] + p[35]) * 57.29577951308232};
}

std::string image_table(const PageScene& scene, const std::vector<std::uint32_t>& linked,
                        const Covariance* known) {
  const Dumbbells bells = dumbbells(scene);
  std::vector<float> sizes;
  for (const std::uint32_t i : scene.worst)
    sizes.push_back(static_cast<float>(scene.after.image_rms[i]));
  const double middle = quantile(sizes, 0.5);
  const bool start = scene.has_start;
  std::string body;
  for (const std::uint32_t i : scene.worst) {
    const ImageRow row = row_of(scene, i);
    body += "<tr><th scope=\"row\"><button data-i=\"" + std::to_string(i) + "\">" +
            escaped(scene.names[i]) + "</button></th><td>" +
            grouped(std::int64_t(scene.observations(i))) + "</td><td class=\"spc\">" +
            dumbbell(bells, row.before, row.after, row.after > 2 * middle) + "</td>";
    if (start) body += cell(row.before, 2, "bfc");
    body += cell(row.after, 2) + cell(row.median, 2) + cell(row.largest, 1) + cell(row.beyond, 1) +
            "<td>" + std::to_string(linked[i]) + "</td>" + cell(row.covered, 0);
    if (start) body += cell(row.turned, 2);
    if (known != nullptr)
      for (const double sigma : pose_sigmas(*known, i)) body += "<td>" + digits(sigma, 2) + "</td>";
    body += "</tr>";
  }
  const std::string head =
      "<tr><th>image</th><th>obs.</th><th class=\"spc\">" + dumbbell_head(bells) +
      "<span class=\"vh\">rms" + (start ? " before and after" : "") + "</span></th>" +
      (start ? "<th>rms before, px</th><th>rms after, px</th>" : "<th>rms, px</th>") +
      "<th>median, px</th><th>largest, px</th><th>beyond 4σ, %</th><th>linked images</th><th>cells "
      "covered, %</th>" +
      (start ? "<th>turned, °</th>" : "") +
      (known != nullptr ? "<th>σ of its place</th><th>σ of its turn, °</th>" : "") + "</tr>";
  const std::string table =
      scrolling("All images", "<table class=\"num im\"><thead>" + head + "</thead><tbody>" + body +
                                  "</tbody></table>");
  if (scene.worst.size() <= 24) return table;
  return "<details><summary>All " + count_text(scene.worst.size(), "image", "images") +
         " as a table</summary>" + table + "</details>";
}

}  // namespace

double vector_scale(const PageScene& scene) {
  std::vector<float> widths;
  for (const ImageFrame& frame : scene.frames) widths.push_back(static_cast<float>(frame.half[0]));
  const double scale = 0.06 * 2 * quantile(widths, 0.5) / std::max(1e-9, scene.after.q99);
  return scale > 0 ? round_below(scale) : 1;
}

std::string image_words(const PageScene& scene) {
  if (scene.worst.empty()) return "";
  std::vector<float> sizes;
  for (const std::uint32_t i : scene.worst)
    sizes.push_back(static_cast<float>(scene.after.image_rms[i]));
  const double least = *std::min_element(sizes.begin(), sizes.end()), middle = quantile(sizes, 0.5);
  const double most = *std::max_element(sizes.begin(), sizes.end());
  const auto above =
      std::count_if(sizes.begin(), sizes.end(), [&](float s) { return s > 2 * middle; });
  return "Between " + digits(least) + " and " + with_unit(most, "px") + " rms; " +
         (above == 0 ? "none" : grouped(above)) + " above twice the median.";
}

std::string neighbours_script(const PageScene& scene) {
  constexpr std::size_t kMost = 6;
  std::vector<std::vector<std::array<std::uint32_t, 2>>> links(scene.num_images());
  for (const Link& link : scene.links) {
    links[link.a].push_back({link.b, link.points});
    links[link.b].push_back({link.a, link.points});
  }
  std::string out = "[";
  for (std::size_t i = 0; i < links.size(); ++i) {
    std::stable_sort(links[i].begin(), links[i].end(),
                     [](const auto& x, const auto& y) { return x[1] > y[1]; });
    out += i > 0 ? ",[" : "[";
    for (std::size_t k = 0; k < std::min(kMost, links[i].size()); ++k)
      out += (k > 0 ? ",[" : "[") + std::to_string(links[i][k][0]) + "," +
             std::to_string(links[i][k][1]) + "]";
    out += "]";
  }
  return out + "]";
}

std::string image_section(const PageScene& scene, const Thumbnails& thumbnails,
                          const Covariance* known) {
  constexpr std::uint32_t kLinked = 20;
  constexpr std::size_t kMostRows = 2000;
  if (scene.worst.empty() || !(scene.sigma > 0)) return "";
  std::vector<std::uint32_t> linked(scene.num_images(), 0);
  for (const Link& link : scene.links) {
    linked[link.a] += link.points >= kLinked;
    linked[link.b] += link.points >= kLinked;
  }
  return contact_sheet(scene, thumbnails) +
         (scene.worst.size() <= kMostRows ? image_table(scene, linked, known) : "");
}

}  // namespace sheaf
