// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "compare/comparison_document.h"
#include "compare/cost_plot.h"
#include "compare/solver_programs.h"
#include "compare/solver_run.h"
#include "exit_code.h"
#include "interrupt.h"
#include "json_document.h"
#include "outputs.h"
#include "program.h"
#include "read_input.h"
#include "report/comparison.h"
#include "scene/camera_frame.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  RunLimits limits;
  std::string in, reference, solvers, peers, plot;
  std::vector<double> taus = {1e-1, 1e-2, 1e-3, 1e-4, 1e-6};
  int runs = 1;
  bool steps = false, own_lenses = false;
};

void tell(const Arguments& arguments, const SolverRun& run) {
  if (arguments.common.quiet) return;
  const std::string result =
      run.ran() ? fmt::format("{:.10g} in {:.3g} s", run.final_cost_independent, run.total_s)
                : run.failed;
  print_err("{}:{}: {}\n", run.solver, run.config, result);
}

// Interleaved, each turn beginning with another solver: A B C, B C A, ...
std::vector<SolverRun> run_all(const Arguments& arguments,
                               const std::vector<SolverProgram>& solvers,
                               const RunSetting& setting) {
  std::vector<SolverRun> runs;
  for (int turn = 0; turn < arguments.runs; ++turn) {
    for (std::size_t k = 0; k < solvers.size(); ++k) {
      const std::size_t which = (k + static_cast<std::size_t>(turn)) % solvers.size();
      SolverRun run = run_solver(solvers[which], setting);
      if (setting.stop.stop_requested()) return runs;
      run.turn = turn;
      tell(arguments, run);
      runs.push_back(std::move(run));
    }
  }
  return runs;
}

// A BAL file's problem: a lens for each image. A COLMAP model stays what it is, unless asked.
void make_bal(InputFile& input, bool own_lenses, bool quiet) {
  if (input.format == "bal" || (input.format.starts_with("colmap") && !own_lenses)) return;
  Problem& problem = input.problem;
  to_bal_cameras(problem).value();
  if (!quiet)
    print_err("compared as a BAL file states it: each image has a lens f, k1, k2 of its own\n");
  std::vector<Camera> lenses;
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    lenses.push_back(problem.cameras[problem.image_camera[j]]);
    problem.image_camera[j] = static_cast<std::uint32_t>(j);
  }
  problem.cameras = std::move(lenses);
  problem.metadata = nullptr;
}

void write_plot(const Arguments& arguments, const ComparisonRecord& record,
                const std::string& title) {
  std::vector<std::pair<std::string, CostTrace>> curves;
  for (const std::size_t i : median_runs(record.runs))
    if (const SolverRun& run = record.runs[i]; run.ran())
      curves.emplace_back(run.solver + " " + run.config, run.trace);
  write_text(cost_plot(title, curves, record.best), arguments.plot);
}

Json list_json(const std::vector<std::string>& items) {
  return items.empty() ? Json() : Json(text_of(items));
}

Json document_of(const Arguments& arguments, const Json& input, const SolverList& solvers,
                 const ComparisonRecord& record, const Timer& total) {
  Json missing = Json::array();
  for (const MissingSolver& solver : solvers.missing)
    missing.push_back({{"solver", solver.name}, {"how", solver.how}});
  const RunLimits& limits = arguments.limits;
  return {{"version", SHEAF_VERSION},
          {"problem", input},
          {"options",
           {{"threads", record.threads},
            {"tolerance", limits.tolerance},
            {"fix", list_json(limits.refinement.fix)},
            {"refine", list_json(limits.refinement.refine)},
            {"own_lenses", arguments.own_lenses},
            {"max_iterations", limits.max_iterations},
            {"time_limit_s", limits.time_s},
            {"runs", arguments.runs},
            {"reference", arguments.reference.empty() ? Json() : Json(arguments.reference)}}},
          {"best_cost", number(record.best)},
          {"runs", runs_json(record)},
          {"missing", missing},
          {"time", {{"total_s", total.seconds()}}}};
}

