// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "verb.h"

#include <utility>

#include "options/shared_options.h"

namespace sheaf {

std::vector<Verb> all_verbs() {
  return {solve_verb(),       info_verb(),   check_verb(),      convert_verb(),   perturb_verb(),
          evaluate_verb(),    align_verb(),  covariance_verb(), calibrate_verb(), compare_verb(),
          photometric_verb(), report_verb(), view_verb(),       generate_verb(),  demo_verb(),
          split_verb(),       join_verb()};
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

namespace {

/// As a shell takes it for one word.
std::string quoted(const std::string& word) {
  constexpr const char* kPlain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./:,=+@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string option_words(const BoundOption& option) {
  const std::string name = " " + (option.spec.short_name.empty() ? "--" + option.spec.name
                                                                 : "-" + option.spec.short_name);
  if (option.spec.kind == OptionKind::flag) return name;
  return name + " " + quoted(text_of(option.get()));
}

}  // namespace

std::function<std::string()> command_of(const Verb& verb) {
  std::vector<std::pair<BoundOption, OptionValue>> options;
  for (const BoundOption& option : verb.options) options.emplace_back(option, option.get());
  std::vector<BoundOption> places = verb.places;
  places.insert(places.end(), verb.more_places.begin(), verb.more_places.end());
  return [name = verb.name, places, options] {
    std::string out = "sheaf " + name;
    for (const BoundOption& place : places)
      if (const std::string word = text_of(place.get()); !word.empty()) out += " " + quoted(word);
    for (const auto& [option, usual] : options)
      if (option.get() != usual) out += option_words(option);
    return out;
  };
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
