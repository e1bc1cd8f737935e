// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "sheaf/solve.h"

namespace sheaf {

/// Calls visit(name, member) for each field of an Iteration, in the order of the struct.
template <class Visit>
void for_each_iteration_field(const Visit& visit) {
  visit("index", &Iteration::index);
  visit("round", &Iteration::round);
  visit("start_cost", &Iteration::start_cost);
  visit("cost", &Iteration::cost);
  visit("trial_cost", &Iteration::trial_cost);
  visit("accepted", &Iteration::accepted);
  visit("damping", &Iteration::damping);
  visit("radius", &Iteration::radius);
  visit("reused", &Iteration::reused);
  visit("gain_ratio", &Iteration::gain_ratio);
  visit("gradient_max", &Iteration::gradient_max);
  visit("step_norm", &Iteration::step_norm);
  visit("scale_px", &Iteration::scale_px);
  visit("loss_floor", &Iteration::loss_floor);
  visit("linear_iterations", &Iteration::linear_iterations);
  visit("passes", &Iteration::passes);
  visit("time_s", &Iteration::time_s);
}

}  // namespace sheaf
