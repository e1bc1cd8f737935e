// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance_document.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "geometry/rotation.h"
#include "io/csv_field.h"
#include "starts/sights.h"
#include "survey/image_names.h"

namespace sheaf {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr std::size_t kMostListed = 20;

template <std::size_t kCount>
std::array<double, 3> sigmas(const std::array<double, kCount>& C, std::size_t n,
                             std::size_t first = 0) {
  std::array<double, 3> out;
  for (std::size_t k = 0; k < 3; ++k) out[k] = std::sqrt(C[(n + 1) * (first + k)]);
  return out;
}

Json numbers(const std::array<double, 3>& of, double unit = 1) {
  Json out = Json::array();
  for (const double x : of) out.push_back(number(unit * x));
  return out;
}
template <class List>
Json all_of(const List& of) {
  Json out = Json::array();
  for (const double x : of) out.push_back(number(x));
  return out;
}

/// The length of three sigmas.
double length(const std::array<double, 3>& s) { return std::hypot(s[0], s[1], s[2]); }

std::vector<double> point_sigmas(const Covariance& of) {
  std::vector<double> out;
  for (const auto& C : of.points)
    if (const double s = length(sigmas(C, 3)); s > 0 && std::isfinite(s)) out.push_back(s);
  std::sort(out.begin(), out.end());
  return out;
}
double quantile(const std::vector<double>& sorted, double q) {
  if (sorted.empty()) return 0;
  return sorted[static_cast<std::size_t>(q * static_cast<double>(sorted.size() - 1))];
}

std::uint64_t id_of_point(const Problem& problem, std::size_t p) {
  const SceneMetadata* m = problem.metadata.get();
  return m != nullptr && !m->point_ids.empty() ? m->point_ids[p] : p;
}
std::size_t point_at(const CovarianceOptions& options, std::size_t k) {
  return options.point_ids.empty() ? k : options.point_ids[k];
}

std::uint32_t image_at(const CovarianceOptions& options, std::size_t k) {
  return options.image_ids.empty() ? static_cast<std::uint32_t>(k) : options.image_ids[k];
}

Json poses_json(const Problem& problem, const CovarianceOptions& options, const Covariance& of) {
  Json out = Json::array();
  for (std::size_t k = 0; k < of.poses.size(); ++k)
    out.push_back({{"image", image_name(problem.metadata.get(), image_at(options, k))},
                   {"center_sigma", numbers(sigmas(of.centres[k], 3))},
                   {"rotation_sigma_deg", numbers(sigmas(of.poses[k], 6, 3), kDegrees)},
                   {"covariance", all_of(of.poses[k])}});
  return out;
}

Json pairs_json(const Problem& problem, const CovarianceOptions& options, const Covariance& of) {
  Json out = Json::array();
  for (std::size_t k = 0; k < of.pairs.size(); ++k) {
    Json names = Json::array();
    for (const std::uint32_t image : options.image_pairs[k])
      names.push_back(image_name(problem.metadata.get(), image));
    out.push_back({{"images", names},
                   {"distance", number(of.distances[k].value)},
                   {"distance_sigma", number(of.distances[k].sigma)},
                   {"covariance", all_of(of.pairs[k])}});
  }
  return out;
}

Json moving_json(const std::vector<Covariance6>& all) {
  Json out = Json::array();
  for (const Covariance6& C : all)
    out.push_back({{"translation_sigma", numbers(sigmas(C, 6))},
                   {"rotation_sigma_deg", numbers(sigmas(C, 6, 3), kDegrees)},
                   {"covariance", all_of(C)}});
  return out;
}

/// Not a number where the lens was not asked for.
double sigma_of(const std::vector<double>& lens, std::size_t n, std::size_t p) {
  return lens.empty() ? std::numeric_limits<double>::quiet_NaN() : std::sqrt(lens[(n + 1) * p]);
}

Json cameras_json(const Problem& problem, const Covariance& of) {
  Json out = Json::array();
  for (std::size_t c = 0; c < of.lenses.size(); ++c) {
    const Camera& camera = problem.cameras[c];
    const auto names = parameter_names(camera.model);
    Json parameters = Json::array();
    for (std::size_t p = 0; p < names.size(); ++p)
      parameters.push_back({{"name", names[p]},
                            {"value", number(camera.parameters[p])},
                            {"sigma", number(sigma_of(of.lenses[c], names.size(), p))}});
    out.push_back({{"model", to_string(camera.model)},
                   {"parameters", parameters},
                   {"covariance", all_of(of.lenses[c])}});
  }
  return out;
}

Json points_json(const Problem& problem, const CovarianceOptions& options, const Covariance& of) {
  const std::vector<double> s = point_sigmas(of);
  Json list = Json::array();
  for (std::size_t k = 0; !options.point_ids.empty() && k < of.points.size(); ++k)
    list.push_back({{"point", id_of_point(problem, point_at(options, k))},
                    {"sigma", numbers(sigmas(of.points[k], 3))},
                    {"covariance", all_of(of.points[k])}});
  return {{"count", of.points.size()},
          {"undetermined", of.undetermined_points},
          {"sigma",
           {{"median", number(quantile(s, 0.5))},
            {"p90", number(quantile(s, 0.9))},
            {"max", number(quantile(s, 1))}}},
          {"conditional", options.conditional},
          {"list", list}};
}

/// Observations by |w|, the largest first; those beyond 3.29 alone.
std::vector<std::size_t> suspects(const Covariance& of) {
  constexpr double kBlunder = 3.29;
  std::vector<std::size_t> out;
  const auto w = [&](std::size_t i) {
    return std::max(std::abs(of.observations[i].standardised[0]),
                    std::abs(of.observations[i].standardised[1]));
  };
  for (std::size_t i = 0; i < of.observations.size(); ++i)
    if (w(i) > kBlunder) out.push_back(i);
  std::stable_sort(out.begin(), out.end(),
                   [&](std::size_t a, std::size_t b) { return w(a) > w(b); });
  return out;
}

/// The smallest blunder that the w-test finds in 80 % of all cases: 4.13 sigma / sqrt(r).
double least_blunder(const Covariance& of, double redundancy) {
  constexpr double kNonCentrality = 4.13;
  return kNonCentrality * of.sigma / std::sqrt(redundancy);
}

Json observations_json(const Problem& problem, const Covariance& of) {
  if (of.observations.empty()) return nullptr;
  double least = 1, sum = 0;
  std::vector<double> blunders;
  for (const ObservationReliability& o : of.observations)
    for (const double r : o.redundancy) {
      least = std::min(least, r);
      sum += r;
      blunders.push_back(least_blunder(of, r));
    }
  std::sort(blunders.begin(), blunders.end());
  Json list = Json::array();
  const std::vector<std::size_t> worst = suspects(of);
  for (std::size_t k = 0; k < std::min(kMostListed, worst.size()); ++k) {
    const std::size_t i = worst[k];
    list.push_back({{"observation", i},
                    {"image", image_name(problem.metadata.get(), problem.observation_image[i])},
                    {"point", id_of_point(problem, problem.observation_point[i])},
                    {"redundancy", all_of(of.observations[i].redundancy)},
                    {"standardised", all_of(of.observations[i].standardised)}});
  }
  return {{"redundancy_sum", number(sum)},
          {"redundancy_min", number(least)},
          {"least_blunder", {{"median", number(quantile(blunders, 0.5))}}},
          {"suspect", worst.size()},
          {"worst", list}};
}

Json weak_json(const Problem& problem, const Covariance& of) {
  Json out = Json::array();
  for (const WeakDirection& weak : of.weak) {
    Json names = Json::array();
    for (const std::uint32_t p : weak.parameters)
      names.push_back(parameter_names(problem.cameras[weak.camera].model)[p]);
    out.push_back({{"camera", weak.camera},
                   {"parameters", names},
                   {"sigma", number(weak.sigma)},
                   {"correlation", number(weak.correlation)},
                   {"words", weak.words}});
  }
  return out;
}

void add_line(std::string& to, const char* kind, const std::string& name, const char* parameter,
              double value, double sigma) {
  to += fmt::format("{},{},{},{},{}\n", kind, csv_field(name), parameter, value, sigma);
}

}  // namespace