void print(const Arguments& arguments, const Problem& problem, const SolverList& solvers,
           const ComparisonRecord& record) {
  print_out("{}: {}\n", arguments.in, counts_text(problem));
  print_out(
      "{} thread{}; each solver ends after two accepted steps that decrease the cost by less than "
      "{:g} of it, {} steps or {:g} s\n",
      record.threads, record.threads == 1 ? "" : "s", arguments.limits.tolerance,
      arguments.limits.max_iterations, arguments.limits.time_s);
  if (arguments.limits.refinement.given())
    print_out("held: {}\n",
              held_text(refinement_of(arguments.limits.refinement, problem).value(), problem));
  print_out("best cost {:.10g}\n\n{}", record.best, Lines{comparison_text(record)});
  if (arguments.steps) print_out("\n{}\n", Lines{steps_table(record)});
  for (const MissingSolver& solver : solvers.missing)
    print_out("not here: {}: {}\n", solver.name, solver.how);
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  check_outputs({{"--plot", arguments.plot}, {"--json", json}},
                {arguments.in, arguments.reference});
  InputFile input = read_input(arguments.in, arguments.common);
  const Json input_document = input_json(arguments.in, input);
  make_bal(input, arguments.own_lenses, arguments.common.quiet);
  Problem reference;
  if (!arguments.reference.empty()) reference = read(arguments.reference).value();
  const char* folders = std::getenv("SHEAF_PEERS");
  const Fixed fixed =
      fixed_of(refinement_of(arguments.limits.refinement, input.problem).value(), input.problem);
  const SolverList solvers = find_solvers(
      arguments.solvers, !arguments.peers.empty() || folders == nullptr ? arguments.peers : folders,
      input.problem, fixed);
  if (!arguments.reference.empty()) list_errors(input.problem, reference, AlignBy::nothing).value();

  const int threads = arguments.common.threads > 0
                          ? arguments.common.threads
                          : static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const ScratchFolder scratch;
  interrupt.begin_solve();
  const RunSetting setting(arguments.in, input, arguments.reference.empty() ? nullptr : &reference,
                           threads, arguments.limits, scratch.path(), interrupt.token());
  ComparisonRecord record{run_all(arguments, solvers.found, setting), arguments.taus, threads, 0};
  record.best = best_cost(record.runs);
  interrupt.begin_write();
  print(arguments, input.problem, solvers, record);
  if (!arguments.plot.empty())
    write_plot(
        arguments, record,
        fmt::format("{}, {} thread{}", input_name(arguments.in), threads, threads == 1 ? "" : "s"));
  if (!json.empty())
    write_json(document_of(arguments, input_document, solvers, record, total), json);
  if (setting.stop.stop_requested()) return kExitInterrupted;
  const bool any = std::any_of(record.runs.begin(), record.runs.end(),
                               [](const SolverRun& r) { return r.ran(); });
  return any ? 0 : static_cast<int>(ErrorCode::no_usable_step);
}

// "0.1,0.01": parts of the best cost.
OptionField<Arguments> time_to_field() {
  OptionSpec part{.name = "time-to", .range = above(0)};
  part.kind = OptionKind::real;
  OptionSpec spec{.name = "time-to",
                  .placeholder = "TAUS",
                  .help = "times until the cost is within these parts of the best",
                  .wrong = [part](const std::string& text) {
                    const Result<OptionValue> value = parse(part, text);
                    return value.ok() ? std::string() : std::string(value.error().what());
                  }};
  return FieldsOf<Arguments>::made(
      OptionKind::list, spec,
      [](const Arguments& a) -> OptionValue {
        std::vector<std::string> items;
        for (const double tau : a.taus) items.push_back(text_of(tau));
        return items;
      },
      [part](Arguments& a, const OptionValue& value) {
        a.taus.clear();
        for (const std::string& item : std::get<std::vector<std::string>>(value))
          a.taus.push_back(std::get<double>(parse(part, item).value()));
      });
}

