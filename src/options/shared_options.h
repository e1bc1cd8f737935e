// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "options/option_field.h"
#include "sheaf/camera_solver_kind.h"

namespace sheaf {

/// What several structs of options have under the same name and with the same words.
template <class Options>
struct SharedFields {
  using F = FieldsOf<Options>;
  using Field = OptionField<Options>;

  static Field max_iterations() {
    return F::whole(&Options::max_iterations, {.name = "max-iterations",
                                               .placeholder = "N",
                                               .range = from(0),
                                               .help = "steps to try, rejected ones included"});
  }
  static Field tolerance() {
    return F::real(&Options::tolerance,
                   {.name = "tolerance",
                    .placeholder = "T",
                    .range = from(0),
                    .help = "stop when the relative decrease of the cost stays below this twice"});
  }
  static Field time_limit(const std::string& then = "write the best state and exit with 7") {
    return F::limit(&Options::time_limit_s,
                    {.name = "time-limit",
                     .placeholder = "SECONDS",
                     .unit = "s",
                     .range = above(0),
                     .help = "stop after this long (of the command, reading included; of a "
                             "library's call, set-up included), " +
                             then});
  }
  /// `how` says what is done about a forecast over the limit.
  static Field memory_limit(const std::string& how) {
    return F::bytes(&Options::memory_limit_bytes,
                    {.name = "memory-limit",
                     .placeholder = "BYTES",
                     .range = from(0),
                     .help = how + " rather than exceed this; units K, M, G are powers of 1024; 0: "
                                   "no limit"});
  }
  /// What the names mean that leave something to choose.
  static Field solver(const std::string& automatic, const std::string& iterative) {
    using Kind = CameraSolverKind;
    return F::choice(
        &Options::solver,
        {{Kind::automatic, "auto", automatic},
         {Kind::dense, "dense", "formed, Cholesky"},
         {Kind::sparse, "sparse", "formed by blocks, Cholesky in an order that keeps fill low"},
         {Kind::iterative, "iterative", iterative},
         {Kind::iterative_explicit, "iterative-explicit", "on the formed blocks"},
         {Kind::iterative_implicit, "iterative-implicit", "with nothing formed"}},
        {.name = "solver", .placeholder = "NAME", .help = "how the camera system is solved"});
  }
  static Field initial_damping() {
    return F::real(&Options::initial_damping, {.name = "initial-damping",
                                               .placeholder = "LAMBDA",
                                               .range = from(0),
                                               .help = "of the first step; 0: chosen by rule"});
  }
  static OptionTable<Options> checkpoints() {
    return {
        F::text(&Options::checkpoint,
                {.name = "checkpoint",
                 .placeholder = "FILE",
                 .help = "write the run down between two steps, now and then and where it is to "
                         "stop, so that it can be gone on with"}),
        F::real(&Options::checkpoint_every_s, {.name = "checkpoint-every",
                                               .placeholder = "SECONDS",
                                               .unit = "s",
                                               .range = from(0),
                                               .help = "so often; 0: before each step"}),
        F::text(&Options::resume,
                {.name = "resume",
                 .placeholder = "FILE",
                 .help = "go on from a checkpoint of the same problem and options, to the end of "
                         "the run that was never stopped, bit for bit"}),
    };
  }
  static Field threads() {
    return F::whole(&Options::threads,
                    {.name = "threads",
                     .placeholder = "N",
                     .range = from(0),
                     .help = "threads to compute with, 0 for all; the result does not depend on it",
                     .reach = OptionReach::every_verb});
  }
};

}  // namespace sheaf
