// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/comparison.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sheaf {

bool SolverRun::agrees() const {
  return std::fabs(final_cost - final_cost_independent) <=
         1e-9 * std::max(std::fabs(final_cost), std::fabs(final_cost_independent));
}

StepTimes step_times(const CostTrace& trace) {
  StepTimes out;
  if (trace.size() < 2) return out;
  for (std::size_t k = 1; k < trace.size(); ++k) {
    const double seconds = trace[k].first - trace[k - 1].first;
    const bool accepted = trace[k].second != trace[k - 1].second;
    (accepted ? out.accepted : out.rejected) += 1;
    (accepted ? out.accepted_s : out.rejected_s) += seconds;
  }
  out.step_s = (out.accepted_s + out.rejected_s) / static_cast<double>(trace.size() - 1);
  if (out.accepted > 0) out.accepted_s /= out.accepted;
  if (out.rejected > 0) out.rejected_s /= out.rejected;
  return out;
}

CostTrace held_costs(const CostTrace& told) {
  CostTrace out = told;
  for (std::size_t k = 1; k < out.size(); ++k)
    if (!(out[k].second < out[k - 1].second)) out[k].second = out[k - 1].second;
  return out;
}

std::optional<double> time_to(const CostTrace& trace, double cost) {
  for (const auto& [seconds, held] : trace)
    if (held <= cost) return seconds;
  return {};
}

double best_cost(const std::vector<SolverRun>& runs) {
  double best = std::numeric_limits<double>::infinity();
  for (const SolverRun& run : runs)
    if (run.ran() && std::isfinite(run.final_cost_independent))
      best = std::min(best, run.final_cost_independent);
  return best;
}

std::string what_moved(const Problem& before, const Problem& after, const Fixed& fixed) {
  const auto same = [](double a, double b) { return std::fabs(a - b) <= 1e-9 * std::fabs(a); };
  const auto listed = [](const std::vector<std::uint32_t>& ids, std::size_t id) {
    return std::find(ids.begin(), ids.end(), id) != ids.end();
  };
  if (fixed.points &&
      !std::equal(before.points.begin(), before.points.end(), after.points.begin(), same))
    return "points";
  const std::vector<ParameterSet> held = held_parameters(before, fixed);
  for (std::size_t i = 0; i < before.num_images(); ++i) {
    const Pose &a = before.poses[i], &b = after.poses[i];
    const double size = std::hypot(a.translation[0], a.translation[1], a.translation[2]);
    double cosine = 0, shift = 0;
    for (int j = 0; j < 4; ++j) cosine += a.rotation[j] * b.rotation[j];
    for (int j = 0; j < 3; ++j)
      shift = std::max(shift, std::fabs(a.translation[j] - b.translation[j]));
    const bool stays = 1 - std::fabs(cosine) <= 1e-14 && shift <= 1e-9 * size;
    if (!stays && (fixed.poses || listed(fixed.pose_ids, i))) return "poses";
    const auto &own = before.cameras[before.image_camera[i]].parameters,
               &other = after.cameras[after.image_camera[i]].parameters;
    const CameraModel model = before.cameras[before.image_camera[i]].model;
    const ParameterSet set = held[before.image_camera[i]];
    const std::vector<std::string_view> names = parameter_names(model);
    for (std::size_t k = 0; k < names.size(); ++k)
      if ((set >> k & 1) != 0 && !same(own[k], other[k])) return std::string(names[k]);
  }
  return "";
}

std::vector<std::size_t> median_runs(const std::vector<SolverRun>& runs) {
  std::vector<std::size_t> out;
  for (std::size_t first = 0; first < runs.size(); ++first) {
    const auto same = [&](std::size_t i) {
      return runs[i].solver == runs[first].solver && runs[i].config == runs[first].config;
    };
    bool seen = false;
    for (std::size_t i = 0; i < first && !seen; ++i) seen = same(i);
    if (seen) continue;
    std::vector<std::size_t> mine;
    for (std::size_t i = first; i < runs.size(); ++i)
      if (same(i) && runs[i].ran()) mine.push_back(i);
    std::stable_sort(mine.begin(), mine.end(), [&](std::size_t a, std::size_t b) {
      return runs[a].total_s < runs[b].total_s;
    });
    out.push_back(mine.empty() ? first : mine[(mine.size() - 1) / 2]);
  }
  return out;
}

}  // namespace sheaf
