// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "options/solve_options.h"

#include <utility>

#include "options/loss_option.h"
#include "options/shared_options.h"

namespace sheaf {
namespace {

using F = FieldsOf<SolveOptions>;
using Shared = SharedFields<SolveOptions>;
using Table = OptionTable<SolveOptions>;

/// What is minimised, and over what.
Table model_fields() {
  return {
      loss_field<SolveOptions>(&SolveOptions::loss, {.unit = "pixels", .graduated = true},
                               {.name = "loss", .help = "what large residuals count less by"}),
      F::choice(
          &SolveOptions::cheirality,
          {{Cheirality::formula, "formula", "count them as the model does"},
           {Cheirality::reject, "reject", "refuse steps that add some"},
           {Cheirality::hold_out, "hold-out", "leave those at the start out, then as reject"}},
          {.name = "cheirality",
           .placeholder = "RULE",
           .help = "observations behind their camera"}),
      F::choice(&SolveOptions::points,
                {{PointParametrisation::automatic, "auto",
                  "inverse depth, not through infinity, where many points have little parallax; "
                  "else xyz"},
                 {PointParametrisation::xyz, "xyz"},
                 {PointParametrisation::homogeneous, "homogeneous",
                  "a unit 4-vector; passes through infinity"},
                 {PointParametrisation::inverse_depth, "inverse-depth",
                  "bearing and inverse depth from the first image that sees it; likewise"}},
                {.name = "points",
                 .placeholder = "NAME",
                 .help = "the coordinates in which a point steps"}),
  };
}

/// How steps are computed.
Table solver_fields() {
  return {
      Shared::solver("by counted work", "conjugate gradients, one of the next two by counted work"),
      F::choice(
          &SolveOptions::precision,
          {{Precision::automatic, "auto", "mixed where it is quicker and ends where double does"},
           {Precision::full, "double"},
           {Precision::mixed, "mixed",
            "float where the solver can; state, gradient and costs stay double"}},
          {.name = "precision",
           .placeholder = "NAME",
           .help = "inside the solver of the camera system"}),
      Shared::memory_limit("take a leaner solver, or refuse (exit 5),"),
      F::choice(
          &SolveOptions::trust_region,
          {{TrustRegion::lm, "lm", "more damping, everything computed again"},
           {TrustRegion::dogleg, "dogleg",
            "the same factorisation, a shorter step; with an iterative solver Steihaug's, which "
            "also ends conjugate gradients at the radius; with --points xyz only"}},
          {.name = "trust-region", .placeholder = "NAME", .help = "what follows a rejected step"}),
      Shared::initial_damping(),
      F::whole(&SolveOptions::inner_iterations,
               {.name = "inner-iterations",
                .placeholder = "N",
                .range = from(0),
                .help = "at most so many Gauss-Newton steps of each point by itself in every step, "
                        "once the cameras have stepped; under a loss, tries of a "
                        "Levenberg-Marquardt, three for one of these; 0: none"}),
      F::whole(&SolveOptions::recoveries,
               {.name = "recoveries",
                .placeholder = "N",
                .range = from(0),
                .help = "so often at most, where an early step goes wrong, resect every image and "
                        "intersect every point by itself, and go on from there if that is better; "
                        "0: never"}),
      F::choice(&SolveOptions::simd,
                {{Simd::best, "best"},
                 {Simd::scalar, "scalar"},
                 {Simd::sse4, "sse4"},
                 {Simd::avx2, "avx2"},
                 {Simd::avx512, "avx512"},
                 {Simd::neon, "neon"}},
                {.name = "simd",
                 .placeholder = "NAME",
                 .help = "instruction set, for tests and measurements"}),
      Shared::threads(),
  };
}

/// What a program sets and the command does by itself.
Table library_fields() {
  return {
      F::real(&SolveOptions::gradient_tolerance,
              {.name = "gradient-tolerance",
               .range = from(0),
               .help = "stop when the scaled gradient is at most this part of |r|",
               .reach = OptionReach::library}),
      F::flag(&SolveOptions::lend_observations,
              {.name = "lend-observations",
               .help = "the solver may free the problem's observations while it runs",
               .reach = OptionReach::library}),
  };
}

Table make_table() {
  Table table = {Shared::max_iterations(), Shared::tolerance(), Shared::time_limit()};
  for (const Table& part :
       {model_fields(), solver_fields(), Shared::checkpoints(), library_fields()})
    table.insert(table.end(), part.begin(), part.end());
  return table;
}

}  // namespace

const OptionTable<SolveOptions>& solve_fields() {
  static const Table kTable = make_table();
  return kTable;
}

std::vector<BoundOption> options_of(SolveArguments& arguments) {
  std::vector<BoundOption> out =
      bound(refinement_fields("hold these to the last bit"), arguments.refinement);
  for (BoundOption& option : bound(solve_fields(), arguments.options))
    out.push_back(std::move(option));
  return out;
}

Result<void> check_fields(const SolveOptions& options) {
  return check_fields(solve_fields(), options);
}

}  // namespace sheaf
