// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "errors_document.h"
#include "interrupt.h"
#include "json_document.h"
#include "matching_document.h"
#include "outputs.h"
#include "report/errors.h"
#include "report/model_alignment.h"
#include "scene/similarity.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  std::string in, out, reference, format;
  bool rigid = false, least_squares = false;
};

std::string name_of(const ModelAlignment& a, std::size_t k, const Problem& model) {
  return called(model, a.matching.images[k].estimate, a.matching.by);
}

void print(const Arguments& arguments, const ModelAlignment& a, const Problem& model,
           const Problem& reference) {
  constexpr std::size_t kMostSaid = 3;
  fmt::print("{} onto {}: {}\n{}", arguments.in, arguments.reference, counts_text(model),
             matching_text(a.matching, model, reference, "model", "reference"));
  const Similarity& S = a.similarity;
  fmt::print("aligned     by {} of {} camera centres\n", a.inliers, a.distances.size());
  fmt::print("scale       {}\n", S.scale);
  fmt::print("rotation    {} (w x y z)\n", fmt::join(S.rotation, " "));
  fmt::print("translation {}\n", fmt::join(S.translation, " "));
  const ErrorStatistics errors = statistics_of_errors(a.distances);
  fmt::print("centres     rms {:.6g}, median {:.6g}, largest {:.6g}, in units of the reference\n",
             errors.rms, errors.median, errors.max);
  std::vector<std::string> worst;
  for (const std::size_t k : worst_first(a))
    if (worst.size() < kMostSaid)
      worst.push_back(fmt::format("{} {:.6g}", name_of(a, k, model), a.distances[k]));
  fmt::print("worst       {}\n", fmt::join(worst, ", "));
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
      {"worst", worst_json(a, model.problem)}};
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  if (arguments.out.empty()) throw Error(ErrorCode::usage, "where to? --output OUT");
  if (arguments.reference.empty()) throw Error(ErrorCode::usage, "onto what? --reference MODEL");
  check_outputs({{"--output", arguments.out, true}, {"--json", json}});
  const ReadOptions hash{.hash = !json.empty()};
  InputFile model = read_file(arguments.in, hash).value();
  const InputFile reference = read_file(arguments.reference, hash).value();
  const ModelAlignmentOptions options{
      .robust = !arguments.least_squares,
      .scale = arguments.rigid ? AlignScale::one : AlignScale::free};
  const ModelAlignment found = align_models(model.problem, reference.problem, options).value();
  Json document = document_of(arguments, found, model, reference);
  move(model.problem, found.similarity);
  validate(model.problem).value();
  const std::string format =
      arguments.format.empty() ? write_format(model.problem, arguments.out) : arguments.format;
  interrupt.begin_write();
  const Timer writing;
  write(model.problem, arguments.out, {.format = format}).value();
  const double write_s = writing.seconds();
  print(arguments, found, model.problem, reference.problem);
  fmt::print("wrote       {} ({})\n", arguments.out, format);
  print_losses(format, model.problem);
  if (json.empty()) return 0;
  document["output"] = {
      {"path", arguments.out}, {"format", format}, {"bytes", bytes_at(arguments.out)}};
  document["dropped"] = lost_in(format, model.problem);
  document["time"] = {{"read_s", model.read_s + reference.read_s},
                      {"write_s", write_s},
                      {"total_s", total.seconds()}};
  write_json(document, json);
  return 0;
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
  Verb verb{"align", "bring a model into the frame of another one by their common images",
            "Example:\n  sheaf align problem.txt -o aligned.txt --reference problem.txt\n"
            "\nOnto the model of a survey, whose scale is in metres:\n"
            "  sheaf align model/ -o placed --reference survey/ --json placed.json"};
  verb.places = bound<Arguments>({F::text(&Arguments::in, problem_in())}, *a);
  verb.options = joined({options_of(*a), options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
