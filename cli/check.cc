// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/check.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "constraints_option.h"
#include "json_document.h"
#include "outputs.h"
#include "read_input.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"
#include "weak_lenses.h"

namespace sheaf {
namespace {

constexpr const char* kObservations = "observations";

struct Arguments {
  CommonOptions common;
  ConstraintsArguments constraints;
  std::string in;
};

// "images 3, 17, 18 ...", "observations 4 (image 0, point 2) ..."
std::string places_text(const Finding& finding, const Problem& problem) {
  constexpr std::size_t kShown = 8;
  std::string out;
  for (std::size_t k = 0; k < std::min(finding.first.size(), kShown); ++k) {
    const std::uint64_t i = finding.first[k];
    out += fmt::format("{}{}", k == 0 ? " " : ", ", i);
    if (finding.of == kObservations)
      out += fmt::format(" (image {}, point {})", problem.observation_image[i],
                         problem.observation_point[i]);
  }
  if (out.empty()) return out;
  return fmt::format("            {}{}{}\n", finding.of, out, finding.count > kShown ? " ..." : "");
}

Json finding_json(const Finding& f, const Problem& problem) {
  Json images = Json::array(), points = Json::array();
  if (f.of == kObservations)
    for (const std::uint64_t i : f.first) {
      images.push_back(problem.observation_image[i]);
      points.push_back(problem.observation_point[i]);
    }
  return {{"code", f.code},   {"grave", f.grave}, {"count", f.count}, {"of", f.of},
          {"first", f.first}, {"images", images}, {"points", points}, {"words", f.words}};
}

int run(const Arguments& arguments) {
  const Timer total;
  const std::string& json = arguments.common.json;
  check_outputs({{"--json", json}}, with_survey({arguments.in}, arguments.constraints));
  const InputFile input = read_input(arguments.in, arguments.common);
  std::vector<Finding> findings = check(input.problem, arguments.common.threads);
  if (auto weak = weak_lenses(input.problem, arguments.common.threads))
    findings.push_back(*std::move(weak));
  print_out("{}: {}\n", arguments.in, counts_text(input.problem));
  for (const std::string& note : input.notes) print_out("note        {}\n", note);
  for (const Finding& finding : findings)
    print_out("{}  {}\n{}", finding.grave ? "wrong     " : "note      ", finding.words,
              Lines{places_text(finding, input.problem)});
  if (findings.empty()) print_out("nothing that looks wrong\n");
  // On a copy: a survey moves the problem, whose findings are of the file.
  Problem placed = arguments.constraints.paths.empty() ? Problem() : input.problem;
  const std::optional<Survey> survey = place_survey(arguments.constraints, placed, {});
  if (survey) print_text(survey_text(*survey));
  if (json.empty()) return 0;
  Json list = Json::array();
  for (const Finding& finding : findings) list.push_back(finding_json(finding, input.problem));
  write_json({{"version", SHEAF_VERSION},
              {"input", input_json(arguments.in, input)},
              {"findings", list},
              {"survey", survey_json(survey, nullptr)},
              {"time", {{"read_s", input.read_s}, {"total_s", total.seconds()}}}},
             json);
  return 0;
}

}  // namespace

Verb check_verb() {
  auto a = std::make_shared<Arguments>();
  Verb verb{"check", "what is wrong with a problem, and what to do",
            "Example:\n  sheaf check problem.txt --json check.json"};
  verb.places = bound<Arguments>({FieldsOf<Arguments>::text(&Arguments::in, problem_in())}, *a);
  verb.options = joined({options_of(a->constraints, false), options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
