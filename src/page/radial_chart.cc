// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "chart/number_text.h"
#include "chart/plot.h"
#include "geometry/camera_model.h"
#include "page/html.h"
#include "page/residual_charts.h"

namespace sheaf {
namespace {

constexpr std::size_t kBins = 18;
constexpr std::uint64_t kFewest = 20;

/// What residuals are along and across the direction away from the principal point, by distance.
struct Profile {
  std::vector<double> radial, radial_error, tangential, rms, median;  ///< px; NaN of empty bins
};

struct Bin {
  std::uint64_t all = 0, kept = 0;
  double radial = 0, radial_square = 0, tangential = 0, square = 0;
  std::vector<float> lengths;
};

/// Distance of each measurement from the principal point of its image, px.
std::vector<float> distances(const PageScene& scene) {
  const Problem& p = scene.result;
  std::vector<float> out(p.num_observations());
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Camera& camera = p.cameras[p.image_camera[p.observation_image[i]]];
    const std::array<double, 2> middle = principal_point_of(camera);
    const double x = p.observation_xy[2 * i] - middle[0];
    const double y = p.observation_xy[2 * i + 1] - middle[1];
    out[i] = static_cast<float>(std::sqrt(x * x + y * y));
  }
  return out;
}

void add(const PageScene& scene, const StateNumbers& state, std::size_t i, double distance,
         double clip, Bin& bin) {
  const double e = state.length[i];
  if (!std::isfinite(e)) return;
  ++bin.all;
  bin.square += e * e;
  bin.lengths.push_back(state.length[i]);
  if (!(e < clip) || !(distance > 0)) return;
  const Problem& p = scene.result;
  const Camera& camera = p.cameras[p.image_camera[p.observation_image[i]]];
  const std::array<double, 2> middle = principal_point_of(camera);
  const double ux = (p.observation_xy[2 * i] - middle[0]) / distance;
  const double uy = (p.observation_xy[2 * i + 1] - middle[1]) / distance;
  const double radial = state.x[i] * ux + state.y[i] * uy;
  ++bin.kept;
  bin.radial += radial;
  bin.radial_square += radial * radial;
  bin.tangential += state.y[i] * ux - state.x[i] * uy;
}

Profile profile(const PageScene& scene, const StateNumbers& state, double clip,
                const std::vector<float>& distance, double reach) {
  std::vector<Bin> bins(kBins);
  for (std::size_t i = 0; i < distance.size(); ++i) {
    const double at = distance[i] / reach * double(kBins);
    if (at < double(kBins)) add(scene, state, i, distance[i], clip, bins[std::size_t(at)]);
  }
  Profile out;
  for (Bin& bin : bins) {
    const bool enough = bin.all >= kFewest && bin.kept > 1;
    const auto n = static_cast<double>(bin.kept);
    const double mean = bin.radial / n;
    out.radial.push_back(enough ? mean : NAN);
    out.radial_error.push_back(
        enough ? std::sqrt(std::max(0.0, bin.radial_square / n - mean * mean) / n) : NAN);
    out.tangential.push_back(enough ? bin.tangential / n : NAN);
    out.rms.push_back(enough ? std::sqrt(bin.square / double(bin.all)) : NAN);
    out.median.push_back(enough ? quantile(bin.lengths, 0.5) : NAN);
  }
  return out;
}

/// The bins that all profiles have something of.
std::vector<double> picked(const std::vector<double>& values,
                           const std::vector<std::size_t>& which) {
  std::vector<double> out;
  for (const std::size_t k : which) out.push_back(values[k]);
  return out;
}

struct Profiles {
  std::vector<double> x, radial, error, tangential, rms, median;  ///< of the result
  std::vector<double> start_radial, start_rms;                    ///< empty: no start
  double reach = 1;
};

std::string mean_plot(const PageScene& scene, const Profiles& of) {
  double high = 0.25 * scene.sigma;
  for (std::size_t k = 0; k < of.x.size(); ++k)
    high = std::max({high, std::abs(of.radial[k]) + 2 * of.error[k], std::abs(of.tangential[k])});
  high *= 1.15;
  Plot plot({0, of.reach}, {-high, high}, {.height = 150, .left = 48, .top = 20, .bottom = 8});
  plot.text(0, 10, "mean", "a");
  plot.axis_y(round_ticks(-high, high, 4), "px");
  double off = 0;
  if (!of.start_radial.empty()) {
    plot.raw(
        "<clipPath id=\"rc\"><rect x=\"48\" y=\"20\" width=\"304\" height=\"122\"/></clipPath>"
        "<g clip-path=\"url(#rc)\">");
    plot.line(of.x, of.start_radial, "before");
    plot.raw("</g>");
    for (const double r : of.start_radial) off = std::max(off, std::abs(r));
  }
  std::vector<double> low, up;
  for (std::size_t k = 0; k < of.x.size(); ++k) {
    low.push_back(of.radial[k] - 2 * of.error[k]);
    up.push_back(of.radial[k] + 2 * of.error[k]);
  }
  plot.band(of.x, low, up, "fill");
  plot.line(of.x, of.tangential, "model");
  plot.line(of.x, of.radial, "after");
  for (std::size_t k = 0; k < of.x.size(); ++k)
    if (std::abs(of.radial[k]) > std::max(4 * of.error[k], scene.sigma / 4))
      plot.circle(plot.x(of.x[k]), plot.y(of.radial[k]), 2.6, "dot");
  const std::size_t from = of.x.size() / 4, to = std::max(from + 1, of.x.size() - 1);
  std::size_t top = from, bottom = from;
  for (std::size_t k = from; k < to; ++k) {
    if (of.radial[k] > of.radial[top]) top = k;
    if (of.tangential[k] < of.tangential[bottom]) bottom = k;
  }
  plot.text(plot.x(of.x[top]), plot.y(up[top]) - 5, "radial", "t b", Anchor::middle);
  plot.text(plot.x(of.x[bottom]), plot.y(of.tangential[bottom]) + 14, "tangential", "t m",
            Anchor::middle);
  if (off > high)
    plot.text(plot.right(), 10, "radial before: up to " + with_unit(off, "px") + ", off this scale",
              "t bf", Anchor::end);
  return plot.content();
}

std::string size_plot(const PageScene& scene, const Profiles& of) {
  double low = of.median[0], high = of.rms[0];
  for (std::size_t k = 0; k < of.x.size(); ++k) {
    low = std::min(low, of.median[k]);
    high = std::max(high, of.rms[k]);
    if (!of.start_rms.empty()) high = std::max(high, of.start_rms[k]);
  }
  low = std::max(0.45 * low, 1e-3 * scene.sigma);
  high *= 1.5;
  Plot plot({0, of.reach}, {low, high, 0, 0, true}, {.height = 154, .left = 48, .top = 20});
  plot.text(0, 10, "size", "a");
  plot.axis_y(log_ticks(low, high), "px");
  plot.axis_x(round_ticks(0, of.reach), "px");
  if (!of.start_rms.empty()) plot.line(of.x, of.start_rms, "before");
  plot.line(of.x, of.rms, "after");
  plot.line(of.x, of.median, "model");
  const std::size_t k = of.x.size() / 2;
  const double at = plot.x(of.x[k]);
  const std::string when = scene.has_start ? " after" : "";
  if (!of.start_rms.empty())
    plot.text(at, plot.y(of.start_rms[k]) - 7, "rms before", "t bf", Anchor::middle);
  plot.text(at, plot.y(of.rms[k]) - 6, "rms" + when, "t b", Anchor::middle);
  plot.text(at, plot.y(of.median[k]) + 14, "median" + when, "t m", Anchor::middle);
  return plot.content();
}

}  // namespace

