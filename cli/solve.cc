// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "constraints_option.h"
#include "covariance_document.h"
#include "exit_code.h"
#include "interrupt.h"
#include "json_document.h"
#include "live_line.h"
#include "options/solve_options.h"
#include "outputs.h"
#include "page/report.h"
#include "platform/transfers.h"
#include "progress.h"
#include "read_input.h"
#include "rigs_option.h"
#include "scene/subset.h"
#include "sheaf/sheaf.h"
#include "step_log.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  SolveArguments solve;
  RigsArguments rigs;
  ConstraintsArguments constraints;
  std::string in, out, ply, sigmas, log, report, images;
  std::function<std::string()> command{};  ///< that was given
};

// All but the observations, which are most of the memory while the solver needs its own.
Problem state_of(const Problem& problem) {
  Problem state;
  state.poses = problem.poses;
  state.image_camera = problem.image_camera;
  state.cameras = problem.cameras;
  state.points = problem.points;
  return state;
}

// What a page needs of the start: names, with which the result's images and points are told.
Problem start_of(const Problem& problem, std::shared_ptr<const SceneMetadata> metadata) {
  Problem start = state_of(problem);
  start.rigs = problem.rigs;
  if (metadata == nullptr) return start;
  auto names = std::make_shared<SceneMetadata>();
  names->image_names = metadata->image_names;
  names->image_ids = metadata->image_ids;
  names->point_ids = metadata->point_ids;
  start.metadata = std::move(names);
  return start;
}

ReportOptions page_options(const Arguments& arguments, const SolveOptions& solved,
                           const Summary& summary) {
  ReportOptions options;
  options.title = std::filesystem::path(arguments.in).filename().string();
  options.images = arguments.images;
  options.fixed = solved.fixed;
  options.threads = solved.threads;
  options.stop = solved.stop;
  options.time_limit_s = solved.time_limit_s;
  options.in_place = !arguments.constraints.paths.empty();
  if (solved.loss.kind != LossKind::none)
    options.loss = {solved.loss.kind, summary.rounds.back().scale_px};
  return options;
}

// --report: of the end, in the frame that a survey has brought the problem into.
void write_page(const Arguments& arguments, Problem start, const Problem& problem,
                ReportOptions options, const Json& document) {
  start.points.resize(problem.points.size());
  options.summary = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  write_report(&start, problem, arguments.report, options).value();
}

// Says what --fix and --refine leave where it is; nothing where nothing was asked for.
std::string hold(const RefinementArguments& arguments, const Problem& problem, Fixed& fixed) {
  if (!arguments.given()) return "";
  const Refinement refinement = refinement_of(arguments, problem).value();
  fixed = fixed_of(refinement, problem);
  return fmt::format("held        {}\n", held_text(refinement, problem));
}

// A survey that takes part: placed before the solve, measured after it.
struct SurveyWork {
  std::optional<Survey> survey{};
  SurveyReport report{};
  std::optional<Covariance> precision{};  // of the page, with the survey's terms
};

// How well the end is known, with the survey's terms still in the problem: --sigmas. An error waits
// until all else is written.
struct SigmasWork {
  CovarianceOptions options;
  std::optional<Covariance> found;
  std::optional<Error> failed;
  Termination ending{};  ///< of the solve, or what cut this short

  /// Of a run that was cut short nothing more is computed.
  void run(const Problem& problem, const SolveOptions& solved, const Summary& summary,
           const Interrupt& interrupt) {
    if (ending == Termination::stopped || ending == Termination::time_limit) return;
    options.stop = interrupt.token();
    options.time_limit_s = interrupt.left_s();
    options.fixed = solved.fixed;
    options.threads = solved.threads;
    if (solved.loss.kind != LossKind::none)
      options.loss = {solved.loss.kind, summary.rounds.back().scale_px};
    Result<Covariance> told = covariance(problem, options);
    if (!told.ok())
      failed = told.error();
    else if (told.value().ending == CovarianceEnding::whole)
      found = std::move(told).value();
    else
      ending = told.value().ending == CovarianceEnding::stopped ? Termination::stopped
                                                                : Termination::time_limit;
  }

