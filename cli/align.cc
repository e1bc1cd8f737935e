// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "constraints_option.h"
#include "errors_document.h"
#include "interrupt.h"
#include "json_document.h"
#include "matching_document.h"
#include "outputs.h"
#include "read_input.h"
#include "report/errors.h"
#include "report/model_alignment.h"
#include "scene/similarity.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  ConstraintsArguments constraints;
  std::string in, out, reference, to, format;
  bool rigid = false, least_squares = false;
};

std::string name_of(const ModelAlignment& a, std::size_t k, const Problem& model) {
  return called(model, a.matching.images[k].estimate, a.matching.by);
}

void print(const Arguments& arguments, const ModelAlignment& a, const Problem& model,
           const Problem& reference) {
  constexpr std::size_t kMostSaid = 3;
  print_out("{} onto {}: {}\n{}", arguments.in, arguments.reference, counts_text(model),
            Lines{matching_text(a.matching, model, reference, "model", "reference")});
  const Similarity& S = a.similarity;
  print_out("aligned     by {} of {} camera centres\n", a.inliers, a.distances.size());
  print_out("scale       {}\n", S.scale);
  print_out("rotation    {} (w x y z)\n", fmt::join(S.rotation, " "));
  print_out("translation {}\n", fmt::join(S.translation, " "));
  const ErrorStatistics errors = statistics_of_errors(a.distances);
  print_out("centres     rms {:.6g}, median {:.6g}, largest {:.6g}, in units of the reference\n",
            errors.rms, errors.median, errors.max);
  std::vector<std::string> worst;
  for (const std::size_t k : worst_first(a))
    if (worst.size() < kMostSaid)
      worst.push_back(fmt::format("{} {:.6g}", name_of(a, k, model), a.distances[k]));
  print_out("worst       {}\n", fmt::join(worst, ", "));
}

Json worst_json(const ModelAlignment& a, const Problem& model) {
  constexpr std::size_t kMostListed = 10;
  Json out = Json::array();
  for (const std::size_t k : worst_first(a)) {
    if (out.size() == kMostListed) break;
    out.push_back({{"image", name_of(a, k, model)}, {"distance", number(a.distances[k])}});
  }
  return out;
}

Json alignment_json(const Arguments& arguments, const ModelAlignment& a) {
  return {{"scale", a.similarity.scale},
          {"rotation", a.similarity.rotation},
          {"translation", a.similarity.translation},
          {"rigid", arguments.rigid},
          {"robust", !arguments.least_squares},
          {"places", a.distances.size()},
          {"inliers", a.inliers}};
}

Json document_of(const Arguments& arguments, const ModelAlignment& a, const InputFile& model,
                 const InputFile& reference) {
  return {
      {"version", SHEAF_VERSION},
      {"input", input_json(arguments.in, model)},
      {"reference", input_json(arguments.reference, reference)},
      {"common", matching_json(a.matching, model.problem, reference.problem, "input", "reference")},
      {"alignment", alignment_json(arguments, a)},
      {"center_error", error_json(statistics_of_errors(a.distances))},
      {"worst", worst_json(a, model.problem)},
      {"survey", Json()}};
}

// By a survey there is no model to compare with.
Json document_of(const Survey& survey, const SurveyReport& report, const Json& input) {
  return {{"version", SHEAF_VERSION},
          {"input", input},
          {"reference", Json()},
          {"common", Json()},
          {"alignment",
           {{"scale", survey.scale},
            {"rotation", survey.rotation},
            {"translation", survey.translation},
            {"rigid", survey.rigid},
            {"robust", true},
            {"places", survey.ties},
            {"inliers", survey.ties - survey.outliers.size()}}},
          {"center_error", Json()},
          {"worst", Json::array()},
          {"survey", survey_json(survey, &report)}};
}

// What both ways end with.
struct Written {
  std::string format;
  double write_s = 0;
};

Written write_moved(const Arguments& arguments, const Problem& problem, Interrupt& interrupt) {
  validate(problem).value();
  Written out{arguments.format.empty() ? write_format(problem, arguments.out) : arguments.format};
  interrupt.begin_write();
  const Timer writing;
  write(problem, arguments.out, {.format = out.format}).value();
  out.write_s = writing.seconds();
  return out;
}

void finish(const Arguments& arguments, const Written& written, const Problem& problem,
            double read_s, const Timer& total, Json document) {
  print_out("wrote       {} ({})\n", arguments.out, written.format);
  print_losses(written.format, problem);
  if (arguments.common.json.empty()) return;
  document["output"] = {
      {"path", arguments.out}, {"format", written.format}, {"bytes", bytes_at(arguments.out)}};
  document["dropped"] = lost_in(written.format, problem);
  document["time"] = {
      {"read_s", read_s}, {"write_s", written.write_s}, {"total_s", total.seconds()}};
  write_json(document, arguments.common.json);
}

