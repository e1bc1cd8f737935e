// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/cell_map.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "chart/axis.h"
#include "chart/number_text.h"
#include "chart/plot.h"
#include "page/html.h"
#include "page/residual_charts.h"

namespace sheaf {
namespace {

double length(const std::array<double, 2>& v) { return std::sqrt(v[0] * v[0] + v[1] * v[1]); }

/// A place that maps are drawn into, and how long one pixel's residual is there.
struct MapPlace {
  double width = 0, height = 0, scale = 1;
};

/// Lengths of the means that tell something.
std::vector<float> told(const CellMap& map) {
  std::vector<float> out;
  for (std::size_t k = 0; k < map.count.size(); ++k)
    if (map.count[k] >= CellMap::kFewest) out.push_back(static_cast<float>(length(map.mean[k])));
  return out;
}

std::string arrow(double x, double y, double dx, double dy) {
  const double l = std::sqrt(dx * dx + dy * dy);
  if (l <= 0.8) return "M" + coordinate(x - 0.4) + " " + coordinate(y) + "h.8";
  std::string d = "M" + coordinate(x - dx / 2) + " " + coordinate(y - dy / 2) + "l" +
                  coordinate(dx) + " " + coordinate(dy);
  if (l <= 2.2) return d;
  const double ux = dx / l, uy = dy / l, head = std::min(3.6, l / 2);
  const auto step = [&](char kind, double along, double across) {
    d += kind + coordinate((along * ux - across * uy) * head) + " " +
         coordinate((along * uy + across * ux) * head);
  };
  step('m', -0.9, 0.55);
  step('l', 0.9, -0.55);
  step('l', -0.9, -0.55);
  return d;
}

/// Grey: could be chance. Ink: is not. The accent: is not, and longer than half the noise.
void draw_arrows(Drawing& out, const CellMap& map, const MapPlace& place, double sigma,
                 bool plain) {
  std::string chance, systematic, strong;
  const double w = place.width / map.columns, h = place.height / map.rows;
  for (std::size_t k = 0; k < map.count.size(); ++k) {
    if (map.count[k] < CellMap::kFewest) continue;
    const auto column = static_cast<double>(k % std::size_t(map.columns));
    const auto row = static_cast<double>(k / std::size_t(map.columns));
    const double size = length(map.mean[k]);
    const double drawn = std::min(size * place.scale, 1.15 * std::min(w, h));
    const double by = size > 0 ? drawn / size : 0;
    const std::string d =
        arrow((column + 0.5) * w, (row + 0.5) * h, by * map.mean[k][0], by * map.mean[k][1]);
    (plain || !map.systematic(k) ? chance : size > sigma / 2 ? strong : systematic) += d;
  }
  out.path(chance, "vn");
  out.path(systematic, "vk");
  out.path(strong, "vs");
}

std::string key_arrow(double length) {
  return "M0 5h" + coordinate(length) + "m-4-2.5l4 2.5l-4 2.5";
}

constexpr const char* kKey =
    "<span class=\"nw kn\">→ may be chance</span>, <span class=\"nw kk\">→ is not</span> (4 "
    "standard errors), <span class=\"nw ks\">→ and above σ/2</span>";

std::string map_figure(const PageScene& scene, const CellMap& map, const MapPlace& place,
                       bool result, const std::string& note) {
  Drawing out;
  const double w = place.width, h = place.height;
  out.rectangle(0.5, 0.5, w - 1, h - 1, "fr");
  out.path("M" + coordinate(w / 2 - 4) + " " + coordinate(h / 2) + "h8m-4-4v8", "cr");
  draw_arrows(out, map, place, scene.sigma, !result);
  const double key = round_below(60 / place.scale);
  out.raw("<g transform=\"translate(0 " + coordinate(h + 10) + ")\">");
  out.path(key_arrow(key * place.scale), "vk");
  out.raw("</g>");
  out.text(key * place.scale + 7, h + 19, with_unit(key, "px", 1), "a");
  std::uint64_t all = 0, systematic = 0;
  for (std::size_t k = 0; k < map.count.size(); ++k) {
    all += map.count[k] >= CellMap::kFewest;
    systematic += map.systematic(k);
  }
  const std::string rms = with_unit(map.rms(), "px"),
                    cells = grouped(std::int64_t(systematic)) + " of " + grouped(std::int64_t(all));
  if (360 - w < 116) {
    out.text(w < 300 ? 360 : w, h + 19, "rms " + rms + "; " + cells + " cells not by chance", "a",
             Anchor::end);
  } else {
    double y = 14;
    for (const auto& [what, value] : {std::array{std::string("rms of the means"), rms},
                                      std::array{std::string("not by chance"), cells + " cells"}}) {
      out.text(w + 14, y, what, "a");
      out.text(w + 14, y + 15, value, "t b");
      y += 38;
    }
  }
  const std::string name = !scene.has_start ? "" : result ? ", after" : ", before";
  return figure("Mean residual per cell" + name, note,
                out.svg(360, h + 26, "Mean residual per cell of the image" + name));
}

/// Of all images: their frames' median proportions.
double proportion(const PageScene& scene) {
  std::vector<float> ratios;
  for (const ImageFrame& frame : scene.frames)
    ratios.push_back(static_cast<float>(frame.half[1] / frame.half[0]));
  return std::clamp(quantile(ratios, 0.5), 0.1, 10.0);
}

/// Images of one lens, the lens of the worst image first.
std::vector<std::vector<std::uint32_t>> images_by_lens(const PageScene& scene) {
  std::vector<std::vector<std::uint32_t>> lenses;
  std::vector<std::size_t> place(scene.result.cameras.size(), SIZE_MAX);
  for (const std::uint32_t i : scene.worst) {
    std::size_t& at = place[scene.result.image_camera[i]];
    if (at == SIZE_MAX) {
      at = lenses.size();
      lenses.emplace_back();
    }
    lenses[at].push_back(i);
  }
  return lenses;
}

std::string lens_name(const PageScene& scene, const std::vector<std::uint32_t>& images) {
  if (images.size() == 1) return scene.names[images[0]];
  const std::uint32_t lens = scene.result.image_camera[images[0]];
  const SceneMetadata* known = scene.result.metadata.get();
  const bool named = known != nullptr && lens < known->camera_ids.size();
  return "camera " + std::to_string(named ? known->camera_ids[lens] : lens) + ", " +
         count_text(images.size(), "image", "images");
}

}  // namespace

double CellMap::rms() const {
  double sum = 0;
  std::uint64_t cells = 0;
  for (std::size_t k = 0; k < count.size(); ++k)
    if (count[k] >= kFewest) {
      sum += mean[k][0] * mean[k][0] + mean[k][1] * mean[k][1];
      ++cells;
    }
  return cells > 0 ? std::sqrt(sum / double(cells)) : 0;
}

bool CellMap::systematic(std::size_t cell) const {
  return count[cell] >= kFewest && length(mean[cell]) > 4 * error[cell];
}

CellMap cell_map(const PageScene& scene, const StateNumbers& state,
                 const std::vector<std::uint32_t>& images, int columns, int rows, double clip_px) {
  const auto cells = std::size_t(columns) * std::size_t(rows);
  CellMap map{
      columns, rows, std::vector<std::uint64_t>(cells, 0), {}, std::vector<double>(cells, 0)};
  map.mean.assign(cells, {0, 0});
  for (const std::uint32_t i : images) {
    const ImageFrame& frame = scene.frames[i];
    for (std::uint64_t at = scene.begin[i]; at < scene.begin[i + 1]; ++at) {
      const std::uint64_t o = scene.order[at];
      if (!(state.length[o] < clip_px)) continue;
      std::array<int, 2> cell;
      for (std::size_t j = 0; j < 2; ++j) {
        const double part =
            ((scene.result.observation_xy[2 * o + j] - frame.middle[j]) / frame.half[j] + 1) / 2;
        cell[j] = static_cast<int>(std::clamp(part, 0.0, 0.999999) * (j == 0 ? columns : rows));
      }
      const auto k = std::size_t(cell[1]) * std::size_t(columns) + std::size_t(cell[0]);
      ++map.count[k];
      map.mean[k][0] += state.x[o];
      map.mean[k][1] += state.y[o];
      map.error[k] += double(state.length[o]) * state.length[o];
    }
  }
  for (std::size_t k = 0; k < cells; ++k) {
    if (map.count[k] == 0) continue;
    const auto n = double(map.count[k]);
    for (double& m : map.mean[k]) m /= n;
    const double m2 = map.mean[k][0] * map.mean[k][0] + map.mean[k][1] * map.mean[k][1];
    map.error[k] = std::sqrt(std::max(0.0, map.error[k] / n - m2) / 2 / n);
  }
  return map;
}

std::array<int, 2> cells_of(const ImageFrame& frame, int most) {
  const double ratio = std::clamp(frame.half[1] / frame.half[0], 0.1, 10.0);
  const int fewest = most / 3;
  if (ratio <= 1) return {most, std::max(fewest, static_cast<int>(std::lround(most * ratio)))};
  return {std::max(fewest, static_cast<int>(std::lround(most / ratio))), most};
}

std::string cell_charts(const PageScene& scene) {
  const double ratio = proportion(scene);
  const std::array<int, 2> cells = cells_of({{}, {1, ratio}}, 18);
  const int columns = cells[0], rows = cells[1];
  MapPlace place;
  place.height = ratio > 1.05 ? 280 : std::min(360 * ratio, 276.0);
  place.width = std::min(360.0, place.height / ratio);
  std::vector<std::uint32_t> all(scene.num_images());
  std::iota(all.begin(), all.end(), 0u);
  const auto scaled = [&](const CellMap& map) {
    std::vector<float> sizes = told(map);
    return place.width / columns * 1.25 / std::max(1e-9, quantile(sizes, 0.95));
  };
  const CellMap after = cell_map(scene, scene.after, all, columns, rows, 10 * scene.sigma);
  if (after.rms() == 0) return "";
  const std::string pooled = scene.result.cameras.size() > 1
                                 ? "all images on one another, whatever their lens"
                                 : "all images on one another";
  const double scale = scaled(after);
  std::string out, note = pooled + "; from measured to modelled. ";
  if (scene.has_start && scene.before.counted > 0 && !looks_same(scene)) {
    const CellMap before =
        cell_map(scene, scene.before, all, columns, rows, 10 * scene.before.median);
    place.scale = scaled(before);
    out += map_figure(scene, before, place, false, pooled + "; from measured to modelled");
    note = "drawn " + digits(scale / place.scale, 2) + " times longer than before. ";
  }
  place.scale = scale;
  return out + map_figure(scene, after, place, true, note + kKey);
}

std::string lens_maps(const PageScene& scene) {
  constexpr std::size_t kMost = 24;
  constexpr double kWide = 120, kTall = 92;
  const std::vector<std::vector<std::uint32_t>> lenses = images_by_lens(scene);
  if (lenses.size() < 2) return "";
  const std::size_t shown = std::min(kMost, lenses.size());
  std::vector<CellMap> maps;
  std::vector<float> sizes;
  for (std::size_t l = 0; l < shown; ++l) {
    const auto [columns, rows] = cells_of(scene.frames[lenses[l][0]], 9);
    maps.push_back(cell_map(scene, scene.after, lenses[l], columns, rows, 10 * scene.sigma));
    for (const float size : told(maps.back())) sizes.push_back(size);
  }
  const double typical = quantile(sizes, 0.95);
  if (!(typical > 0)) return "";
  const double scale = kWide / 9 * 1.2 / typical, key = round_below(30 / scale);
  std::string cards;
  for (std::size_t l = 0; l < shown; ++l) {
    const ImageFrame& frame = scene.frames[lenses[l][0]];
    const double ratio = std::clamp(frame.half[1] / frame.half[0], 0.1, 10.0);
    const double w = std::min(kWide, kTall / ratio);
    Drawing out;
    out.rectangle(0.5, 0.5, w - 1, w * ratio - 1, "fr");
    draw_arrows(out, maps[l], {w, w * ratio, scale}, scene.sigma, false);
    const std::string name = lens_name(scene, lenses[l]);
    cards += "<figure class=\"mini\">" + out.svg(kWide, kTall, "Mean residual per cell, " + name) +
             "<figcaption>" + escaped(name) + "</figcaption></figure>";
  }
  const std::string width = coordinate(key * scale + 2);
  const std::string note =
      std::string(scene.has_start ? "After, all" : "All") +
      " on one scale, <svg class=\"key\" width=\"" + width + "\" height=\"10\" viewBox=\"0 0 " +
      width + " 10\" aria-hidden=\"true\"><path d=\"" + key_arrow(key * scale) +
      "\" class=\"vk\"/></svg>" + with_unit(key, "px", 1) + "; the worst first." +
      (shown < lenses.size() ? " The worst " + std::to_string(shown) + " of " +
                                   grouped(std::int64_t(lenses.size())) + "."
                             : "");
  return part_heading("Mean residual per cell, lens by lens", note) + "<div class=\"minis\">" +
         cards + "</div>";
}

}  // namespace sheaf
