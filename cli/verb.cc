// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "verb.h"

#include "options/shared_options.h"

namespace sheaf {

std::vector<Verb> all_verbs() {
  return {solve_verb(),       info_verb(),     check_verb(),      convert_verb(),   perturb_verb(),
          evaluate_verb(),    align_verb(),    covariance_verb(), calibrate_verb(), compare_verb(),
          photometric_verb(), generate_verb(), demo_verb()};
}

std::vector<BoundOption> options_of(CommonOptions& options) {
  using F = FieldsOf<CommonOptions>;
  static const OptionTable<CommonOptions> kTable = {
      F::text(&CommonOptions::json, {.name = "json",
                                     .placeholder = "FILE",
                                     .help = "also write the result as JSON (docs/json.md)"}),
      SharedFields<CommonOptions>::threads(),
      F::flag(&CommonOptions::quiet, {.name = "quiet", .help = "no progress on stderr"})};
  return bound(kTable, options);
}

std::vector<BoundOption> joined(std::initializer_list<std::vector<BoundOption>> lists) {
  std::vector<BoundOption> out;
  for (const std::vector<BoundOption>& list : lists)
    out.insert(out.end(), list.begin(), list.end());
  return out;
}

std::vector<BoundOption> own(const std::vector<BoundOption>& options) {
  std::vector<BoundOption> out;
  for (const BoundOption& option : options)
    if (option.spec.reach == OptionReach::verb) out.push_back(option);
  return out;
}

OptionSpec ply_of_two_states() {
  return {.name = "ply",
          .placeholder = "FILE",
          .help = "write start (grey) and result (colour) as one PLY"};
}

OptionSpec log_of_steps() {
  return {.name = "log",
          .placeholder = "FILE",
          .help = "write a line of JSON for each step as it is made, and one for the end"};
}

OptionSpec problem_in() {
  return {
      .name = "IN",
      .placeholder = "FILE",
      .help =
          "problem: a BAL, Bundler, NVM, libmv, OpenSfM, OpenMVG, AliceVision or g2o file, plain "
          "or .gz or .bz2, or the folder of a COLMAP model (told by content)"};
}

OptionSpec problem_format() {
  return {.name = "format",
          .placeholder = "NAME",
          .nothing = true,
          .help = "write this whatever the name, and say what it does not hold"};
}

std::vector<OptionChoice> problem_formats() {
  return {{"bal"},     {"colmap", "binary"}, {"colmap-text"}, {"bundler"},    {"nvm"}, {"libmv"},
          {"opensfm"}, {"openmvg"},          {"alicevision"}, {"nerfstudio"}, {"ply"}};
}

}  // namespace sheaf
