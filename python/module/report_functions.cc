// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "errors_document.h"
#include "fork_safety.h"
#include "inspect/check.h"
#include "report/errors.h"
#include "report/model_alignment.h"
#include "scene/similarity.h"
#include "survey_use.h"
#include "weak_lenses.h"

namespace sheaf {
namespace {

nb::object record(const char* name) { return nb::module_::import_("sheaf._records").attr(name); }

/// (common, 2): index in the estimate and in the reference.
nb::object pairs_of(const std::vector<Matching::Pair>& pairs) {
  std::vector<std::uint64_t> flat;
  for (const Matching::Pair& pair : pairs) {
    flat.push_back(pair.estimate);
    flat.push_back(pair.reference);
  }
  return array_of(flat).attr("reshape")(-1, 2);
}

nb::object similarity_of(const Similarity& S) {
  return record("Similarity")(S.scale, array_of(S.rotation.data(), {4}),
                              array_of(S.translation.data(), {3}));
}

nb::object evaluate_errors(const ProblemHandle& estimate, const ProblemHandle& reference,
                           bool no_align, bool robust) {
  if (no_align && robust) throw Error(ErrorCode::usage, "robust goes not with no_align");
  const ReadUse of_estimate(estimate), of_reference(reference);
  std::optional<ErrorLists> lists;
  {
    const nb::gil_scoped_release released;
    const AlignBy by = no_align ? AlignBy::nothing
                       : robust ? AlignBy::robust
                                : AlignBy::least_squares;
    lists = list_errors(of_estimate.problem(), of_reference.problem(), by).value();
  }
  const StateAlignment& a = lists->alignment;
  return record("Errors")(array_of(lists->rotation_rad, {lists->rotation_rad.size()}),
                          array_of(lists->translation, {lists->translation.size()}),
                          array_of(lists->center, {lists->center.size()}),
                          array_of(lists->point, {lists->point.size()}),
                          pairs_of(lists->matching.images), pairs_of(lists->matching.points),
                          a.aligned ? similarity_of(a.similarity) : nb::none(),
                          object_of_json(errors_json(summarise(*lists)).dump()));
}

nb::list check_problem(const ProblemHandle& held, int threads) {
  const ReadUse use(held);
  std::vector<Finding> findings;
  {
    const nb::gil_scoped_release released;
    findings = check(use.problem(), threads_here(threads));
    if (auto weak = weak_lenses(use.problem(), threads_here(threads)))
      findings.push_back(*std::move(weak));
  }
  nb::list out;
  for (const Finding& f : findings)
    out.append(record("Finding")(f.code, f.grave, f.count, f.of, array_of(f.first), f.words));
  return out;
}

nb::object align_to_model(const ProblemHandle& held, const ProblemHandle& reference, bool rigid,
                          bool least_squares) {
  const WriteUse use(held);
  const ReadUse onto(reference);
  std::optional<ModelAlignment> found;
  {
    const nb::gil_scoped_release released;
    found = align_models(
                use.problem(), onto.problem(),
                {.robust = !least_squares, .scale = rigid ? AlignScale::one : AlignScale::free})
                .value();
    move(use.problem(), found->similarity);
  }
  return record("Alignment")(similarity_of(found->similarity), found->inliers,
                             pairs_of(found->matching.images),
                             array_of(found->distances, {found->distances.size()}), nb::none());
}

SurveyTies ties_named(const std::string& to) {
  if (to == "all") return SurveyTies::all;
  if (to == "positions") return SurveyTies::positions;
  if (to == "control") return SurveyTies::control;
  throw Error(ErrorCode::usage, "to: expected all, positions or control, not '" + to + "'");
}

nb::object align_to_survey(const ProblemHandle& held, const Constraints& constraints,
                           const std::string& to, bool rigid) {
  WriteUse use(held);
  use.resize("align with constraints");
  const SurveyMotionOptions options{.by = ties_named(to), .rigid = rigid};
  std::optional<Survey> survey;
  SurveyReport report;
  {
    const nb::gil_scoped_release released;
    survey = move_to_survey(use.problem(), constraints, options).value();
    report = finish_survey(use.problem(), *survey);
  }
  const Similarity S{survey->scale, survey->rotation, survey->translation};
  return record("Alignment")(similarity_of(S), survey->ties - survey->outliers.size(), pairs_of({}),
                             array_of(nullptr, {0}), survey_object(survey, &report));
}

nb::object align_problem(const ProblemHandle& held, nb::handle reference, nb::handle constraints,
                         bool rigid, bool least_squares, const std::string& to) {
  if (reference.is_none() == constraints.is_none())
    throw Error(ErrorCode::usage, "onto what? reference or constraints");
  if (!reference.is_none()) {
    if (to != "all") throw Error(ErrorCode::usage, "to is for constraints");
    ProblemHandle onto = nb::cast<ProblemHandle>(reference);
    if (onto.get() == held.get()) onto = handle_of(held->problem);  // it is about to move
    return align_to_model(held, onto, rigid, least_squares);
  }
  if (least_squares) throw Error(ErrorCode::usage, "least_squares is for reference");
  return align_to_survey(held, *constraints_from(constraints), to, rigid);
}

}  // namespace

void bind_reports(nb::module_& module) {
  module.def("evaluate", &evaluate_errors, nb::arg("estimate"), nb::arg("reference"), nb::kw_only(),
             nb::arg("no_align") = false, nb::arg("robust") = false,
             nb::sig("def evaluate(estimate: Problem, reference: Problem, *, no_align: bool = "
                     "False, robust: bool = False) -> sheaf._records.Errors"),
             "How far an estimate's poses and points are from a reference, in its units, after the "
             "Sim(3) that brings the camera centres together best (robust: images far off do not "
             "count; no_align: as they are).");
  module.def("check", &check_problem, nb::arg("problem"), nb::kw_only(), nb::arg("threads") = 0,
             nb::sig("def check(problem: Problem, *, threads: int = 0) -> "
                     "list[sheaf._records.Finding]"),
             "What is wrong with a problem, and what to do; grave findings first.");
  module.def("align", &align_problem, nb::arg("problem"), nb::arg("reference") = nb::none(),
             nb::kw_only(), nb::arg("constraints") = nb::none(), nb::arg("rigid") = false,
             nb::arg("least_squares") = false, nb::arg("to") = "all",
             nb::sig("def align(problem: Problem, reference: Problem | None = None, *, "
                     "constraints: sheaf._records.ConstraintsLike = None, rigid: bool = False, "
                     "least_squares: bool = False, to: typing.Literal['all', 'positions', "
                     "'control'] = 'all') -> sheaf._records.Alignment"),
             "Brings a problem, in place, into the frame of a reference, robustly (least_squares: "
             "all common images count alike), or into that of a survey, by its positions, control "
             "points or both. rigid: the scale stays.");
}

}  // namespace sheaf
