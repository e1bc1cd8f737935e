// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance_fields.h"

#include "options/loss_option.h"
#include "options/shared_options.h"

namespace sheaf {

const OptionTable<CovarianceOptions>& covariance_fields() {
  using C = FieldsOf<CovarianceOptions>;
  static const OptionTable<CovarianceOptions> kTable = {
      C::choice(&CovarianceOptions::gauge,
                {{Gauge::automatic, "auto", "data where these fix the scene, else free"},
                 {Gauge::data, "data", "nothing is added; refused where something is left free"},
                 {Gauge::free_centres, "free", "the trace over camera centres is least"},
                 {Gauge::free_points, "free-points", "the trace over points is least"},
                 {Gauge::first_two, "first-two",
                  "the first pose and one coordinate of the second are exact"}},
                {.name = "gauge", .help = "what stands for place, turn and scale"}),
      C::real(&CovarianceOptions::sigma, {.name = "sigma",
                                          .placeholder = "S",
                                          .unit = "px",
                                          .range = {.lowest = 0},
                                          .help = "of a residual; 0: from the residuals"}),
      loss_field<CovarianceOptions>(&CovarianceOptions::loss, {"pixels", false, false},
                                    {.name = "loss", .help = "that the solve ended with"}),
      SharedFields<CovarianceOptions>::memory_limit(
          "solve for what --poses and --points name by conjugate gradients, else refuse (exit 5)"),
      SharedFields<CovarianceOptions>::time_limit("write nothing and exit with 7"),
      C::choice(&CovarianceOptions::solver,
                {{CovarianceSolver::automatic, "auto", "factor where it fits"},
                 {CovarianceSolver::factor, "factor", "all at once"},
                 {CovarianceSolver::conjugate_gradients, "conjugate-gradients",
                  "a solve for each parameter; --poses and --points must name a few"}},
                {.name = "solver", .help = "how entries of the inverse are found"}),
      C::flag(&CovarianceOptions::conditional,
              {.name = "conditional", .help = "points with cameras held"}),
      C::flag(&CovarianceOptions::observations,
              {.name = "observations",
               .help = "redundancy and standardised residual of each observation"})};
  return kTable;
}

}  // namespace sheaf