  // Points of the survey are gone with it by then.
  std::string write(const Problem& problem, const std::string& path) {
    found->points.resize(problem.num_points());
    write_json(covariance_json(problem, options, *found), path);
    return path;
  }
};

SigmasWork work_out_sigmas(const Arguments& arguments, const Problem& problem,
                           const SolveOptions& solved, const Summary& summary,
                           const Interrupt& interrupt) {
  SigmasWork sigmas;
  sigmas.ending = summary.termination;
  if (!arguments.sigmas.empty() && summary.usable())
    sigmas.run(problem, solved, summary, interrupt);
  return sigmas;
}

// Points of the survey leave the problem, and the summary what it says of their marks. What the
// page tells of precision is found before that.
void finish(const Arguments& arguments, const SolveOptions& options, SurveyWork& work,
            Problem& problem, Summary& summary) {
  if (!work.survey) return;
  if (!arguments.report.empty() && summary.usable())
    work.precision = report_precision(problem, page_options(arguments, options, summary));
  work.report = finish_survey(problem, *work.survey);
  if (work.precision) work.precision->points.resize(problem.num_points());
  const std::uint64_t own = problem.num_observations();
  for (auto* list : {&summary.behind_camera_before, &summary.behind_camera_after,
                     &summary.rejected_observations})
    std::erase_if(*list, [own](std::uint64_t i) { return i >= own; });
}

// The best state found, and what was written.
std::vector<std::string> write_results(const Arguments& arguments, const SurveyWork& work,
                                       Problem before, const Problem& after) {
  const Activity writing(arguments.common.quiet, "writing", &transfers.written);
  std::vector<std::string> written;
  if (!arguments.out.empty()) {
    write(after, arguments.out).value();
    written.push_back(arguments.out);
    if (work.survey)
      if (std::string frame =
              write_frame(*work.survey, write_format(after, arguments.out), arguments.out);
          !frame.empty())
        written.push_back(std::move(frame));
  }
  if (!arguments.constraints.residuals.empty()) {
    write_residuals(work.report, arguments.constraints.residuals);
    written.push_back(arguments.constraints.residuals);
  }
  if (!arguments.ply.empty()) {
    before.points.resize(after.points.size());
    before.observation_image = after.observation_image;
    before.observation_point = after.observation_point;
    before.observation_xy = after.observation_xy;
    write_ply(before, after, arguments.ply).value();
    written.push_back(arguments.ply);
  }
  return written;
}

// Whether the solver's final cost is what independent code has for the state, but for rounding.
// Observations that were left out count in neither.
bool agrees(const Summary& summary, const Evaluation& after, const Problem& problem) {
  constexpr double kRounding = 1e-9;
  // Where points lie in a camera's plane but for rounding, no two codes agree.
  constexpr double kAbsurd_px = 1e8;
  if (!summary.usable() || summary.final_rms_px > kAbsurd_px) return true;
  double cost = after.cost;
  if (!summary.rejected_observations.empty()) {
    Problem kept = problem;
    kept.metadata = nullptr;
    std::vector<bool> keep(problem.num_observations(), true);
    for (std::uint64_t i : summary.rejected_observations) keep[i] = false;
    keep_observations(kept, keep, 1);
    cost = evaluate(kept).cost;
  }
  return std::abs(cost - summary.final_plain_cost) <= kRounding * (cost + 1e-20);
}

Progress progress_of(const Arguments& arguments, const Interrupt& interrupt,
                     const Problem& problem) {
  const SolveOptions& asked = arguments.solve.options;
  return Progress(arguments.common.quiet,
                  {asked.max_iterations, asked.tolerance, interrupt.left_s()},
                  problem.num_observations());
}

