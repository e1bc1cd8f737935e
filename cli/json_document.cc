// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "json_document.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "inspect/statistics.h"
#include "outputs.h"
#include "platform/memory.h"

namespace sheaf {
namespace {

constexpr std::size_t kMostListed = 1000;

/// What a variant of options holds, as JSON has it.
struct AsJson {
  Json operator()(std::monostate) const { return {}; }
  Json operator()(double value) const { return number(value); }
  template <class Value>
  Json operator()(const Value& value) const {
    return value;
  }
};

Json range_json(const Range& range) {
  return {{"min", number(range.min)}, {"median", number(range.median)}, {"max", number(range.max)}};
}

}  // namespace

Json iteration_json(const Iteration& it) {
  return {{"index", it.index},
          {"round", it.round},
          {"start_cost", number(it.start_cost)},
          {"cost", number(it.cost)},
          {"trial_cost", number(it.trial_cost)},
          {"accepted", it.accepted},
          {"damping", number(it.damping)},
          {"radius", number(it.radius)},
          {"reused", it.reused},
          {"gain_ratio", number(it.gain_ratio)},
          {"gradient_max", number(it.gradient_max)},
          {"step_norm", number(it.step_norm)},
          {"scale_px", it.scale_px > 0 ? number(it.scale_px) : Json()},
          {"loss_floor", number(it.loss_floor)},
          {"linear_iterations", it.linear_iterations},
          {"passes", it.passes},
          {"time_s", number(it.time_s)}};
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json options_json(const std::vector<BoundOption>& options) {
  Json out = Json::object();
  for (const BoundOption& option : options)
    if (option.spec.reach == OptionReach::verb)
      out[key_of(option.spec)] = std::visit(AsJson(), option.get());
  return out;
}

Json iterations_json(const Summary& summary) {
  Json iterations = Json::array();
  for (const Iteration& it : summary.iterations) iterations.push_back(iteration_json(it));
  return iterations;
}

Json changes_json(const Summary& summary) {
  Json list = Json::array();
  for (const SolverChange& change : summary.solver_changes)
    list.push_back({{"after_step", change.after_step},
                    {"iterations", number(change.iterations)},
                    {"from", change.from},
                    {"to", change.to}});
  return list;
}

Json recoveries_json(const Summary& summary) {
  Json list = Json::array();
  for (const Recovery& r : summary.recoveries)
    list.push_back({{"after_step", r.after_step},
                    {"passes", r.passes},
                    {"taken", r.taken},
                    {"from_start", r.from_start},
                    {"cost_before", number(r.cost_before)},
                    {"cost_after", number(r.cost_after)}});
  return list;
}

Json loss_json(const Summary& s) {
  Json rounds = Json::array();
  for (const LossRound& round : s.rounds)
    rounds.push_back({{"scale_px", round.scale_px > 0 ? number(round.scale_px) : Json()},
                      {"sigma_px", round.sigma_px > 0 ? number(round.sigma_px) : Json()},
                      {"initial_cost", number(round.initial_cost)},
                      {"final_cost", number(round.final_cost)},
                      {"steps", round.steps}});
  return {{"name", to_string(s.loss)},
          {"scale_px", s.loss == LossKind::none ? Json() : number(s.rounds.back().scale_px)},
          {"sigma_px", s.final_sigma_px > 0 ? number(s.final_sigma_px) : Json()},
          {"rounds", rounds}};
}

Json checkpoints_json(const Summary& s) {
  return {{"written", s.checkpoints},
          {"failure", s.checkpoint_failure.empty() ? Json() : Json(s.checkpoint_failure)},
          {"resumed_after", s.resumed_after < 0 ? Json() : Json(s.resumed_after)}};
}

Json counts_json(const Problem& problem) {
  return {{"cameras", problem.cameras.size()},
          {"poses", problem.num_images()},
          {"points", problem.num_points()},
          {"observations", problem.num_observations()}};
}

Json input_json(const std::string& path, const InputFile& input) {
  Json out = {{"path", path},         {"format", input.format}, {"compression", input.compression},
              {"bytes", input.bytes}, {"sha256", input.sha256}, {"notes", input.notes}};
  out.update(counts_json(input.problem));
  return out;
}

Json observations_json(const std::vector<std::uint64_t>& ids, const Problem& problem) {
  Json list = Json::array();
  for (std::size_t k = 0; k < std::min(ids.size(), kMostListed); ++k)
    list.push_back({{"observation", ids[k]},
                    {"image", problem.observation_image[ids[k]]},
                    {"point", problem.observation_point[ids[k]]}});
  return {{"count", ids.size()}, {"first", list}};
}

Json statistics_json(const Statistics& statistics) {
  Json histogram = Json::array();
  for (const auto& [length, points] : statistics.track_histogram)
    histogram.push_back({{"length", length}, {"points", points}});
  Json track = range_json(statistics.track);
  track["mean"] = number(statistics.mean_track);
  track["histogram"] = histogram;
  Json images = range_json(statistics.observations_per_image);
  images["mean"] = number(statistics.mean_observations_per_image);
  return {{"track", track},
          {"observations_per_image", images},
          {"focal_px", range_json(statistics.focal_px)}};
}

Json scene_options_json(const SceneOptions& o) {
  return {{"cameras", o.images},
          {"points", o.points},
          {"mean_track", o.mean_track},
          {"pixel_noise_px", o.pixel_noise_px},
          {"rotation_noise_rad", o.rotation_noise_rad},
          {"center_noise", o.center_noise},
          {"point_noise", o.point_noise},
          {"focal_noise", o.focal_noise},
          {"seed", o.seed}};
}

Json part_json(double before, double after) {
  return {{"before", number(before)}, {"after", number(after)}};
}

Json cost_parts_json(const Summary& s) {
  const TermCosts &a = s.initial_terms, &b = s.final_terms;
  return {{"observations", part_json(s.initial_cost - a.total(), s.final_cost - b.total())},
          {"centres", part_json(a.centres, b.centres)},
          {"rotations", part_json(a.rotations, b.rotations)},
          {"gravities", part_json(a.gravities, b.gravities)},
          {"relative_poses", part_json(a.relative_poses, b.relative_poses)},
          {"parameters", part_json(a.parameters, b.parameters)},
          {"points", part_json(a.points, b.points)},
          {"distances", part_json(a.distances, b.distances)},
          {"gaussians", part_json(a.gaussians, b.gaussians)}};
}

Json bounds_json(const Summary& s) {
  Json out = Json::array();
  for (const BoundReached& at : s.at_bounds)
    out.push_back({{"camera", at.camera},
                   {"parameter", at.name},
                   {"value", number(at.value)},
                   {"bound", at.upper ? "upper" : "lower"}});
  return out;
}

Json solve_json(const SolveRecord& record, const Summary& s, const Problem& problem) {
  return {
      {"version", SHEAF_VERSION},
      {"command", record.command},
      {"input", record.input},
      {"options", record.options},
      {"rig_configuration", record.rig_configuration},
      {"survey", nullptr},  // those of a verb which knows some take their place
      {"sigmas", nullptr},
      {"solver", {{"name", s.solver}, {"reason", s.solver_reason}, {"changes", changes_json(s)}}},
      {"points", {{"name", s.points}, {"reason", s.points_reason}}},
      {"precision", s.precision},
      {"simd", s.simd},
      {"threads", s.threads},
      {"memory", {{"forecast_bytes", s.forecast_bytes}, {"peak_bytes", peak_resident_bytes()}}},
      {"initial_cost", number(s.initial_cost)},
      {"final_cost", number(s.final_cost)},
      {"cost_parts", cost_parts_json(s)},
      {"at_bounds", bounds_json(s)},
      {"loss", loss_json(s)},
      {"rms_px", {{"before", number(s.initial_rms_px)}, {"after", number(s.final_rms_px)}}},
      {"termination", {{"code", to_string(s.termination)}, {"words", s.words}}},
      {"iterations", iterations_json(s)},
      {"recoveries", recoveries_json(s)},
      {"checkpoints", checkpoints_json(s)},
      {"time",
       {{"read_s", record.read_s},
        {"setup_s", s.setup_s},
        {"solve_s", s.solve_s},
        {"cpu_s", record.cpu_s},
        {"write_s", record.write_s},
        {"total_s", record.total_s}}},
      {"plain_cost",
       {{"before", number(record.before.cost)},
        {"after", number(record.after.cost)},
        {"agrees", record.agrees}}},
      {"behind_camera",
       {{"before", observations_json(record.before.behind, problem)},
        {"after", observations_json(record.after.behind, problem)}}},
      {"rejected_observations", observations_json(s.rejected_observations, problem)}};
}

void write_json(const Json& document, const std::string& path) {
  // Names of files may be in any encoding; JSON is UTF-8.
  write_text(document.dump(1, ' ', false, Json::error_handler_t::replace) + "\n", path);
}

}  // namespace sheaf
