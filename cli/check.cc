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
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

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

/// Parameters of lenses that measurements good to a pixel would not determine, where that is told
/// in a moment; nothing where the state is too bad to tell.
std::optional<Finding> weak_lenses(const Problem& problem, int threads) {
  constexpr std::size_t kMostImages = 500, kMostObservations = 200000, kShown = 4;
  if (problem.num_images() > kMostImages || problem.num_observations() > kMostObservations ||
      problem.num_observations() == 0)
    return {};
  CovarianceOptions options;
  options.sigma = 1;
  options.points = false;
  options.threads = threads;
  const Result<Covariance> found = covariance(problem, options);
  if (!found.ok() || found.value().weak.empty()) return {};
  Finding out{"weak-lenses", false, 0, "lenses", {}, ""};
  std::vector<std::string> worst;
  for (const WeakDirection& weak : found.value().weak) {
    if (std::find(out.first.begin(), out.first.end(), weak.camera) == out.first.end())
      out.first.push_back(weak.camera);
    if (worst.size() < kShown) worst.push_back(weak.words);
  }
  out.count = out.first.size();
  constexpr std::size_t kMostListed = 1000;
  out.first.resize(std::min(out.first.size(), kMostListed));
  out.words = fmt::format(
      "{} {} parameters that measurements with a sigma of 1 px would not determine: {}{}; "
      "hold them (--fix), share the lens, or take images that cover it (docs/covariance.md)",
      plural(out.count, "lens", "lenses"), out.count == 1 ? "has" : "have", fmt::join(worst, "; "),
      found.value().weak.size() > kShown ? " ..." : "");
  return out;
}

int run(const Arguments& arguments) {
  const Timer total;
  const std::string& json = arguments.common.json;
  check_outputs({{"--json", json}}, with_survey({arguments.in}, arguments.constraints));
  const InputFile input = read_file(arguments.in, {.hash = !json.empty()}).value();
  std::vector<Finding> findings = check(input.problem);
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
