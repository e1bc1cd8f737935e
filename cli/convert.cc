// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "clean_fields.h"
#include "inspect/clean.h"
#include "interrupt.h"
#include "json_document.h"
#include "outputs.h"
#include "read_input.h"
#include "rigs_option.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  RigsArguments rigs;
  std::string in, out, format;
  CleanOptions clean;
};

Json list_json(const std::vector<std::uint64_t>& numbers) {
  constexpr std::size_t kMostListed = 1000;
  const std::size_t listed = std::min(numbers.size(), kMostListed);
  return {{"count", numbers.size()},
          {"first", std::vector<std::uint64_t>(
                        numbers.begin(), numbers.begin() + static_cast<std::ptrdiff_t>(listed))}};
}

Json cleaned_json(const CleanOptions& options, const CleanRecord& record) {
  return {{"max_error_px", options.max_error_px},
          {"drop_behind", options.behind},
          {"drop_repeated", options.repeated},
          {"min_angle_deg", options.min_angle_deg},
          {"min_track", options.min_track},
          {"observations", record.observations},
          {"far_off", list_json(record.far_off)},
          {"behind", list_json(record.behind)},
          {"in_plane", list_json(record.in_plane)},
          {"at_centre", list_json(record.at_centre)},
          {"repeated", list_json(record.repeated)},
          {"narrow", list_json(record.narrow)},
          {"short_tracks", list_json(record.short_tracks)}};
}

void print_cleaned(const CleanRecord& r) {
  print_out(
      "left out    {} observations: {} far off, {} behind, {} in the plane of their camera, {} at "
      "its centre, {} repeated, the others of {} points with narrow rays and {} short tracks\n",
      r.observations, r.far_off.size(), r.behind.size(), r.in_plane.size(), r.at_centre.size(),
      r.repeated.size(), r.narrow.size(), r.short_tracks.size());
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  check_outputs({{"OUT", arguments.out, true}, {"--json", json}},
                {arguments.in, arguments.rigs.path});
  InputFile input = read_input(arguments.in, arguments.common);
  const Json before = input_json(arguments.in, input);
  const Json laid = lay_rigs(arguments.rigs, input, arguments.common.quiet);
  const std::string counts = counts_text(input.problem);
  CleanRecord cleaned;
  if (arguments.clean.any()) cleaned = clean(input.problem, arguments.clean);
  const std::string format =
      arguments.format.empty() ? write_format(input.problem, arguments.out) : arguments.format;
  interrupt.begin_write();
  const Timer writing;
  write(input.problem, arguments.out, {.format = format}).value();
  const double write_s = writing.seconds();
  print_out("{}: {}\n", arguments.in, counts);
  for (const std::string& note : input.notes) print_out("note        {}\n", note);
  if (arguments.clean.any()) print_cleaned(cleaned);
  print_out("wrote       {} ({})\n", arguments.out, format);
  print_losses(format, input.problem);
  if (json.empty()) return 0;
  const Json document = {
      {"version", SHEAF_VERSION},
      {"input", before},
      {"rig_configuration", laid},
      {"cleaned", cleaned_json(arguments.clean, cleaned)},
      {"output", {{"path", arguments.out}, {"format", format}, {"bytes", bytes_at(arguments.out)}}},
      {"dropped", lost_in(format, input.problem)},
      {"time", {{"read_s", input.read_s}, {"write_s", write_s}, {"total_s", total.seconds()}}}};
  write_json(document, json);
  return 0;
}

}  // namespace

Verb convert_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{
      "convert", "read a problem and write it in another format",
      "Example:\n  sheaf convert problem.txt problem.ply\n"
      "\nA COLMAP model as text:\n  sheaf convert model/ readable --format colmap-text\n"
      "\nWithout what misleads a solver:\n"
      "  sheaf convert model/ clean --max-error 8 --drop-behind --min-angle 1.5 --min-track 2"};
  verb.places = bound<Arguments>(
      {F::text(&Arguments::in, problem_in()),
       F::text(&Arguments::out, {.name = "OUT", .placeholder = "FILE", .help = kProblemOut})},
      *a);
  verb.options = joined(
      {bound<Arguments>({F::name(&Arguments::format, problem_formats(), problem_format())}, *a),
       bound(clean_fields(), a->clean), options_of(a->rigs), options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
