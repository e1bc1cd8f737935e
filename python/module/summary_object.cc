// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "summary_object.h"

#include <nanobind/stl/string.h>

#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "iteration_fields.h"

namespace sheaf {
namespace {

template <class Field>
const char* format_of() {
  if constexpr (std::is_same_v<Field, bool>) return "?";
  if constexpr (std::is_same_v<Field, int>) return "i4";
  return "f8";
}

/// Laid out as the struct is, so that records are copied as they are.
nb::object iteration_dtype() {
  nb::list names, formats, offsets;
  const Iteration origin;
  for_each_iteration_field([&](const char* name, auto member) {
    using Field = std::remove_cvref_t<decltype(origin.*member)>;
    names.append(name);
    formats.append(format_of<Field>());
    offsets.append(static_cast<std::size_t>(reinterpret_cast<const char*>(&(origin.*member)) -
                                            reinterpret_cast<const char*>(&origin)));
  });
  nb::dict layout;
  layout["names"] = names;
  layout["formats"] = formats;
  layout["offsets"] = offsets;
  layout["itemsize"] = sizeof(Iteration);
  return nb::module_::import_("numpy").attr("dtype")(layout);
}

nb::object iterations_of(const std::vector<Iteration>& iterations) {
  const nb::bytes raw(reinterpret_cast<const char*>(iterations.data()),
                      sizeof(Iteration) * iterations.size());
  // A copy, which can be written to.
  return nb::module_::import_("numpy").attr("frombuffer")(raw, iteration_dtype()).attr("copy")();
}

nb::dict costs_of(const TermCosts& costs) {
  nb::dict out;
  out["centres"] = costs.centres;
  out["rotations"] = costs.rotations;
  out["gravities"] = costs.gravities;
  out["relative_poses"] = costs.relative_poses;
  out["parameters"] = costs.parameters;
  out["points"] = costs.points;
  out["distances"] = costs.distances;
  out["gaussians"] = costs.gaussians;
  return out;
}

nb::list rounds_of(const Summary& s) {
  nb::list out;
  for (const LossRound& round : s.rounds) {
    nb::dict one;
    one["scale_px"] = round.scale_px;
    one["sigma_px"] = round.sigma_px;
    one["initial_cost"] = round.initial_cost;
    one["final_cost"] = round.final_cost;
    one["steps"] = round.steps;
    out.append(one);
  }
  return out;
}

nb::list recoveries_of(const Summary& s) {
  nb::list out;
  for (const Recovery& recovery : s.recoveries) {
    nb::dict one;
    one["after_step"] = recovery.after_step;
    one["passes"] = recovery.passes;
    one["taken"] = recovery.taken;
    one["from_start"] = recovery.from_start;
    one["cost_before"] = recovery.cost_before;
    one["cost_after"] = recovery.cost_after;
    out.append(one);
  }
  return out;
}

nb::list changes_of(const Summary& s) {
  nb::list out;
  for (const SolverChange& change : s.solver_changes) {
    nb::dict one;
    one["after_step"] = change.after_step;
    one["iterations"] = change.iterations;
    one["from"] = change.from;
    one["to"] = change.to;
    out.append(one);
  }
  return out;
}

nb::list bounds_of(const Summary& s) {
  nb::list out;
  for (const BoundReached& at : s.at_bounds) {
    nb::dict one;
    one["camera"] = at.camera;
    one["parameter"] = at.name;
    one["value"] = at.value;
    one["bound"] = at.upper ? "upper" : "lower";
    out.append(one);
  }
  return out;
}

std::string words_of(const Iteration& iteration) {
  std::string out = "<sheaf.Iteration";
  for_each_iteration_field([&](const char* name, auto member) {
    const std::string key(name);
    if (key == "index" || key == "cost" || key == "accepted")
      out += " " + key + "=" + nb::cast<std::string>(nb::str(nb::cast(iteration.*member)));
  });
  return out + ">";
}

}  // namespace

nb::dict fields_of(const Summary& s) {
  nb::dict out;
  out["initial_cost"] = s.initial_cost;
  out["final_cost"] = s.final_cost;
  out["initial_plain_cost"] = s.initial_plain_cost;
  out["final_plain_cost"] = s.final_plain_cost;
  out["initial_rms_px"] = s.initial_rms_px;
  out["final_rms_px"] = s.final_rms_px;
  out["initial_terms"] = costs_of(s.initial_terms);
  out["final_terms"] = costs_of(s.final_terms);
  out["at_bounds"] = bounds_of(s);
  out["termination"] = to_string(s.termination);
  out["words"] = s.words;
  out["iterations"] = iterations_of(s.iterations);
  out["recoveries"] = recoveries_of(s);
  out["loss"] = to_string(s.loss);
  out["rounds"] = rounds_of(s);
  out["final_sigma_px"] = s.final_sigma_px;
  out["solver"] = s.solver;
  out["solver_reason"] = s.solver_reason;
  out["solver_changes"] = changes_of(s);
  out["points"] = s.points;
  out["points_reason"] = s.points_reason;
  out["precision"] = s.precision;
  out["simd"] = s.simd;
  out["threads"] = s.threads;
  out["forecast_bytes"] = s.forecast_bytes;
  out["setup_s"] = s.setup_s;
  out["solve_s"] = s.solve_s;
  out["resumed_after"] = s.resumed_after;
  out["checkpoints"] = s.checkpoints;
  out["checkpoint_failure"] = s.checkpoint_failure;
  out["behind_camera_before"] = array_of(s.behind_camera_before);
  out["behind_camera_after"] = array_of(s.behind_camera_after);
  out["rejected_observations"] = array_of(s.rejected_observations);
  out["usable"] = s.usable();
  return out;
}

void bind_iteration(nb::module_& module) {
  nb::class_<Iteration> iteration(
      module, "Iteration",
      "One trust region step, as callbacks get it; index 0 is the start. docs/json.md tells of "
      "each field.");
  for_each_iteration_field([&](const char* name, auto member) { iteration.def_ro(name, member); });
  iteration.def("__repr__", &words_of);
}

}  // namespace sheaf
