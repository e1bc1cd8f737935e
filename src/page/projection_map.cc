// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "page/projection_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "chart/number_text.h"
#include "chart/plot.h"
#include "page/html.h"

namespace sheaf {
namespace {

constexpr std::size_t kShades = 5;

/// Bounds between shades, even in the logarithm between what one in twenty stays below and what
/// one in twenty exceeds.
std::array<double, kShades - 1> bounds_of(std::vector<float> values) {
  const double low = quantile(values, 0.05), high = std::max(quantile(values, 0.95), low * 1.02);
  std::array<double, kShades - 1> bounds{};
  for (std::size_t k = 0; k + 1 < kShades; ++k)
    bounds[k] = low * std::pow(high / low, (double(k) + 1) / kShades);
  return bounds;
}

void add_legend(Drawing& out, const std::array<double, kShades - 1>& bounds, double x) {
  out.text(x, 10, "σ, px", "a");
  for (std::size_t k = 0; k < kShades; ++k) {
    const double y = 18 + 20 * double(kShades - 1 - k);
    out.rectangle(x, y, 14, 14, "d" + std::to_string(k));
    out.text(x + 21, y + 11, k == 0 ? "< " + digits(bounds[0], 3) : "≥ " + digits(bounds[k - 1], 3),
             "a");
  }
}

}  // namespace

std::string projection_chart(const PageScene& scene, std::uint32_t lens, const std::string& name,
                             const Covariance& known) {
  const Camera& camera = scene.result.cameras[lens];
  if (lens >= known.lens_motions.size() || known.lens_motions[lens].empty() ||
      camera.width_px == 0 || scene.has_bal_lenses)
    return "";
  const ProjectionGrid grid{31, 21, 0};
  const Result<ProjectionUncertainty> found =
      projection_uncertainty(camera, known.lens_motions[lens], grid);
  if (!found.ok()) return "";
  std::vector<float> values;
  for (std::size_t k = 0; k < found.value().pixels.size(); ++k) {
    const double sigma = found.value().worst_direction(k);
    if (std::isfinite(sigma) && sigma > 0) values.push_back(static_cast<float>(sigma));
  }
  if (values.size() < 20) return "";
  const double middle = quantile(values, 0.5),
               most = *std::max_element(values.begin(), values.end());
  const auto bounds = bounds_of(values);
  const double ratio = double(camera.height_px) / double(camera.width_px);
  const double wide = std::min(262.0, 224 / ratio), tall = wide * ratio;
  const double w = wide / (grid.columns - 1), h = tall / (grid.rows - 1);
  std::array<std::string, kShades> paths;
  for (std::uint32_t r = 0; r + 1 < grid.rows; ++r)
    for (std::uint32_t c = 0; c + 1 < grid.columns; ++c) {
      double sum = 0;
      for (const std::size_t k : {r * grid.columns + c, r * grid.columns + c + 1,
                                  (r + 1) * grid.columns + c, (r + 1) * grid.columns + c + 1})
        sum += found.value().worst_direction(k) / 4;
      if (!std::isfinite(sum)) continue;
      const auto shade = std::size_t(
          std::count_if(bounds.begin(), bounds.end(), [&](double b) { return sum >= b; }));
      paths[shade] += "M" + coordinate(c * w) + " " + coordinate(r * h) + "h" +
                      coordinate(w + 0.1) + "v" + coordinate(h + 0.1) + "h-" + coordinate(w + 0.1) +
                      "z";
    }
  Drawing out;
  for (std::size_t k = 0; k < kShades; ++k) out.path(paths[k], "d" + std::to_string(k));
  out.rectangle(0, 0, wide, tall, "mx");
  add_legend(out, bounds, wide + 18);
  out.text(wide + 18, 136, "median " + digits(middle), "a");
  out.text(wide + 18, 151, "at most " + digits(most), "a");
  return figure("Where " + name + " looks",
                "σ of the pixel of a place infinitely far away, as lens and poses vary together",
                out.svg(360, std::max(tall + 2, 160.0), "Projection uncertainty over the image"));
}

std::string correlation_chart(const PageScene& scene, std::uint32_t lens, const std::string& name,
                              const Covariance& known) {
  const std::vector<std::string_view> names = parameter_names(scene.result.cameras[lens].model);
  const std::size_t n = names.size();
  if (lens >= known.lenses.size() || known.lenses[lens].size() != n * n) return "";
  const std::vector<double>& C = known.lenses[lens];
  std::vector<std::size_t> free;
  for (std::size_t k = 0; k < n; ++k)
    if (C[k * n + k] > 0 && std::isfinite(C[k * n + k])) free.push_back(k);
  if (free.size() < 3) return "";
  const double cell = std::min(34.0, 240.0 / double(free.size())), left = 56;
  Drawing out;
  double strongest = 0;
  std::string pair;
  for (std::size_t r = 0; r < free.size(); ++r) {
    const double y = 20 + cell * double(r);
    out.text(left - 8, y + cell / 2 + 4, std::string(names[free[r]]), "a", Anchor::end);
    out.text(left + cell * (double(r) + 0.5), 12, std::string(names[free[r]]), "a", Anchor::middle);
    for (std::size_t c = 0; c < r; ++c) {
      const double rho =
          C[free[r] * n + free[c]] / std::sqrt(C[free[r] * n + free[r]] * C[free[c] * n + free[c]]);
      const double size = std::abs(rho), x = left + cell * double(c);
      const auto shade = static_cast<int>(std::min(4.0, std::floor(size * 5)));
      out.rectangle(x + 0.5, y + 0.5, cell - 1, cell - 1,
                    size > 0.99 ? "bat" : "d" + std::to_string(shade));
      if (cell > 24)
        out.text(x + cell / 2, y + cell / 2 + 4, decimals(rho, 2), size > 0.6 ? "a inv" : "a",
                 Anchor::middle);
      if (size > strongest) {
        strongest = size;
        pair = std::string(names[free[r]]) + " and " + std::string(names[free[c]]);
      }
    }
  }
  return figure(
      "Correlation of " + name,
      "strongest between " + escaped(pair) + ", " + decimals(strongest, 3) +
          "; above 0.99 two parameters can hardly be told apart",
      out.svg(360, 28 + cell * double(free.size()), "Correlations of the lens's parameters"));
}

}  // namespace sheaf
