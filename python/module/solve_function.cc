// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/stl/string.h>
#include <unistd.h>

#include <atomic>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bindings.h"
#include "fork_safety.h"
#include "keyword_options.h"
#include "options/solve_options.h"
#include "running.h"
#include "summary_object.h"
#include "survey_use.h"

namespace sheaf {
namespace {

/// Observations are lent to the solver by themselves wherever nobody can look at them meanwhile.
std::vector<BoundOption> own_options(SolveArguments& arguments) {
  return without(options_of(arguments), {"lend-observations"});
}

/// State and rigs, but no vector moves: views go on looking at them.
void put_in_place(const Problem& from, Problem& to) {
  std::copy(from.poses.begin(), from.poses.end(), to.poses.begin());
  std::copy(from.cameras.begin(), from.cameras.end(), to.cameras.begin());
  std::copy(from.points.begin(), from.points.end(), to.points.begin());
  std::copy(from.rigs.sensor_from_rig.begin(), from.rigs.sensor_from_rig.end(),
            to.rigs.sensor_from_rig.begin());
  std::copy(from.rigs.rig_from_world.begin(), from.rigs.rig_from_world.end(),
            to.rigs.rig_from_world.begin());
  to.terms = from.terms;
}

struct SurveyedSolve {
  Summary summary;
  std::optional<Survey> survey;
  SurveyReport report;
};

/// As the command does it: the survey's points and terms take part, and leave again.
SurveyedSolve run_solve(Problem& problem, const SolveOptions& options,
                        const std::optional<Constraints>& constraints) {
  SurveyedSolve out;
  if (constraints) out.survey = place_survey(problem, *constraints, options.fixed).value();
  Result<Summary> solved = try_solve(problem, options);
  if (solved.ok()) out.summary = std::move(solved).value();
  if (out.survey) {
    out.report = finish_survey(problem, *out.survey);
    const std::uint64_t own = problem.num_observations();
    for (auto* list : {&out.summary.behind_camera_before, &out.summary.behind_camera_after,
                       &out.summary.rejected_observations})
      std::erase_if(*list, [own](std::uint64_t i) { return i >= own; });
  }
  solved.value();
  return out;
}

nb::object solve_problem(const ProblemHandle& held, const nb::kwargs& keywords) {
  nb::dict left = nb::cast<nb::dict>(keywords.attr("copy")());
  const auto take = [&](const char* name) -> nb::object {
    return left.attr("pop")(name, nb::none());
  };
  const std::optional<Constraints> constraints = constraints_from(take("constraints"));
  Run run(take("callback"));
  SolveArguments arguments;
  take_options(left, own_options(arguments));
  check_all_taken(left, "solve");

  WriteUse use(held);
  SolveOptions& options = arguments.options;
  if (arguments.refinement.given())
    options.fixed =
        fixed_of(refinement_of(arguments.refinement, use.problem()).value(), use.problem());
  options.stop = run.token();
  options.threads = threads_here(options.threads);
  options.on_iteration = [&](const Iteration& iteration) { return run.report(iteration); };
  // A survey adds points and marks for a while, which views would not live through.
  const bool alone = !run.has_callback() && use.alone();
  const bool on_copy = constraints && !alone;
  options.lend_observations = alone;
  SurveyedSolve solved;
  run.go([&] {
    if (on_copy) {
      Problem copy = use.problem();
      solved = run_solve(copy, options, constraints);
      put_in_place(copy, use.problem());
    } else {
      solved = run_solve(use.problem(), options, constraints);
    }
  });
  nb::dict fields = fields_of(solved.summary);
  fields["survey"] = survey_object(solved.survey, &solved.report);
  return nb::module_::import_("sheaf._summary").attr("Summary")(**fields);
}

constexpr const char* kSolveText =
    R"(Refines the problem in place: the command 'sheaf solve' as a function.

  callback: called with each Iteration, index 0 being the start; returning False ends the run with
    the best state found, and an exception does so too and comes out unchanged
  constraints: a survey: a path, several, or a dict as survey.json has it (docs/constraints.md)

Without the interpreter's lock; Ctrl-C ends the run within one evaluation, the best state stored.
Returns a sheaf.Summary. Raises sheaf.Error (docs/python.md).

Options, as docs/options.md has them:)";

}  // namespace

void bind_solve(nb::module_& module) {
  SolveArguments fresh;
  const std::vector<BoundOption> options = own_options(fresh);
  const std::string signature =
      signature_of("solve", "problem: Problem",
                   {"constraints: sheaf._records.ConstraintsLike = None",
                    "callback: collections.abc.Callable[[Iteration], bool | None] | None = None"},
                   options, "sheaf._summary.Summary");
  const std::string text = kSolveText + help_of(options);
  module.def("solve", &solve_problem, nb::arg("problem"), nb::arg("options"),
             nb::sig(signature.c_str()), text.c_str());
}

}  // namespace sheaf
