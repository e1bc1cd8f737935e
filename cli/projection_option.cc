// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "projection_option.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <tuple>

#include "outputs.h"
#include "report/projection_figure.h"
#include "terminal.h"

namespace sheaf {
namespace {

ProjectionGrid grid_of(const std::string& text) {
  constexpr std::uint32_t kMost = 2000;
  ProjectionGrid out;
  if (const auto sides = sides_of(text))
    std::tie(out.columns, out.rows) = *sides;
  else
    out.columns = 0;
  if (out.columns >= 2 && out.rows >= 2 && out.columns <= kMost && out.rows <= kMost) return out;
  throw Error(ErrorCode::usage,
              "--grid: found '" + text + "', expected COLUMNSxROWS, 2 to 2000 each, such as 60x40");
}

std::string distance_text(double distance) {
  return distance > 0 ? fmt::format("{:.6g} away", distance) : "infinitely far away";
}

/// What is finite of the worst direction over the image, ascending.
std::vector<double> sorted_sigmas(const ProjectionUncertainty& of) {
  std::vector<double> out;
  for (std::size_t k = 0; k < of.pixels.size(); ++k)
    if (const double s = of.worst_direction(k); std::isfinite(s)) out.push_back(s);
  std::sort(out.begin(), out.end());
  return out;
}
double quantile(const std::vector<double>& sorted, double q) {
  if (sorted.empty()) return std::numeric_limits<double>::quiet_NaN();
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

/// One name for each lens and distance where there are several: before the extension.
std::string numbered(const std::string& path, const LensProjection& of, bool several) {
  if (!several) return path;
  const std::size_t slash = path.rfind('/'), dot = path.rfind('.');
  const std::size_t end =
      dot == std::string::npos || (slash != std::string::npos && dot < slash) ? path.size() : dot;
  const char* const where = of.of.grid.distance > 0 ? "near" : "far";
  return fmt::format("{}-{}-{}{}", path.substr(0, end), of.camera, where, path.substr(end));
}

}  // namespace

std::optional<std::pair<std::uint32_t, std::uint32_t>> sides_of(const std::string& text) {
  std::pair<std::uint32_t, std::uint32_t> out;
  const char* end = text.data() + text.size();
  const auto [cross, wrong] = std::from_chars(text.data(), end, out.first);
  if (wrong != std::errc() || cross == end || *cross != 'x') return std::nullopt;
  const auto [last, bad] = std::from_chars(cross + 1, end, out.second);
  if (bad != std::errc() || last != end) return std::nullopt;
  return out;
}

std::vector<BoundOption> options_of(ProjectionArguments& a) {
  using F = FieldsOf<ProjectionArguments>;
  return bound<ProjectionArguments>(
      {F::text(&ProjectionArguments::csv,
               {.name = "projection",
                .placeholder = "FILE",
                .help = "how well a lens knows where it looks: CSV of sigmas of pixels of resting "
                        "places over the image"}),
       F::text(&ProjectionArguments::figure,
               {.name = "projection-figure",
                .placeholder = "FILE",
                .help = "the same as a picture (SVG), one for each lens and distance"}),
       F::real(&ProjectionArguments::distance,
               {.name = "distance",
                .unit = "scene units",
                .range = {.lowest = 0},
                .help = "of the places, besides infinitely far ones; 0: these alone"}),
       F::text(&ProjectionArguments::grid,
               {.name = "grid", .placeholder = "COLUMNSxROWS", .help = "of places on the image"})},
      a);
}

std::vector<LensProjection> projections(const ProjectionArguments& arguments,
                                        const Problem& problem, const Covariance& of) {
  std::vector<LensProjection> out;
  ProjectionGrid grid = grid_of(arguments.grid);
  for (std::uint32_t c = 0; c < of.lens_motions.size(); ++c) {
    if (of.lens_motions[c].empty()) continue;
    for (const double distance : {0.0, arguments.distance}) {
      if (distance == 0 && !out.empty() && out.back().camera == c) continue;
      grid.distance = distance;
      out.push_back(
          {c, projection_uncertainty(problem.cameras[c], of.lens_motions[c], grid).value()});
    }
  }
  return out;
}

std::string projection_csv(const std::vector<LensProjection>& all) {
  std::string out = "camera,distance,x_px,y_px,sigma_px,sigma_x_px,sigma_y_px,covariance_xy_px2\n";
  for (const LensProjection& lens : all)
    for (std::size_t k = 0; k < lens.of.pixels.size(); ++k) {
      const auto& [xx, xy, yy] = lens.of.covariance[k];
      const std::string distance =
          lens.of.grid.distance > 0 ? fmt::format("{}", lens.of.grid.distance) : "inf";
      out += fmt::format("{},{},{},{},{},{},{},{}\n", lens.camera, distance, lens.of.pixels[k][0],
                         lens.of.pixels[k][1], lens.of.worst_direction(k), std::sqrt(xx),
                         std::sqrt(yy), xy);
    }
  return out;
}

std::string projection_text(const std::vector<LensProjection>& all) {
  std::string out;
  for (const LensProjection& lens : all) {
    const std::vector<double> s = sorted_sigmas(lens.of);
    if (s.empty()) continue;
    out += fmt::format(
        "projection  camera {}, {}: sigma least {:.3g} px, median {:.3g}, largest {:.3g}\n",
        lens.camera, distance_text(lens.of.grid.distance), s.front(), quantile(s, 0.5), s.back());
  }
  return out;
}

Json projection_json(const std::vector<LensProjection>& all) {
  Json out = Json::array();
  for (const LensProjection& lens : all) {
    const std::vector<double> s = sorted_sigmas(lens.of);
    out.push_back({{"camera", lens.camera},
                   {"distance", lens.of.grid.distance > 0 ? Json(lens.of.grid.distance) : Json()},
                   {"columns", lens.of.grid.columns},
                   {"rows", lens.of.grid.rows},
                   {"sigma_px",
                    {{"min", number(quantile(s, 0))},
                     {"median", number(quantile(s, 0.5))},
                     {"max", number(quantile(s, 1))}}}});
  }
  return out;
}

void write_projections(const ProjectionArguments& arguments, const Problem& problem,
                       const std::vector<LensProjection>& all) {
  const auto write = [](const std::string& text, const std::string& path) {
    write_text(text, path);
    print_out("wrote       {}\n", path);
  };
  if (!arguments.csv.empty()) write(projection_csv(all), arguments.csv);
  if (arguments.figure.empty()) return;
  for (const LensProjection& lens : all) {
    const Camera& camera = problem.cameras[lens.camera];
    write(projection_figure(camera, lens.of,
                            fmt::format("Sigma of a pixel in its worst direction: camera {} ({}), "
                                        "places {}",
                                        lens.camera, to_string(camera.model),
                                        distance_text(lens.of.grid.distance))),
          numbered(arguments.figure, lens, all.size() > 1));
  }
}

}  // namespace sheaf
