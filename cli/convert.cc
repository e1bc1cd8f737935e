// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <filesystem>
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
  std::string in, out;
};

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  check_outputs({{"OUT", arguments.out}, {"--json", json}});
  const InputFile input = read_file(arguments.in, {.hash = !json.empty()}).value();
  interrupt.begin_write();
  const Timer writing;
  write(input.problem, arguments.out).value();
  const double write_s = writing.seconds();
  fmt::print("{}: {}\nwrote       {}\n", arguments.in, counts_text(input.problem), arguments.out);
  if (json.empty()) return 0;
  std::error_code ignored;
  const Json document = {
      {"version", SHEAF_VERSION},
      {"input", input_json(arguments.in, input)},
      {"output",
       {{"path", arguments.out}, {"bytes", std::filesystem::file_size(arguments.out, ignored)}}},
      {"time", {{"read_s", input.read_s}, {"write_s", write_s}, {"total_s", total.seconds()}}}};
  write_json(document, json);
  return 0;
}

}  // namespace

void add_convert(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& verb = *app.add_subcommand("convert", "read a problem and write it in another format");
  verb.add_option("IN", arguments->in, "problem: BAL, plain or .gz or .bz2 (told by content)")
      ->type_name("FILE")
      ->required();
  verb.add_option("OUT", arguments->out,
                  "NAME.ply is a point cloud with cameras, anything else BAL; NAME.gz and NAME.bz2 "
                  "are compressed")
      ->type_name("FILE")
      ->required();
  add_common_options(verb, arguments->common);
  verb.footer("Example:\n  sheaf convert problem.txt problem.ply");
  verb.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace sheaf
