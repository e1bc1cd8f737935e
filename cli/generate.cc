// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <memory>
#include <string>

#include "inspect/statistics.h"
#include "interrupt.h"
#include "json_document.h"
#include "outputs.h"
#include "scene_arguments.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  SceneOptions scene;
  std::string out, truth;
};

Json document_of(const Arguments& arguments, const Scene& scene, const Statistics& statistics,
                 double rms_px, double write_s, double total_s) {
  Json document = {{"version", SHEAF_VERSION},
                   {"options", scene_options_json(arguments.scene)},
                   {"output", arguments.out},
                   {"truth", arguments.truth.empty() ? Json() : Json(arguments.truth)}};
  document.update(counts_json(scene.start));
  document.update(statistics_json(statistics));
  document["rms_px"] = number(rms_px);
  document["memory"] = {{"problem_bytes", size_bytes(scene.start)}, {"peak_bytes", peak_bytes()}};
  document["time"] = {{"write_s", write_s}, {"total_s", total_s}};
  return document;
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  check_outputs({{"OUT", arguments.out}, {"--truth", arguments.truth}, {"--json", json}});
  const Scene scene = generate(arguments.scene).value();
  interrupt.begin_write();
  const Timer writing;
  write(scene.start, arguments.out).value();
  if (!arguments.truth.empty()) write(scene.truth, arguments.truth).value();
  const double write_s = writing.seconds();
  const Statistics statistics = statistics_of(scene.start);
  const Evaluation evaluation = evaluate(scene.start);
  fmt::print("{}: {}\n", arguments.out, counts_text(scene.start));
  fmt::print("tracks      {:.0f} to {:.0f} observations a point, mean {:.3f}\n",
             statistics.track.min, statistics.track.max, statistics.mean_track);
  fmt::print("images      {:.0f} to {:.0f} observations, median {:.6g}\n",
             statistics.observations_per_image.min, statistics.observations_per_image.max,
             statistics.observations_per_image.median);
  fmt::print("rms         {:.6g} px at the start\n", evaluation.rms_px);
  if (!json.empty())
    write_json(
        document_of(arguments, scene, statistics, evaluation.rms_px, write_s, total.seconds()),
        json);
  return 0;
}

}  // namespace

void add_generate(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App& verb = *app.add_subcommand("generate", "make a synthetic scene, disturbed");
  verb.add_option("OUT", arguments->out, "the disturbed start: BAL, .gz and .bz2 compressed")
      ->type_name("FILE")
      ->required();
  verb.add_option("--truth", arguments->truth,
                  "also write the undisturbed scene, with its exact pixels")
      ->type_name("FILE");
  add_scene_options(verb, arguments->scene);
  add_common_options(verb, arguments->common);
  verb.footer("Example:\n  sheaf generate scene.txt --cameras 40 --points 3000 --truth truth.txt");
  verb.callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace sheaf
