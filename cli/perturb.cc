// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <string>

#include "interrupt.h"
#include "json_document.h"
#include "noise_document.h"
#include "options/noise_options.h"
#include "outputs.h"
#include "read_input.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  NoiseOptions noise;
  std::string in, out;
};

/// What the noise did to a problem.
struct Effect {
  NoiseRecord record;
  Evaluation before, after;
};

void print(const Arguments& arguments, const Problem& problem, const NoiseOptions& noise,
           const Effect& effect) {
  print_out("{}: {}\n", arguments.in, counts_text(problem));
  if (noise.normalize_to > 0) {
    const auto& [center, scale] = effect.record.normalization;
    print_out("normalised  moved by {:.6g} {:.6g} {:.6g}, scaled by {:.6g}\n", -center[0],
              -center[1], -center[2], scale);
  }
  print_out("noise       {}\n", noise_text(noise));
  if (!effect.record.outliers.empty())
    print_out("outliers    {} observations moved by {:.6g} px\n", effect.record.outliers.size(),
              noise.outlier_px);
  if (noise.least_depth > 0)
    print_out("left out    {} observations and {} points nearer than {:.6g}\n",
              effect.record.dropped_observations, effect.record.dropped_points, noise.least_depth);
  print_out("cost        {:.9e} -> {:.9e}\n", effect.before.cost, effect.after.cost);
  print_out("rms         {:.6g} -> {:.6g} px\n", effect.before.rms_px, effect.after.rms_px);
  print_out("wrote       {}\n", arguments.out);
  print_losses(write_format(problem, arguments.out), problem);
}

Json document_of(const Arguments& arguments, const NoiseOptions& noise, const Json& input,
                 const Problem& problem, const Effect& effect) {
  const NoiseRecord& record = effect.record;
  Json normalization;
  if (noise.normalize_to > 0)
    normalization = {{"center", record.normalization.center},
                     {"scale", record.normalization.scale}};
  Json document = {{"version", SHEAF_VERSION}, {"input", input}};
  document["options"] = noise_json(noise);
  document["output"] = {{"path", arguments.out}, {"bytes", bytes_at(arguments.out)}};
  document["output"].update(counts_json(problem));
  document["normalization"] = normalization;
  document["outliers"] = observations_json(record.outliers, problem);
  document["dropped"] = {{"observations", record.dropped_observations},
                         {"points", record.dropped_points}};
  document["cost"] = {{"before", number(effect.before.cost)}, {"after", number(effect.after.cost)}};
  document["rms_px"] = {{"before", number(effect.before.rms_px)},
                        {"after", number(effect.after.rms_px)}};
  return document;
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  check_outputs({{"OUT", arguments.out, true}, {"--json", json}}, {arguments.in});
  const NoiseOptions& noise = arguments.noise;
  InputFile input = read_input(arguments.in, arguments.common);
  const Json before = input_json(arguments.in, input);
  Effect effect;
  effect.before = evaluate(input.problem);
  effect.record = perturb(input.problem, noise).value();
  effect.after = evaluate(input.problem);
  interrupt.begin_write();
  const Timer writing;
  write(input.problem, arguments.out).value();
  const double write_s = writing.seconds();
  print(arguments, input.problem, noise, effect);
  if (json.empty()) return 0;
  Json document = document_of(arguments, noise, before, input.problem, effect);
  document["time"] = {{"read_s", input.read_s}, {"write_s", write_s}, {"total_s", total.seconds()}};
  write_json(document, json);
  return 0;
}

}  // namespace

Verb perturb_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{
      "perturb", "add noise and outliers to a problem",
      "Example:\n  sheaf perturb problem.txt start.txt --rotation 0.01 --center 0.05 --pixel 0.5 "
      "--seed 7\n"
      "\nAs rootba's published experiments start (the numbers drawn are Sheaf's own):\n"
      "  sheaf perturb problem.txt start.txt --protocol rootba\n"
      "\nEvery tenth measurement wrong by 50 px:\n"
      "  sheaf perturb problem.txt start.txt --outliers 0.1 --outlier-size 50"};
  verb.places = bound<Arguments>(
      {F::text(&Arguments::in, problem_in()),
       F::text(&Arguments::out, {.name = "OUT",
                                 .placeholder = "FILE",
                                 .help = std::string("the disturbed problem; ") + kProblemOut})},
      *a);
  verb.options = joined({bound(noise_fields(), a->noise), options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
