// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "constraints_option.h"
#include "covariance_document.h"
#include "covariance_fields.h"
#include "exit_code.h"
#include "interrupt.h"
#include "json_document.h"
#include "options/refinement.h"
#include "outputs.h"
#include "projection_option.h"
#include "read_input.h"
#include "rigs_option.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "survey/image_names.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  CovarianceOptions covariance;
  RefinementArguments refinement;
  RigsArguments rigs;
  ConstraintsArguments constraints;
  ProjectionArguments projection;
  std::vector<std::string> points, poses, pairs;
  std::string in, csv;
};

/// Ids as the file has them, by index where it has none.
std::vector<std::uint32_t> points_named(const std::vector<std::string>& names,
                                        const Problem& problem) {
  std::vector<std::uint32_t> out;
  const SceneMetadata* m = problem.metadata.get();
  for (const std::string& name : names) {
    std::uint64_t id = 0;
    const auto [end, wrong] = std::from_chars(name.data(), name.data() + name.size(), id);
    if (wrong != std::errc() || end != name.data() + name.size())
      throw Error(ErrorCode::usage,
                  "--points: found '" + name + "', expected all, none or ids of points");
    std::size_t index = id;
    if (m != nullptr && !m->point_ids.empty())
      index = static_cast<std::size_t>(std::find(m->point_ids.begin(), m->point_ids.end(), id) -
                                       m->point_ids.begin());
    if (index >= problem.num_points())
      throw Error(ErrorCode::usage, "--points: the model has no point " + name);
    out.push_back(static_cast<std::uint32_t>(index));
  }
  return out;
}

/// all (what is told of them as a whole), none, or those named, one by one.
void choose_points(const Arguments& arguments, const Problem& problem, CovarianceOptions& options) {
  if (arguments.points.empty() || arguments.points == std::vector<std::string>{"all"}) return;
  if (arguments.points == std::vector<std::string>{"none"}) {
    options.points = false;
    return;
  }
  options.point_ids = points_named(arguments.points, problem);
}

std::vector<std::uint32_t> images_named(const char* option, const std::vector<std::string>& names,
                                        const Problem& problem) {
  const ImageNames images(problem);
  std::vector<std::uint32_t> out;
  for (const std::string& name : names) {
    out.push_back(images.find(name));
    if (out.back() == Survey::kNone)
      throw Error(ErrorCode::usage,
                  std::string(option) + ": no image of the model is called " + name);
  }
  return out;
}

void choose_images(const Arguments& arguments, const Problem& problem, CovarianceOptions& options) {
  if (arguments.poses != std::vector<std::string>{"all"})
    options.image_ids = images_named("--poses", arguments.poses, problem);
  if (arguments.pairs.size() % 2 != 0)
    throw Error(ErrorCode::usage, "--pairs: found " + std::to_string(arguments.pairs.size()) +
                                      " images, expected two for each pair");
  const std::vector<std::uint32_t> ends = images_named("--pairs", arguments.pairs, problem);
  for (std::size_t k = 0; k < ends.size(); k += 2)
    options.image_pairs.push_back({ends[k], ends[k + 1]});
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  check_outputs({{"--json", json},
                 {"--csv", arguments.csv},
                 {"--projection", arguments.projection.csv},
                 {"--projection-figure", arguments.projection.figure}},
                with_survey({arguments.in, arguments.rigs.path}, arguments.constraints));
  interrupt.limit(arguments.covariance.time_limit_s);
  InputFile input = read_input(arguments.in, arguments.common);
  Problem& problem = input.problem;
  lay_rigs(arguments.rigs, input, arguments.common.quiet);
  CovarianceOptions options = arguments.covariance;
  options.threads = arguments.common.threads;
  choose_points(arguments, problem, options);
  choose_images(arguments, problem, options);
  options.lens_motions = arguments.projection.asked();
  if (arguments.refinement.given())
    options.fixed = fixed_of(refinement_of(arguments.refinement, problem).value(), problem);
  const std::optional<Survey> survey = place_survey(arguments.constraints, problem, options.fixed);
  interrupt.begin_compute();
  options.stop = interrupt.token();
  options.time_limit_s = interrupt.left_s();
  const Covariance found = covariance(problem, options).value();
  if (found.ending != CovarianceEnding::whole) {
    if (!arguments.common.quiet) print_err("the time limit was reached: nothing is written\n");
    return exit_code_of(found.ending);
  }
  interrupt.begin_write();
  print_out("{}: {}\n", arguments.in, counts_text(input.problem));
  if (survey) print_text(survey_text(*survey));
  const std::vector<LensProjection> projected = projections(arguments.projection, problem, found);
  print_out("{}{}time        {:.3f} s\n", Lines{covariance_text(problem, options, found)},
            Lines{projection_text(projected)}, found.seconds);
  if (!arguments.csv.empty()) {
    write_text(covariance_csv(problem, options, found), arguments.csv);
    print_out("wrote       {}\n", arguments.csv);
  }
  write_projections(arguments.projection, problem, projected);
  if (json.empty()) return 0;
  Json document = covariance_json(problem, options, found);
  document["projection"] = projection_json(projected);
  document["version"] = SHEAF_VERSION;
  document["input"] = input_json(arguments.in, input);
  document["time"] = {
      {"read_s", input.read_s}, {"covariance_s", found.seconds}, {"total_s", total.seconds()}};
  write_json(document, json);
  return 0;
}

std::vector<BoundOption> options_of(Arguments& a) {
  using F = FieldsOf<Arguments>;
  const auto own_options = bound<Arguments>(
      {F::list(&Arguments::points,
               {.name = "points",
                .placeholder = "IDS",
                .help = "points to tell of one by one, by their ids; all: of all together (the "
                        "default); none"}),
       F::list(&Arguments::poses, {.name = "poses",
                                   .placeholder = "NAMES",
                                   .help = "images to tell of, by their names; all: the default"}),
       F::list(&Arguments::pairs,
               {.name = "pairs",
                .placeholder = "A,B,C,D...",
                .help = "pairs of images (A with B, C with D) whose common covariance is told, and "
                        "how well the distance between them is known"}),
       F::text(&Arguments::csv,
               {.name = "csv", .placeholder = "FILE", .help = "a line for each parameter"})},
      a);
  return joined({bound(covariance_fields(), a.covariance), own_options,
                 own(bound(refinement_fields("what has no covariance"), a.refinement))});
}

}  // namespace

Verb covariance_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"covariance", "tell how well a state is known, which should be an optimum",
            "Example:\n  sheaf covariance problem.txt --json sigmas.json\n"
            "\nWhat its lens and three of its points are known to, in the gauge of two images:\n"
            "  sheaf covariance model --gauge first-two --points 4711,4712,4713 --csv sigmas.csv\n"
            "\nHow well a calibration knows where its lens looks, far away and at 2 m:\n"
            "  sheaf covariance boards --fix points --projection sigmas.csv --distance 2"};
  verb.places = bound<Arguments>({F::text(&Arguments::in, problem_in())}, *a);
  verb.options = joined({options_of(*a), options_of(a->rigs), options_of(a->constraints, false),
                         options_of(a->projection), options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