const char* to_string(Gauge gauge) {
  switch (gauge) {
    case Gauge::automatic:
      return "auto";
    case Gauge::data:
      return "data";
    case Gauge::free_centres:
      return "free";
    case Gauge::free_points:
      return "free-points";
    case Gauge::first_two:
      return "first-two";
  }
  return "";
}

Json covariance_json(const Problem& problem, const CovarianceOptions& options,
                     const Covariance& of) {
  return {{"gauge",
           {{"name", to_string(of.gauge)}, {"deficit", of.deficit}, {"freedoms", of.freedoms}}},
          {"sigma",
           {{"value", number(of.sigma)},
            {"estimated", of.sigma_estimated},
            {"loss_factor", number(of.loss_factor)}}},
          {"rows", of.rows},
          {"unknowns", of.unknowns},
          {"redundancy", number(of.redundancy)},
          {"solver", of.solver == CovarianceSolver::factor ? "factor" : "conjugate-gradients"},
          {"images", poses_json(problem, options, of)},
          {"pairs", pairs_json(problem, options, of)},
          {"frames", moving_json(of.frames)},
          {"sensors", moving_json(of.sensors)},
          {"cameras", cameras_json(problem, of)},
          {"points", points_json(problem, options, of)},
          {"observations", observations_json(problem, of)},
          {"weak", weak_json(problem, of)},
          {"words", of.words}};
}