SurveyMotionOptions motion_options(const Arguments& arguments) {
  return {.by = arguments.to == "positions" ? SurveyTies::positions
                : arguments.to == "control" ? SurveyTies::control
                                            : SurveyTies::all,
          .rigid = arguments.rigid};
}

int run_to_survey(const Arguments& arguments, Interrupt& interrupt, const Timer& total) {
  InputFile model = read_input(arguments.in, arguments.common);
  const Json input = arguments.common.json.empty() ? Json() : input_json(arguments.in, model);
  const std::string counts = counts_text(model.problem);
  const Constraints constraints = read_constraints(arguments.constraints);
  const Survey survey =
      move_to_survey(model.problem, constraints, motion_options(arguments)).value();
  const SurveyReport report = finish_survey(model.problem, survey);
  const Written written = write_moved(arguments, model.problem, interrupt);
  const std::string frame = write_frame(survey, written.format, arguments.out);
  const std::string& residuals = arguments.constraints.residuals;
  if (!residuals.empty()) write_residuals(report, residuals);
  print_out("{}: {}\n{}{}", arguments.in, counts, Lines{survey_text(survey)},
            Lines{residuals_text(report)});
  for (const std::string& path : {frame, residuals})
    if (!path.empty()) print_out("wrote       {}\n", path);
  finish(arguments, written, model.problem, model.read_s, total,
         document_of(survey, report, input));
  return 0;
}

int run_to_reference(const Arguments& arguments, Interrupt& interrupt, const Timer& total) {
  InputFile model = read_input(arguments.in, arguments.common);
  const InputFile reference = read_input(arguments.reference, arguments.common);
  const ModelAlignmentOptions options{
      .robust = !arguments.least_squares,
      .scale = arguments.rigid ? AlignScale::one : AlignScale::free};
  const ModelAlignment found = align_models(model.problem, reference.problem, options).value();
  Json document = document_of(arguments, found, model, reference);
  move(model.problem, found.similarity);
  const Written written = write_moved(arguments, model.problem, interrupt);
  print(arguments, found, model.problem, reference.problem);
  finish(arguments, written, model.problem, model.read_s + reference.read_s, total,
         std::move(document));
  return 0;
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const bool by_survey = !arguments.constraints.paths.empty();
  if (arguments.out.empty()) throw Error(ErrorCode::usage, "where to? --output OUT");
  if (arguments.reference.empty() == !by_survey)
    throw Error(ErrorCode::usage, "onto what? --reference MODEL or --constraints FILE");
  if (!by_survey && !arguments.to.empty())
    throw Error(ErrorCode::usage, "--to is for --constraints");
  if (!by_survey && !arguments.constraints.residuals.empty())
    throw Error(ErrorCode::usage, "--residuals is for --constraints");
  if (by_survey && arguments.least_squares)
    throw Error(ErrorCode::usage, "--least-squares is for --reference");
  check_outputs({{"--output", arguments.out, true},
                 {"--json", arguments.common.json},
                 {"--residuals", arguments.constraints.residuals}},
                with_survey({arguments.in, arguments.reference}, arguments.constraints));
  return by_survey ? run_to_survey(arguments, interrupt, total)
                   : run_to_reference(arguments, interrupt, total);
}

std::vector<BoundOption> options_of(Arguments& a) {
  using F = FieldsOf<Arguments>;
  return bound<Arguments>(
      {F::text(&Arguments::out, {.name = "output",
                                 .placeholder = "OUT",
                                 .help = std::string("the moved model; ") + kProblemOut,
                                 .short_name = "o"}),
       F::text(&Arguments::reference,
               {.name = "reference",
                .placeholder = "MODEL",
                .help = "the model whose frame and scale it takes: a file or folder"}),
       F::name(&Arguments::to, {{"positions", "those of images"}, {"control", "control points"}},
               {.name = "to",
                .placeholder = "NAME",
                .nothing = true,
                .help = "which of --constraints the motion is found by; by default all; the others "
                        "are only measured"}),
       F::flag(&Arguments::rigid,
               {.name = "rigid", .help = "turn and shift alone: the scale stays as it is"}),
       F::flag(&Arguments::least_squares,
               {.name = "least-squares",
                .help = "all common images count alike; otherwise those that are far off do not"}),
       F::name(&Arguments::format, problem_formats(), problem_format())},
      a);
}

}  // namespace

Verb align_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"align", "bring a model into the frame of another one, or of a survey",
            "Example:\n  sheaf align problem.txt -o aligned.txt --reference problem.txt\n"
            "\nOnto the model of a survey, whose scale is in metres:\n"
            "  sheaf align model/ -o placed --reference survey/ --json placed.json\n"
            "\nTo where the GPS of its images says that they were taken, without a solve:\n"
            "  sheaf align model/ -o placed --to positions --constraints images/"};
  verb.places = bound<Arguments>({F::text(&Arguments::in, problem_in())}, *a);
  verb.options = joined({options_of(*a), options_of(a->constraints, true), options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