SolveOptions options_for(const Arguments& arguments, const Interrupt& interrupt, Progress& progress,
                         StepLog& log) {
  SolveOptions options = arguments.solve.options;
  options.threads = arguments.common.threads;
  options.lend_observations = true;
  options.stop = interrupt.token();
  options.on_plan = [&](const Summary& summary) { progress.report_plan(summary); };
  options.on_iteration = [&](const Iteration& iteration) {
    progress.report(iteration);
    log.step(iteration);
    return true;
  };
  return options;
}

// What is said once all is written.
void say(const Arguments& arguments, const InputFile& input, const SolveRecord& record,
         const SurveyWork& work, const SigmasWork& sigmas, const Summary& summary,
         const std::string& held) {
  print_out("{}: {}\n", arguments.in, counts_text(input.problem));
  for (const std::string& note : input.notes) print_out("note        {}\n", note);
  if (work.survey) print_text(survey_text(*work.survey));
  if (arguments.common.threads > summary.threads)
    print_out("note        {} threads are more than the most, {}\n", arguments.common.threads,
              summary.threads);
  print_text(summary_text(summary, input.read_s));
  print_text(residuals_text(work.report));
  if (sigmas.found)
    print_text(covariance_text(input.problem, {}, *sigmas.found));
  else if (!arguments.sigmas.empty() && !sigmas.failed && summary.usable())
    print_out("note        no sigmas: the run was cut short\n");
  print_text(held);
  if (!record.agrees)
    print_out("wrong       independent code has the plain cost {:.9e} for this state, not {:.9e}\n",
              record.after.cost, summary.final_plain_cost);
}

// A checkpoint that is gone on from may be the one that is written.
std::vector<std::string> inputs_of(const Arguments& arguments) {
  const SolveOptions& options = arguments.solve.options;
  std::vector<std::string> own = {arguments.in, arguments.rigs.path};
  if (options.resume != options.checkpoint) own.push_back(options.resume);
  return with_survey(std::move(own), arguments.constraints);
}

std::vector<NamedOutput> outputs_of(const Arguments& arguments) {
  return {{"-o", arguments.out, true},    {"--json", arguments.common.json},
          {"--ply", arguments.ply},       {"--residuals", arguments.constraints.residuals},
          {"--sigmas", arguments.sigmas}, {"--checkpoint", arguments.solve.options.checkpoint},
          {"--log", arguments.log},       {"--report", arguments.report}};
}

// Of sigmas that were asked for and are missing no word may be lost: JSON's `sigmas`.
Json sigmas_json(const Arguments& arguments, const SigmasWork& sigmas) {
  if (arguments.sigmas.empty()) return nullptr;
  if (sigmas.found) return "written";
  return sigmas.failed ? "failed" : "cut short";
}

// JSON and page, which tell what became of the run.
void write_record(const Arguments& arguments, const SolveRecord& record, const SurveyWork& work,
                  const SigmasWork& sigmas, const SolveOptions& options, const Summary& summary,
                  Problem& start, const Problem& problem, std::vector<std::string>& written) {
  Json document = solve_json(record, summary, problem);
  document["survey"] = survey_json(work.survey, &work.report);
  document["sigmas"] = sigmas_json(arguments, sigmas);
  if (!arguments.common.json.empty()) {
    write_json(document, arguments.common.json);
    written.push_back(arguments.common.json);
  }
  if (arguments.report.empty() || !summary.usable()) return;
  ReportOptions page = page_options(arguments, options, summary);
  if (work.precision) page.precision = &*work.precision;
  write_page(arguments, std::move(start), problem, page, document);
  written.push_back(arguments.report);
}