std::string covariance_csv(const Problem& problem, const CovarianceOptions& options,
                           const Covariance& of) {
  static const char* const kAxes[] = {"x", "y", "z"};
  static const char* const kTurns[] = {"turn_x_deg", "turn_y_deg", "turn_z_deg"};
  std::string out = "kind,name,parameter,value,sigma\n";
  for (std::size_t i = 0; i < of.poses.size(); ++i) {
    const std::uint32_t image = image_at(options, i);
    const std::string name = image_name(problem.metadata.get(), image);
    const Pose& pose = problem.poses[image];
    const Vector3<double> C = camera_centre(matrix_from_quaternion(pose.rotation), pose);
    for (std::size_t k = 0; k < 3; ++k)
      add_line(out, "center", name, kAxes[k], C[k], std::sqrt(of.centres[i][4 * k]));
    for (std::size_t k = 0; k < 3; ++k)
      add_line(out, "rotation", name, kTurns[k], 0, kDegrees * std::sqrt(of.poses[i][7 * (3 + k)]));
  }
  for (std::size_t c = 0; c < of.lenses.size(); ++c) {
    const Camera& camera = problem.cameras[c];
    const auto names = parameter_names(camera.model);
    for (std::size_t p = 0; p < names.size(); ++p)
      add_line(out, "camera", std::to_string(c), std::string(names[p]).c_str(),
               camera.parameters[p], sigma_of(of.lenses[c], names.size(), p));
  }
  for (std::size_t k = 0; k < of.points.size(); ++k) {
    const std::size_t p = point_at(options, k);
    for (std::size_t d = 0; d < 3; ++d)
      add_line(out, "point", std::to_string(id_of_point(problem, p)), kAxes[d],
               problem.points[3 * p + d], std::sqrt(of.points[k][4 * d]));
  }
  return out;
}

std::string covariance_text(const Problem& problem, const CovarianceOptions& options,
                            const Covariance& of) {
  std::string out;
  for (const std::string& words : of.words) out += fmt::format("note        {}\n", words);
  std::vector<std::size_t> order(of.centres.size());
  std::iota(order.begin(), order.end(), std::size_t(0));
  const auto s = [&](std::size_t i) { return length(sigmas(of.centres[i], 3)); };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return s(a) > s(b); });
  if (!order.empty())
    out += fmt::format("centres     sigma median {:.4g}, largest {:.4g} (image {})\n",
                       s(order[order.size() / 2]), s(order[0]),
                       image_name(problem.metadata.get(), image_at(options, order[0])));
  for (std::size_t k = 0; k < of.distances.size(); ++k)
    out += fmt::format("distance    {:.6g} +- {:.3g} between {} and {}\n", of.distances[k].value,
                       of.distances[k].sigma,
                       image_name(problem.metadata.get(), options.image_pairs[k][0]),
                       image_name(problem.metadata.get(), options.image_pairs[k][1]));
  const std::vector<double> points = point_sigmas(of);
  if (!points.empty())
    out += fmt::format("points      sigma median {:.4g}, 90 % below {:.4g}, largest {:.4g}\n",
                       quantile(points, 0.5), quantile(points, 0.9), points.back());
  constexpr std::size_t kMostCameras = 3;
  for (std::size_t c = 0; c < std::min(kMostCameras, of.lenses.size()); ++c) {
    const auto names = parameter_names(problem.cameras[c].model);
    std::string line;
    for (std::size_t p = 0; p < names.size(); ++p)
      if (const double sigma = sigma_of(of.lenses[c], names.size(), p); sigma > 0)
        line += fmt::format("{}{} {:.6g} +- {:.3g}", line.empty() ? "" : ", ", names[p],
                            problem.cameras[c].parameters[p], sigma);
    if (!line.empty()) out += fmt::format("camera {:<4} {}\n", c, line);
  }
  if (of.lenses.size() > kMostCameras)
    out += fmt::format("            and {} more cameras\n", of.lenses.size() - kMostCameras);
  if (!of.observations.empty())
    out += fmt::format("suspect     {} observations have a standardised residual beyond 3.29\n",
                       suspects(of).size());
  return out;
}

}  // namespace sheaf
