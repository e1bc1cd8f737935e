// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <memory>
#include <string>

#include "interrupt.h"
#include "json_document.h"
#include "outputs.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  std::string in, out, format;
};

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  check_outputs({{"OUT", arguments.out, true}, {"--json", json}});
  const InputFile input = read_file(arguments.in, {.hash = !json.empty()}).value();
  const std::string format =
      arguments.format.empty() ? write_format(input.problem, arguments.out) : arguments.format;
  interrupt.begin_write();
  const Timer writing;
  write(input.problem, arguments.out, {.format = format}).value();
  const double write_s = writing.seconds();
  fmt::print("{}: {}\n", arguments.in, counts_text(input.problem));
  for (const std::string& note : input.notes) fmt::print("note        {}\n", note);
  fmt::print("wrote       {} ({})\n", arguments.out, format);
  print_losses(format, input.problem);
  if (json.empty()) return 0;
  const Json document = {
      {"version", SHEAF_VERSION},
      {"input", input_json(arguments.in, input)},
      {"output", {{"path", arguments.out}, {"format", format}, {"bytes", bytes_at(arguments.out)}}},
      {"dropped", lost_in(format, input.problem)},
      {"time", {{"read_s", input.read_s}, {"write_s", write_s}, {"total_s", total.seconds()}}}};
  write_json(document, json);
  return 0;
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& verb = *app.add_subcommand("convert", "read a problem and write it in another format");
  verb.add_option("IN", arguments->in, kProblemIn)->type_name("FILE")->required();
  verb.add_option("OUT", arguments->out, kProblemOut)->type_name("FILE")->required();
  verb.add_option("--format", arguments->format,
                  "write this whatever the name: bal, colmap (binary), colmap-text, bundler, nvm "
                  "or ply; what it does not hold is said")
      ->type_name("NAME")
      ->check(one_of({"bal", "colmap", "colmap-text", "bundler", "nvm", "ply"}));
  add_common_options(verb, arguments->common);
  verb.footer(
      "Example:\n  sheaf convert problem.txt problem.ply\n"
      "\nA COLMAP model as text:\n  sheaf convert model/ readable --format colmap-text");
  verb.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace sheaf
