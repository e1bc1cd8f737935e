// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "photometric/photometric_document.h"

#include <algorithm>
#include <cmath>

#include "platform/memory.h"

namespace sheaf {
namespace {

/// A number for each point: of its inverse depth, or the three of X, Y and Z together.
std::vector<double> sigma_of_points(const PhotometricDetails& details) {
  if (details.of_inverse_depth) return details.sigma;
  std::vector<double> out;
  for (std::size_t k = 0; k + 2 < details.sigma.size(); k += 3)
    out.push_back(std::hypot(details.sigma[k], details.sigma[k + 1], details.sigma[k + 2]));
  return out;
}

Json sigma_json(const PhotometricDetails& details) {
  const std::vector<double> sigma = sigma_of_points(details);
  const auto undetermined =
      std::count_if(sigma.begin(), sigma.end(), [](double s) { return !std::isfinite(s); });
  return {{"grey", number(details.sigma_grey)},
          {"of", details.of_inverse_depth ? "inverse-depth" : "xyz"},
          {"median", number(median_sigma(details))},
          {"undetermined", undetermined}};
}

}  // namespace

double median_sigma(const PhotometricDetails& details) {
  std::vector<double> sigma = sigma_of_points(details);
  std::erase_if(sigma, [](double s) { return !std::isfinite(s); });
  if (sigma.empty()) return std::nan("");
  const auto middle = sigma.begin() + static_cast<std::ptrdiff_t>(sigma.size() / 2);
  std::nth_element(sigma.begin(), middle, sigma.end());
  return *middle;
}

Json photometric_json(const PhotometricRecord& record, const PhotometricSummary& summary,
                      const PhotometricDetails& details, const PhotometricProblem& problem) {
  const Summary& s = summary.solve;
  Json brightness = Json::array();
  for (const Brightness& of : problem.brightness)
    brightness.push_back({{"a", number(of.a)}, {"b", number(of.b)}});
  return {
      {"version", SHEAF_VERSION},
      {"input",
       {{"path", record.in},
        {"format", record.format},
        {"images", problem.images.size()},
        {"points", problem.num_points()}}},
      {"options", record.options},
      {"solver", {{"name", s.solver}}},
      {"simd", s.simd},
      {"threads", s.threads},
      {"memory", {{"forecast_bytes", s.forecast_bytes}, {"peak_bytes", peak_resident_bytes()}}},
      {"patches",
       {{"total", summary.patches_total},
        {"visible", summary.patches_visible},
        {"left", summary.patches_left},
        {"seen_after", details.seen.size()}}},
      {"initial_cost", number(s.initial_cost)},
      {"final_cost", number(s.final_cost)},
      {"plain_cost",
       {{"before", number(s.initial_plain_cost)}, {"after", number(s.final_plain_cost)}}},
      {"loss", loss_json(s)},
      {"rms_grey",
       {{"before", number(summary.initial_rms_grey)}, {"after", number(summary.final_rms_grey)}}},
      {"median_abs_grey",
       {{"before", number(summary.initial_median_grey)},
        {"after", number(summary.final_median_grey)}}},
      {"inlier_share",
       {{"before", number(summary.initial_inlier_share)},
        {"after", number(summary.final_inlier_share)}}},
      {"sigma", sigma_json(details)},
      {"anchor",
       {{"measurements", summary.measurements},
        {"sigma_grey", number(summary.anchor_sigma_grey)},
        {"rms_px",
         {{"before", number(summary.initial_rms_px)}, {"after", number(summary.final_rms_px)}}}}},
      {"brightness", brightness},
      {"pictures", record.pictures},
      {"poses", pose_errors_json(record.before, record.after)},
      {"termination", {{"code", to_string(s.termination)}, {"words", s.words}}},
      {"iterations", iterations_json(s)},
      {"checkpoints", checkpoints_json(s)},
      {"time",
       {{"read_s", record.read_s},
        {"setup_s", s.setup_s},
        {"solve_s", s.solve_s},
        {"write_s", record.write_s},
        {"total_s", record.total_s}}}};
}

}  // namespace sheaf
