// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <memory>
#include <string>

#include "exit_code.h"
#include "interrupt.h"
#include "outputs.h"
#include "photometric_arguments.h"
#include "photometric_document.h"
#include "progress.h"
#include "sheaf/sheaf.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  PhotometricArguments photometric;
  std::string in, out;
};

std::string summary_text(const PhotometricSummary& summary) {
  const Summary& s = summary.solve;
  std::string out;
  out += fmt::format("patches     {} of {} seen at the start, {} of these left at the end\n",
                     summary.patches_visible, summary.patches_total, summary.patches_left);
  out += fmt::format("cost        {:.9e} -> {:.9e}\n", s.initial_cost, s.final_cost);
  out += fmt::format("rms         {:.5g} -> {:.5g} grey levels\n", summary.initial_rms_grey,
                     summary.final_rms_grey);
  out += fmt::format("median      {:.5g} -> {:.5g} grey levels\n", summary.initial_median_grey,
                     summary.final_median_grey);
  if (summary.measurements > 0)
    out += fmt::format("anchor      {} measured positions, rms {:.5g} -> {:.5g} px\n",
                       summary.measurements, summary.initial_rms_px, summary.final_rms_px);
  out += fmt::format("iterations  {}\n", s.iterations.empty() ? 0 : s.iterations.size() - 1);
  out += fmt::format("stopped     {}\n", s.words);
  out += fmt::format("time        set-up {:.3f} s, solve {:.3f} s; {}, {} thread{}\n", s.setup_s,
                     s.solve_s, s.simd, s.threads, s.threads == 1 ? "" : "s");
  return out;
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  check_outputs({{"--json", arguments.common.json}});
  PhotometricFolder folder =
      read_photometric(arguments.in, camera_of(arguments.photometric)).value();
  PhotometricProblem& problem = folder.problem;
  Progress progress(arguments.common.quiet);
  PhotometricOptions options = photometric_options(arguments.photometric);
  options.threads = arguments.common.threads;
  options.stop = interrupt.token();
  options.on_iteration = [&](const Iteration& iteration) {
    progress.report(iteration);
    return true;
  };
  interrupt.begin_solve();
  const PhotometricSummary summary = refine_photometric(problem, options).value();
  interrupt.begin_write();
  const Timer writing;
  const bool usable = summary.solve.usable();
  if (usable && !arguments.out.empty()) write_photometric(folder, arguments.out).value();
  const double write_s = writing.seconds();
  fmt::print("{}: {} images, {} points\n", arguments.in, problem.images.size(),
             problem.num_points());
  fmt::print("{}", summary_text(summary));
  for (std::size_t i = 0; i < problem.brightness.size(); ++i)
    fmt::print("image {:<5} a {:.4f}, b {:.3f}\n", i, problem.brightness[i].a,
               problem.brightness[i].b);
  if (!arguments.common.json.empty()) {
    const PhotometricRecord record{arguments.in, arguments.photometric, folder.read_s, write_s,
                                   total.seconds()};
    write_json(photometric_json(record, summary, problem), arguments.common.json);
  }
  return exit_code_of(summary.solve.termination);
}

}  // namespace

void add_photometric(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& verb =
      *app.add_subcommand("photometric", "refine poses and points from the pixels of images");
  verb.add_option(
          "IN", arguments->in,
          "folder with poses.txt, points.txt and 0.png, 1.png, ... (docs/photometric.md has "
          "the formats)")
      ->type_name("FOLDER")
      ->required();
  verb.add_option("-o,--output", arguments->out,
                  "folder for the refined state in the same format, and brightness.txt")
      ->type_name("FOLDER");
  add_photometric_options(verb, arguments->photometric);
  add_common_options(verb, arguments->common);
  verb.footer(
      "Example:\n  sheaf photometric scene -o refined --json photometric.json\n"
      "\nA scene to try it on:\n  sheaf generate scene --photometric");
  verb.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace sheaf
