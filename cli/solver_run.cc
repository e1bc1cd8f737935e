// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solver_run.h"

#include <fmt/format.h>

#include <fstream>
#include <utility>
#include <vector>

#include "json_document.h"
#include "program.h"
#include "solve_arguments.h"

namespace sheaf {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> sheaf_words(const SolverProgram& solver, const RunSetting& setting) {
  std::vector<std::string> words = {solver.program,
                                    "solve",
                                    setting.path,
                                    "--quiet",
                                    "--json",
                                    setting.scratch / "run.json",
                                    "-o",
                                    setting.scratch / "final.txt",
                                    "--threads",
                                    std::to_string(setting.threads),
                                    "--max-iterations",
                                    std::to_string(setting.limits.max_iterations),
                                    "--time-limit",
                                    fmt::format("{}", setting.limits.time_s),
                                    "--tolerance",
                                    fmt::format("{}", setting.limits.tolerance)};
  if (!setting.limits.fix.empty()) words.insert(words.end(), {"--fix", setting.limits.fix});
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
  if (!setting.limits.fix.empty()) words.insert(words.end(), {"--fix", setting.limits.fix});
  words.insert(words.end(), {"--out", setting.scratch / "final.txt"});
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
  state.observation_image = problem.observation_image;
  state.observation_point = problem.observation_point;
  state.observation_xy = problem.observation_xy;
  Fixed fixed;
  if (!setting.limits.fix.empty()) parse_fix(setting.limits.fix, fixed);
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

}  // namespace

RunSetting::RunSetting(const std::string& in, const InputFile& input, const Problem* truth,
                       int count, const RunLimits& given, const fs::path& folder,
                       std::stop_token token)
    : problem(input.problem),
      reference(truth),
      path(fs::absolute(in)),
      threads(count),
      limits(given),
      // The slowest peer reads and writes 1 MB/s.
      kill_after_s(2 * given.time_s + 5 + 2e-6 * static_cast<double>(input.bytes)),
      scratch(folder),
      stop(std::move(token)) {
  std::error_code ignored;
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
  const fs::path final = setting.scratch / "final.txt", json = setting.scratch / "run.json";
  std::error_code ignored;
  for (const fs::path& path : {final, json}) fs::remove(path, ignored);
  // Libraries inside a peer get the same count as the peer.
  const std::string count = std::to_string(setting.threads);
  const std::vector<std::string> variables = {"OMP_NUM_THREADS=" + count,
                                              "OPENBLAS_NUM_THREADS=" + count};
  try {
    const ProgramOutcome outcome =
        run_program(own ? sheaf_words(solver, setting) : peer_words(solver, setting), variables,
                    setting.scratch, setting.kill_after_s, setting.stop);
    // Sheaf ends with 130 at its time limit, its best state written.
    if (!own || outcome.exit_code != 130) run.failed = outcome.failure();
    if (!run.ran()) return run;
    if (own) {
      take_sheaf(Json::parse(std::ifstream(json)), run);
    } else {
      take_peer(Json::parse(outcome.out), run);
    }
    judge(final, setting, run);
  } catch (const Json::exception& error) {
    run.failed = std::string("its JSON is not as expected: ") + error.what();
  } catch (const Error& error) {
    run.failed = error.what();
  }
  return run;
}

std::string input_name(const std::string& path) { return fs::path(path).filename(); }

}  // namespace sheaf
