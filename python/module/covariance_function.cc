// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "covariance_document.h"
#include "covariance_fields.h"
#include "fork_safety.h"
#include "keyword_options.h"
#include "options/refinement.h"
#include "options/shared_options.h"
#include "running.h"
#include "sheaf/covariance.h"
#include "survey_use.h"
#include "verb.h"

namespace sheaf {
namespace {

struct CovarianceArguments {
  CovarianceOptions options;
  RefinementArguments refinement;
};

std::vector<BoundOption> options_of(CovarianceArguments& a) {
  return joined(
      {bound(covariance_fields(), a.options),
       bound(refinement_fields("what has no covariance"), a.refinement),
       bound<CovarianceOptions>({SharedFields<CovarianceOptions>::threads()}, a.options)});
}

/// None: all; False: none; else indices.
void choose_points(nb::handle points, CovarianceOptions& options) {
  if (points.is_none()) return;
  if (PyBool_Check(points.ptr())) {
    options.points = nb::cast<bool>(points);
    return;
  }
  options.point_ids = indices_from(points, "points");
  options.points = !options.point_ids.empty();
}

/// None: all; else indices.
void choose_images(nb::handle images, nb::handle pairs, CovarianceOptions& options) {
  if (!images.is_none()) options.image_ids = indices_from(images, "images");
  if (pairs.is_none()) return;
  const nb::object array = nb::module_::import_("numpy").attr("asarray")(pairs);
  const nb::object rows = array.attr("reshape")(-1, 2).attr("reshape")(-1);
  const std::vector<std::uint32_t> ends = indices_from(rows, "pairs");
  for (std::size_t k = 0; k < ends.size(); k += 2)
    options.image_pairs.push_back({ends[k], ends[k + 1]});
}

/// Symmetric blocks of one size behind one another: (n, size, size).
template <std::size_t kNumbers>
nb::object blocks_of(const std::vector<std::array<double, kNumbers>>& blocks, std::size_t size) {
  const double* data = blocks.empty() ? nullptr : blocks.front().data();
  return array_of(data, {blocks.size(), size, size});
}

nb::list lenses_of(const Problem& problem, const Covariance& c) {
  nb::list out;
  for (std::size_t k = 0; k < c.lenses.size(); ++k) {
    // Empty where it was not asked for.
    const std::size_t n = c.lenses[k].empty() ? 0 : parameter_count(problem.cameras[k].model);
    out.append(array_of(c.lenses[k], {n, n}));
  }
  return out;
}

nb::list weak_of(const Covariance& c) {
  nb::list out;
  for (const WeakDirection& weak : c.weak)
    out.append(nb::module_::import_("sheaf._records")
                   .attr("WeakDirection")(weak.words, weak.camera, nb::cast(weak.parameters),
                                          weak.sigma, weak.correlation));
  return out;
}

nb::object object_of(const Problem& problem, const Covariance& c) {
  std::vector<double> redundancy, standardised;
  for (const ObservationReliability& r : c.observations) {
    redundancy.insert(redundancy.end(), r.redundancy.begin(), r.redundancy.end());
    standardised.insert(standardised.end(), r.standardised.begin(), r.standardised.end());
  }
  std::vector<double> distances;
  for (const Distance& distance : c.distances)
    distances.insert(distances.end(), {distance.value, distance.sigma});
  nb::dict out;
  out["gauge"] = to_string(c.gauge);
  out["deficit"] = c.deficit;
  out["freedoms"] = c.freedoms;
  out["sigma"] = c.sigma;
  out["sigma_estimated"] = c.sigma_estimated;
  out["loss_factor"] = c.loss_factor;
  out["rows"] = c.rows;
  out["unknowns"] = c.unknowns;
  out["redundancy"] = c.redundancy;
  out["poses"] = blocks_of(c.poses, 6);
  out["centres"] = blocks_of(c.centres, 3);
  out["frames"] = blocks_of(c.frames, 6);
  out["sensors"] = blocks_of(c.sensors, 6);
  out["lenses"] = lenses_of(problem, c);
  out["points"] = blocks_of(c.points, 3);
  out["pairs"] = blocks_of(c.pairs, 6);
  out["distances"] = array_of(distances, {c.distances.size(), 2});
  out["observation_redundancy"] = array_of(redundancy, {c.observations.size(), 2});
  out["observation_standardised"] = array_of(standardised, {c.observations.size(), 2});
  out["weak"] = weak_of(c);
  out["words"] = c.words;
  out["undetermined_points"] = c.undetermined_points;
  out["seconds"] = c.seconds;
  return nb::module_::import_("sheaf._records").attr("Covariance")(**out);
}

nb::object covariance_of(const ProblemHandle& held, const nb::kwargs& keywords) {
  nb::dict left = nb::cast<nb::dict>(keywords.attr("copy")());
  const std::optional<Constraints> constraints =
      constraints_from(left.attr("pop")("constraints", nb::none()));
  CovarianceArguments arguments;
  const nb::object images = left.attr("pop")("images", nb::none());
  const nb::object pairs = left.attr("pop")("pairs", nb::none());
  choose_images(images, pairs, arguments.options);
  choose_points(left.attr("pop")("points", nb::none()), arguments.options);
  take_options(left, options_of(arguments));
  check_all_taken(left, "covariance");

  const ReadUse use(held);
  CovarianceOptions& options = arguments.options;
  options.threads = threads_here(options.threads);
  if (arguments.refinement.given())
    options.fixed =
        fixed_of(refinement_of(arguments.refinement, use.problem()).value(), use.problem());
  std::optional<Problem> placed;
  std::optional<Covariance> found;
  Run run;
  options.stop = run.token();
  run.go([&] {
    if (constraints) {
      placed = use.problem();
      place_survey(*placed, *constraints, options.fixed).value();
    }
    found = covariance(placed ? *placed : use.problem(), options).value();
    // Points of the survey are no points of the problem.
    if (constraints && options.point_ids.empty() && options.points)
      found->points.resize(use.problem().num_points());
  });
  if (found->ending == CovarianceEnding::time_limit) {
    PyErr_SetString(PyExc_TimeoutError, "the time limit was reached before the covariance ended");
    throw nb::python_error();
  }
  return object_of(use.problem(), *found);
}

}  // namespace

void bind_covariance(nb::module_& module) {
  CovarianceArguments fresh;
  const std::vector<BoundOption> options = options_of(fresh);
  const std::string signature = signature_of("covariance", "problem: Problem",
                                             {"images: numpy.typing.ArrayLike | None = None",
                                              "pairs: numpy.typing.ArrayLike | None = None",
                                              "points: bool | numpy.typing.ArrayLike | None = None",
                                              "constraints: sheaf._records.ConstraintsLike = None"},
                                             options, "sheaf._records.Covariance");
  module.def("covariance", &covariance_of, nb::arg("problem"), nb::arg("options"),
             nb::sig(signature.c_str()),
             ("How well a state is known, which should be an optimum (docs/covariance.md).\n\n"
              "  images: indices of the images to tell of; None: all\n"
              "  pairs: (k, 2): pairs of images whose common covariance and distance are told\n"
              "  points: indices of the points to tell of; None: all; False: none\n"
              "  constraints: a survey that takes part, as in solve\n" +
              help_of(options))
                 .c_str());
}

}  // namespace sheaf