OptionTable<RunLimits> limit_fields() {
  using F = FieldsOf<RunLimits>;
  return {F::whole(&RunLimits::max_iterations, {.name = "max-iterations",
                                                .placeholder = "N",
                                                .range = from(1),
                                                .help = "steps of each solver, at most"}),
          F::real(&RunLimits::time_s,
                  {.name = "time-limit",
                   .placeholder = "SECONDS",
                   .unit = "s",
                   .range = {.lowest = 0, .highest = 1e6, .above = true},
                   .help = "of each solver; one that does not end by itself is killed later on"}),
          F::real(&RunLimits::tolerance,
                  {.name = "tolerance",
                   .placeholder = "T",
                   .range = from(0),
                   .help = "each solver ends after two accepted steps in a row that decrease the "
                           "cost by less than this part of it"})};
}

OptionTable<Arguments> solver_fields() {
  using F = FieldsOf<Arguments>;
  return {
      F::text(&Arguments::solvers,
              {.name = "solvers",
               .placeholder = "LIST",
               .help = "comma-separated NAME[:CONFIG]: sheaf (its CONFIG is a camera solver or "
                       "OPTION=VALUE of solve, joined by '+') and peers that are installed "
                       "(ceres, g2o, gtsam, ...; their CONFIGs are in bench/README.md) [sheaf and "
                       "all that are found]"}),
      F::text(&Arguments::peers,
              {.name = "peers",
               .placeholder = "FOLDERS",
               .help = "more folders to find peers (programs peer-NAME) in, separated by colons "
                       "[$SHEAF_PEERS]"}),
      F::text(&Arguments::reference,
              {.name = "reference",
               .placeholder = "FILE",
               .help = "truth to hold each result against, as evaluate does"})};
}

OptionTable<Arguments> run_fields() {
  using F = FieldsOf<Arguments>;
  return {F::flag(&Arguments::own_lenses,
                  {.name = "own-lenses",
                   .help = "give each image of a COLMAP model a lens f, k1, k2 of its own, as a "
                           "BAL file states it, so that peers that read those can take part"}),
          time_to_field(),
          F::whole(&Arguments::runs,
                   {.name = "runs",
                    .placeholder = "N",
                    .range = from(1),
                    .help = "of each solver, interleaved; the table shows the median one"}),
          F::flag(&Arguments::steps,
                  {.name = "steps",
                   .help = "also a table of each step: seconds, chi2, which were rejected"}),
          F::text(&Arguments::plot,
                  {.name = "plot", .placeholder = "FILE", .help = "cost against time, as SVG"})};
}

}  // namespace

Verb compare_verb() {
  auto a = std::make_shared<Arguments>();
  Verb verb{"compare", "solve a problem with every solver that is here, side by side",
            "Example:\n  sheaf compare problem.txt --solvers sheaf,sheaf:sparse --threads 1 --plot "
            "compare.svg\n"
            "\nWith every peer that is installed, and errors against a known truth:\n"
            "  sheaf compare start.txt --reference truth.txt --runs 5 --json compare.json\n"
            "\nPoses and lenses alone, step by step:\n"
            "  sheaf compare start.txt --fix points --solvers sheaf,ceres,g2o --threads 1 --steps\n"
            "\nA COLMAP model with the lenses that its images share, beside COLMAP:\n"
            "  sheaf compare model --solvers sheaf,colmap --runs 5"};
  verb.places = bound<Arguments>({FieldsOf<Arguments>::text(&Arguments::in, problem_in())}, *a);
  const auto refinement =
      refinement_fields("what every solver holds (one that cannot is a row that says so)");
  verb.options = joined({bound(solver_fields(), *a), bound(limit_fields(), a->limits),
                         bound(refinement, a->limits.refinement), bound(run_fields(), *a),
                         options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
