// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "compare/solver_run.h"

#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "exit_code.h"
#include "json_document.h"
#include "program.h"
#include "scene/camera_frame.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

/// Where a solver writes what it ends with: a name without extension is a model's folder.
fs::path final_of(const RunSetting& setting) {
  return setting.scratch / (setting.model ? "final" : "final.txt");
}

/// One list each, so that an adapter need not collect them.
void add_refinement(const RunSetting& setting, std::vector<std::string>& words) {
  const RefinementArguments& a = setting.limits.refinement;
  for (const auto& [option, items] : {std::pair{"--fix", a.fix}, {"--refine", a.refine}})
    if (!items.empty()) words.insert(words.end(), {option, text_of(items)});
}

std::vector<std::string> sheaf_words(const SolverProgram& solver, const RunSetting& setting) {
  std::vector<std::string> words = {solver.program,
                                    "solve",
                                    setting.path,
                                    "--quiet",
                                    "--json",
                                    setting.scratch / "run.json",
                                    "-o",
                                    final_of(setting),
                                    "--threads",
                                    std::to_string(setting.threads),
                                    "--max-iterations",
                                    std::to_string(setting.limits.max_iterations),
                                    "--time-limit",
                                    fmt::format("{}", setting.limits.time_s),
                                    "--tolerance",
                                    fmt::format("{}", setting.limits.tolerance)};
  add_refinement(setting, words);
  const std::vector<std::string> more = solve_words(solver.config);
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::vector<std::string> peer_words(const SolverProgram& solver, const RunSetting& setting) {
  std::vector<std::string> words = {
      solver.program,     setting.path,
      "--config",         solver.config,
      "--threads",        std::to_string(setting.threads),
      "--max-iterations", std::to_string(setting.limits.max_iterations),
      "--time-limit",     fmt::format("{}", setting.limits.time_s),
      "--tolerance",      fmt::format("{}", setting.limits.tolerance)};
  add_refinement(setting, words);
  words.insert(words.end(), {"--out", final_of(setting)});
  return words;
}

// The trace of `sheaf solve --json`: the cost held after every step.
void take_sheaf(const Json& document, SolverRun& run) {
  const Json& time = document.at("time");
  run.setup_s = time.at("setup_s");
  run.total_s = run.setup_s + time.at("solve_s").get<double>();
  for (const Json& step : document.at("iterations"))
    run.trace.emplace_back(run.setup_s + step.at("time_s").get<double>(),
                           step.at("cost").get<double>());
  const double cpu_s = time.at("cpu_s");
  run.cpu_percent = run.total_s > 0 ? 100 * cpu_s / run.total_s : 0;
  run.peak_bytes = document.at("memory").at("peak_bytes");
  run.final_cost = document.at("final_cost");
}

void take_peer(const Json& document, SolverRun& run) {
  run.setup_s = document.at("setup_s");
  run.total_s = document.at("total_s");
  for (const Json& step : document.at("trace"))
    run.trace.emplace_back(step.at(0).get<double>(), step.at(1).get<double>());
  run.trace = held_costs(run.trace);
  run.cpu_percent = document.at("cpu_percent");
  run.peak_bytes = document.at("peak_bytes");
  run.final_cost = document.at("final_cost");
}

/// Where each of `wanted` stands in `ids`; nothing when they are not the same ids.
template <class Id>
std::optional<std::vector<std::size_t>> places_of(const std::vector<Id>& wanted,
                                                  const std::vector<Id>& ids) {
  std::unordered_map<Id, std::size_t> place;
  for (std::size_t i = 0; i < ids.size(); ++i) place[ids[i]] = i;
  std::vector<std::size_t> out;
  for (const Id id : wanted) {
    const auto found = place.find(id);
    if (found == place.end()) return {};
    out.push_back(found->second);
  }
  return wanted.size() == ids.size() ? std::optional(std::move(out)) : std::nullopt;
}

/// A model may be written in another order: the state in the problem's, by ids. False where the two
/// do not have the same images, lenses and points.
bool take_order(const Problem& problem, Problem& state) {
  if (problem.metadata == nullptr || state.metadata == nullptr) return false;
  const SceneMetadata &a = *problem.metadata, &b = *state.metadata;
  const auto images = places_of(a.image_ids, b.image_ids);
  const auto lenses = places_of(a.camera_ids, b.camera_ids);
  const auto points = places_of(a.point_ids, b.point_ids);
  if (!images || !lenses || !points) return false;
  Problem ordered;
  ordered.image_camera = problem.image_camera;
  for (const std::size_t j : *images) ordered.poses.push_back(state.poses[j]);
  for (const std::size_t c : *lenses) ordered.cameras.push_back(state.cameras[c]);
  for (const std::size_t p : *points)
    ordered.add_point(state.points[3 * p], state.points[3 * p + 1], state.points[3 * p + 2]);
  state = std::move(ordered);
  return true;
}

// The solver's state with the observations of the problem that was asked for: one that drops or
// changes some cannot look better for it.
void judge(const fs::path& final, const RunSetting& setting, SolverRun& run) {
  Result<Problem> written = read(final);
  if (!written.ok()) {
    run.failed = std::string("what it wrote cannot be read: ") + written.error().what();
    return;
  }
  Problem state = std::move(written).value();
  const Problem& problem = setting.problem;
  if (state.num_images() != problem.num_images() || state.num_points() != problem.num_points()) {
    run.failed = "it wrote another number of images or points";
    return;
  }
  if (setting.model && !take_order(problem, state)) {
    run.failed = "it wrote images, lenses or points of other ids";
    return;
  }
  state.observation_image = problem.observation_image;
  state.observation_point = problem.observation_point;
  state.observation_xy = problem.observation_xy;
  const Fixed fixed = fixed_of(refinement_of(setting.limits.refinement, problem).value(), problem);
  if (const std::string moved = what_moved(problem, state, fixed); !moved.empty()) {
    run.failed = "it moved " + moved + ", which it was to hold";
    return;
  }
  const Evaluation evaluation = evaluate(state);
  run.final_cost_independent = evaluation.cost;
  if (!evaluation.not_finite.empty())
    run.failed = fmt::format("what it wrote has {} residuals that are not finite",
                             evaluation.not_finite.size());
  else if (setting.reference != nullptr)
    run.errors = compare_states(state, *setting.reference, true).value();
}

/// The problem as a binary model of nothing but what is solved and what names it: rotations are
/// unit quaternions, and no rigs tie images together.
void write_model(const Problem& problem, const fs::path& folder) {
  Problem plain = problem;
  place_images(plain);
  plain.rigs = {};
  SceneMetadata names;
  if (problem.metadata) names = *problem.metadata;
  names.stated_rotations.clear();
  names.point_errors_px.clear();
  names.source = nullptr;
  names.state_hash = 0;
  plain.metadata = std::make_shared<const SceneMetadata>(std::move(names));
  write(plain, folder, {.format = "colmap"}).value();
}

bool reads_models(const std::string& solver) {
  return solver == "sheaf" || solver.starts_with("colmap");
}

/// A model's solver may see another problem than ours: then its start costs something else.
void check_start(const RunSetting& setting, SolverRun& run) {
  const double cost = evaluate(setting.problem).cost;
  // Of residuals that are nothing but rounding, nothing but that can be asked.
  const double rounding = 1e-18 * static_cast<double>(setting.problem.num_observations());
  if (!run.ran() || run.trace.empty() ||
      std::abs(run.trace[0].second - cost) <= 1e-9 * cost + rounding)
    return;
  run.failed =
      fmt::format("its cost of the start is {:.17g}, not {:.17g}: it solves another problem",
                  run.trace[0].second, cost);
}

}  // namespace

