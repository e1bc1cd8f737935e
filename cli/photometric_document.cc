// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "photometric_document.h"

#include "platform/memory.h"

namespace sheaf {
namespace {

Json options_json(const PhotometricArguments& a) {
  return {{"intrinsics", a.intrinsics.empty() ? Json() : Json(a.intrinsics)},
          {"interpolation", a.interpolation},
          {"brightness", a.brightness},
          {"loss", a.loss},
          {"loss_on", a.loss_on},
          {"leaving", a.leaving},
          {"points", a.points},
          {"warp", a.warp},
          {"pattern", a.pattern},
          {"levels", a.levels},
          {"rounds", a.rounds},
          {"min_zncc", a.min_zncc},
          {"rows", a.rows},
          {"anchor_px", a.anchor_px > 0 ? number(a.anchor_px) : Json()},
          {"anchor_loss", a.anchor_loss},
          {"fix", a.fix.empty() ? Json() : Json(a.fix)},
          {"max_iterations", a.max_iterations},
          {"tolerance", a.tolerance},
          {"motion_px", number(a.motion_px)},
          {"time_limit_s", a.time_limit_s > 0 ? number(a.time_limit_s) : Json()},
          {"initial_damping", a.initial_damping}};
}

}  // namespace

Json photometric_json(const PhotometricRecord& record, const PhotometricSummary& summary,
                      const PhotometricProblem& problem) {
  const Summary& s = summary.solve;
  Json brightness = Json::array();
  for (const Brightness& of : problem.brightness)
    brightness.push_back({{"a", number(of.a)}, {"b", number(of.b)}});
  return {
      {"version", SHEAF_VERSION},
      {"input",
       {{"path", record.in}, {"images", problem.images.size()}, {"points", problem.num_points()}}},
      {"options", options_json(record.arguments)},
      {"solver", {{"name", s.solver}}},
      {"simd", s.simd},
      {"threads", s.threads},
      {"memory", {{"peak_bytes", peak_resident_bytes()}}},
      {"patches",
       {{"total", summary.patches_total},
        {"visible", summary.patches_visible},
        {"left", summary.patches_left}}},
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
      {"anchor",
       {{"measurements", summary.measurements},
        {"sigma_grey", number(summary.anchor_sigma_grey)},
        {"rms_px",
         {{"before", number(summary.initial_rms_px)}, {"after", number(summary.final_rms_px)}}}}},
      {"brightness", brightness},
      {"termination", {{"code", to_string(s.termination)}, {"words", s.words}}},
      {"iterations", iterations_json(s)},
      {"time",
       {{"read_s", record.read_s},
        {"setup_s", s.setup_s},
        {"solve_s", s.solve_s},
        {"write_s", record.write_s},
        {"total_s", record.total_s}}}};
}

}  // namespace sheaf