int run(Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const bool wants_json = !arguments.common.json.empty() || !arguments.report.empty();
  check_outputs(outputs_of(arguments), inputs_of(arguments));
  interrupt.limit(arguments.solve.options.time_limit_s);
  InputFile input = read_input(arguments.in, arguments.common, wants_json);
  Problem& problem = input.problem;
  check_holds(problem, arguments.out);

  SolveRecord record;
  record.command = arguments.command();
  record.options = options_json(options_of(arguments.solve));
  record.read_s = input.read_s;
  if (wants_json) record.input = input_json(arguments.in, input);
  record.rig_configuration = lay_rigs(arguments.rigs, input, arguments.common.quiet);
  if (wants_json) record.before = evaluate(problem);

  Progress progress = progress_of(arguments, interrupt, problem);
  StepLog log(arguments.log);
  SolveOptions options = options_for(arguments, interrupt, progress, log);
  const std::string held = hold(arguments.solve.refinement, problem, options.fixed);
  if (options.max_iterations > 0) check_holds_refined(problem, options.fixed, arguments.out);
  const std::shared_ptr<const SceneMetadata> metadata = problem.metadata;
  SurveyWork work{place_survey(arguments.constraints, problem, options.fixed)};
  Problem before = arguments.ply.empty() ? Problem() : state_of(problem);
  Problem start = arguments.report.empty() ? Problem() : start_of(problem, metadata);
  interrupt.begin_solve();
  progress.begin();
  options.time_limit_s = interrupt.left_s();
  const double cpu_before_s = processor_seconds();
  Summary summary = try_solve(problem, options).value();
  record.cpu_s = processor_seconds() - cpu_before_s;
  progress.end();

  const Timer writing;
  record.after = evaluate(problem);
  record.agrees = agrees(summary, record.after, problem);
  SigmasWork sigmas = work_out_sigmas(arguments, problem, options, summary, interrupt);
  interrupt.begin_write();
  finish(arguments, options, work, problem, summary);
  if (work.survey) record.after = evaluate(problem);
  std::vector<std::string> written;
  if (summary.usable()) written = write_results(arguments, work, std::move(before), problem);
  if (sigmas.found) written.push_back(sigmas.write(problem, arguments.sigmas));
  record.write_s = writing.seconds();
  say(arguments, input, record, work, sigmas, summary, held);
  if (wants_json) {
    record.total_s = total.seconds();
    options.time_limit_s = interrupt.left_s();
    write_record(arguments, record, work, sigmas, options, summary, start, problem, written);
  }
  if (!written.empty()) print_out("wrote       {}\n", fmt::join(written, ", "));
  if (summary.usable() && !arguments.out.empty())
    print_losses(write_format(problem, arguments.out), problem);
  if (sigmas.failed) throw *sigmas.failed;
  log.end(summary);
  return exit_code_of(sigmas.ending);
}

}  // namespace

Verb solve_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"solve", "refine camera poses, intrinsics and points",
            "Example:\n  sheaf solve problem.txt -o refined.txt --json summary.json\n"
            "\nA COLMAP model, its first image in place and the principal point refined too:\n"
            "  sheaf solve model -o refined --fix pose=IMG_0001.jpg --refine pp\n"
            "\nOnly a new image's pose, all else as it is:\n"
            "  sheaf solve model -o refined --fix points,poses,intrinsics --refine pose=new.jpg"};
  verb.places = bound<Arguments>({F::text(&Arguments::in, problem_in())}, *a);
  verb.options =
      joined({bound<Arguments>(
                  {F::text(&Arguments::out,
                           {.name = "output",
                            .placeholder = "OUT",
                            .help = std::string("write the refined problem; ") + kProblemOut,
                            .short_name = "o"}),
                   F::text(&Arguments::ply, ply_of_two_states()),
                   F::text(&Arguments::sigmas,
                           {.name = "sigmas",
                            .placeholder = "FILE",
                            .help = "how well the end is known, as JSON (docs/covariance.md)"}),
                   F::text(&Arguments::report,
                           {.name = "report",
                            .placeholder = "FILE",
                            .help = "show start and result as one page of HTML (docs/report.md)"}),
                   F::text(&Arguments::images,
                           {.name = "images",
                            .placeholder = "FOLDER",
                            .help = "of --report: where the images are, for thumbnails",
                            .needs = {"report"}}),
                   F::text(&Arguments::log, log_of_steps())},
                  *a),
              own(options_of(a->solve)), options_of(a->rigs), options_of(a->constraints, true),
              options_of(a->common)});
  a->command = command_of(verb);
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
