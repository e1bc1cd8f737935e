// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

#include "errors_document.h"
#include "interrupt.h"
#include "json_document.h"
#include "matching_document.h"
#include "outputs.h"
#include "read_input.h"
#include "report/errors.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  std::string estimate, reference, csv;
  bool no_align = false, robust = false;
};

void write_csv(const ErrorLists& lists, const std::string& path) {
  write_text(errors_csv(lists), path);
}

Json alignment_json(const StateAlignment& a) {
  if (!a.aligned) return {};
  return {{"rotation", a.similarity.rotation},
          {"translation", a.similarity.translation},
          {"by", a.by_points ? "points" : "centers"},
          {"places", a.places},
          {"inliers", a.inliers}};
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  check_outputs({{"--csv", arguments.csv}, {"--json", json}},
                {arguments.estimate, arguments.reference});
  const InputFile estimate = read_input(arguments.estimate, arguments.common);
  const InputFile reference = read_input(arguments.reference, arguments.common);
  const AlignBy align_by = arguments.no_align ? AlignBy::nothing
                           : arguments.robust ? AlignBy::robust
                                              : AlignBy::least_squares;
  const ErrorLists lists = list_errors(estimate.problem, reference.problem, align_by).value();
  if (!arguments.no_align && !lists.alignment.aligned && !arguments.common.quiet)
    print_text("neither camera centres nor points determine an alignment: compared as they are\n",
               stderr);
  interrupt.begin_write();
  if (!arguments.csv.empty()) write_csv(lists, arguments.csv);
  print_out("{} against {}: {}\n{}{}", arguments.estimate, arguments.reference,
            counts_text(estimate.problem),
            Lines{matching_text(lists.matching, estimate.problem, reference.problem, "estimate",
                                "reference")},
            Lines{errors_text(lists)});
  if (json.empty()) return 0;
  Json document = {{"version", SHEAF_VERSION},
                   {"estimate", input_json(arguments.estimate, estimate)},
                   {"reference", input_json(arguments.reference, reference)},
                   {"common", matching_json(lists.matching, estimate.problem, reference.problem,
                                            "estimate", "reference")}};
  document.update(errors_json(summarise(lists)));
  document["alignment"] = alignment_json(lists.alignment);
  document["time"] = {{"read_s", estimate.read_s + reference.read_s}, {"total_s", total.seconds()}};
  write_json(document, json);
  return 0;
}

}  // namespace

Verb evaluate_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"evaluate", "how far an estimate's poses and points are from a reference",
            "Example:\n  sheaf evaluate problem.txt problem.txt --csv errors.csv\n"
            "\nHow far a solution is from the truth of a generated scene:\n"
            "  sheaf evaluate refined.txt truth.txt --json errors.json"};
  verb.places = bound<Arguments>(
      {F::text(&Arguments::estimate, {.name = "EST",
                                      .placeholder = "FILE",
                                      .help = "estimate: a file or folder, as in convert"}),
       F::text(&Arguments::reference,
               {.name = "REF",
                .placeholder = "FILE",
                .help = "reference; what both have is compared, and lengths are in its units"})},
      *a);
  verb.options = joined(
      {bound<Arguments>(
           {F::flag(&Arguments::no_align,
                    {.name = "no-align",
                     .help = "compare as they are; otherwise the Sim(3) that brings the camera "
                             "centres together best is applied first"}),
            F::flag(&Arguments::robust,
                    {.name = "robust",
                     .help = "align so that images that are far off do not count",
                     .excludes = {"no-align"}}),
            F::text(
                &Arguments::csv,
                {.name = "csv", .placeholder = "FILE", .help = "also write each image's errors"})},
           *a),
       options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