std::string radial_chart(const PageScene& scene) {
  const std::vector<float> distance = distances(scene);
  std::vector<float> sorted = distance;
  Profiles of;
  of.reach = std::max(1e-6, quantile(sorted, 0.998));
  const Profile after = profile(scene, scene.after, 10 * scene.sigma, distance, of.reach);
  const bool start = scene.has_start && scene.before.counted > 0 && !looks_same(scene);
  const Profile before =
      start ? profile(scene, scene.before, 10 * scene.before.median, distance, of.reach)
            : Profile();
  std::vector<std::size_t> known;
  for (std::size_t k = 0; k < kBins; ++k)
    if (std::isfinite(after.radial[k]) && (!start || std::isfinite(before.radial[k])))
      known.push_back(k);
  if (known.size() < 4) return "";
  for (const std::size_t k : known) of.x.push_back((double(k) + 0.5) * of.reach / double(kBins));
  of.radial = picked(after.radial, known);
  of.error = picked(after.radial_error, known);
  of.tangential = picked(after.tangential, known);
  of.rms = picked(after.rms, known);
  of.median = picked(after.median, known);
  if (start) {
    of.start_radial = picked(before.radial, known);
    of.start_rms = picked(before.rms, known);
  }
  Drawing out;
  out.raw(mean_plot(scene, of) + "<g transform=\"translate(0 152)\">" + size_plot(scene, of) +
          "</g>");
  return figure(
      "Radial profile",
      "by distance from the principal point; a wave in the mean is a term that the lens model "
      "lacks",
      out.svg(360, 306,
              "Mean and size of the residuals against the distance from the principal point"));
}

}  // namespace sheaf
