// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "command_line.h"

namespace sheaf {
namespace {

std::vector<Verb> verbs() {
  return {solve_verb(),       info_verb(),     check_verb(),      convert_verb(),   perturb_verb(),
          evaluate_verb(),    align_verb(),    covariance_verb(), calibrate_verb(), compare_verb(),
          photometric_verb(), generate_verb(), demo_verb()};
}

}  // namespace
}  // namespace sheaf

int main(int argc, char** argv) { return sheaf::run_command_line(argc, argv, sheaf::verbs); }