RunSetting::RunSetting(const std::string& in, const InputFile& input, const Problem* truth,
                       int count, const RunLimits& given, const fs::path& folder, StopToken token)
    : problem(input.problem),
      reference(truth),
      path(fs::absolute(in)),
      model(!input.problem.cameras.empty() && !has_only_bal_cameras(input.problem)),
      threads(count),
      limits(given),
      // The slowest peer reads and writes 1 MB/s.
      kill_after_s(2 * given.time_s + 5 + 2e-6 * static_cast<double>(input.bytes)),
      scratch(folder),
      stop(std::move(token)) {
  std::error_code ignored;
  if (model) {
    path = scratch / "problem";
    write_model(problem, path);
    return;
  }
  if (input.format == "bal" && input.compression == "none" && fs::is_regular_file(path, ignored))
    return;
  path = scratch / "problem.txt";
  write(problem, path).value();
  kill_after_s += 2e-6 * static_cast<double>(fs::file_size(path, ignored));
}

SolverRun run_solver(const SolverProgram& solver, const RunSetting& setting) {
  SolverRun run;
  run.solver = solver.name;
  run.config = solver.config;
  const bool own = solver.name == "sheaf";
  if (setting.model && !reads_models(solver.name)) {
    run.failed = "its adapter reads BAL files; --own-lenses makes one of this model";
    return run;
  }
  const fs::path final = final_of(setting), json = setting.scratch / "run.json";
  std::error_code ignored;
  for (const fs::path& path : {final, json}) fs::remove_all(path, ignored);
  // Libraries inside a peer get the same count as the peer.
  const std::string count = std::to_string(setting.threads);
  const std::vector<std::string> variables = {"OMP_NUM_THREADS=" + count,
                                              "OPENBLAS_NUM_THREADS=" + count};
  try {
    const ProgramOutcome outcome =
        run_program(own ? sheaf_words(solver, setting) : peer_words(solver, setting), variables,
                    setting.scratch, setting.kill_after_s, setting.stop);
    // Sheaf's best state is written at its time limit.
    if (!own || outcome.exit_code != kExitTimeLimit) run.failed = outcome.failure();
    if (!run.ran()) return run;
    if (own) {
      take_sheaf(Json::parse(std::ifstream(json)), run);
    } else {
      take_peer(Json::parse(outcome.out), run);
    }
    judge(final, setting, run);
    if (setting.model) check_start(setting, run);
  } catch (const Json::exception& error) {
    run.failed = std::string("its JSON is not as expected: ") + error.what();
  } catch (const Error& error) {
    run.failed = error.what();
  }
  return run;
}

std::string input_name(const std::string& path) { return fs::path(path).filename(); }

}  // namespace sheaf
