// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <string>

#include "errors_document.h"
#include "exit_code.h"
#include "interrupt.h"
#include "json_document.h"
#include "options/scene_options.h"
#include "options/solve_options.h"
#include "outputs.h"
#include "photometric/photometric_demo.h"
#include "progress.h"
#include "report/errors.h"
#include "sheaf/sheaf.h"
#include "summary_text.h"
#include "terminal.h"
#include "timer.h"
#include "verb.h"

namespace sheaf {
namespace {

struct Arguments {
  CommonOptions common;
  SceneOptions scene;
  std::string ply;
};

// What noise of this size leaves at the optimum: each of the n = 2 x observations components has
// the variance sigma^2, and the fitted parameters take their share.
double expected_rms_px(const Problem& problem, double sigma) {
  const double n = 2.0 * static_cast<double>(problem.num_observations());
  const double parameters = 6.0 * static_cast<double>(problem.num_images()) +
                            3.0 * static_cast<double>(problem.cameras.size()) +
                            3.0 * static_cast<double>(problem.num_points()) - 7;
  return sigma * std::sqrt(std::max(0.0, 2 * (1 - parameters / n)));
}

void tell_beginning(const SceneOptions& scene, const Problem& problem) {
  print_out("A synthetic scene: {} (seed {}).\n", counts_text(problem), scene.seed);
  print_out(
      "The pixels carry {} px of noise; the start is off by {} rad in rotations, {} in\n"
      "camera centres, {} in points (cameras stand about 1 apart) and {} % in focals.\n\n",
      scene.pixel_noise_px, scene.rotation_noise_rad, scene.center_noise, scene.point_noise,
      100 * scene.focal_noise);
}

void tell_end(const SceneOptions& scene, const Problem& problem, const Summary& summary,
              const StateErrors& before, const StateErrors& after) {
  const auto line = [](const char* what, double a, double b) {
    print_out("{:<28} {:>12.6g} {:>12.6g}\n", what, a, b);
  };
  print_out("\n{:<28} {:>12} {:>12}\n", "median error", "start", "solved");
  line("rotations (rad)", before.rotation_error_rad.median, after.rotation_error_rad.median);
  line("camera centres", before.center_error.median, after.center_error.median);
  line("points", before.point_error.median, after.point_error.median);
  print_out("\nThe residual should come down to the noise: {:.4g} px expected, {:.4g} px found.\n",
            expected_rms_px(problem, scene.pixel_noise_px), summary.final_rms_px);
}

Json generated_input(const Problem& problem) {
  Json input = {{"path", nullptr}, {"format", "generated"}, {"compression", "none"},
                {"bytes", 0},      {"sha256", nullptr},     {"notes", Json::array()}};
  input.update(counts_json(problem));
  return input;
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  check_outputs({{"--ply", arguments.ply}, {"--json", json}});
  const Scene scene = generate(arguments.scene).value();
  const double generate_s = total.seconds();
  tell_beginning(arguments.scene, scene.start);
  std::fflush(stdout);  // the progress on stderr comes next

  Problem problem = scene.start;
  Progress progress(arguments.common.quiet);
  SolveOptions options;
  options.threads = arguments.common.threads;
  options.stop = interrupt.token();
  options.on_iteration = [&](const Iteration& iteration) {
    progress.report(iteration);
    return true;
  };
  interrupt.begin_solve();
  const double cpu_before_s = processor_seconds();
  const Summary summary = try_solve(problem, options).value();
  const double cpu_s = processor_seconds() - cpu_before_s;
  const PhotometricDemo photometric =
      run_photometric_demo(arguments.scene.seed, arguments.common.threads, interrupt.token());
  interrupt.begin_write();
  progress.end();

  const StateErrors before = compare_states(scene.start, scene.truth, true).value();
  const StateErrors after = compare_states(problem, scene.truth, true).value();
  print_text(summary_text(summary, 0));
  tell_end(arguments.scene, problem, summary, before, after);
  tell(photometric);
  const Timer writing;
  if (!arguments.ply.empty()) write_ply(scene.start, problem, arguments.ply).value();
  if (!json.empty()) {
    SolveArguments asked;
    SolveRecord record{.input = generated_input(problem),
                       .options = options_json(options_of(asked)),
                       .before = evaluate(scene.start),
                       .after = evaluate(problem),
                       .read_s = generate_s,
                       .cpu_s = cpu_s,
                       .write_s = writing.seconds(),
                       .total_s = total.seconds()};
    Json document = solve_json(record, summary, problem);
    document["scene"] = scene_options_json(arguments.scene);
    document["photometric"] = photometric_demo_json(photometric);
    document["errors"] = {{"before", errors_json(before)}, {"after", errors_json(after)}};
    write_json(document, json);
  }
  return exit_code_of(summary.termination);
}

}  // namespace

Verb demo_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"demo", "make a scene, disturb it, solve it, look at it; then one of images",
            "Example:\n  sheaf demo --cameras 30 --points 2000 --ply demo.ply"};
  verb.options = joined({bound(scene_fields(), a->scene),
                         bound<Arguments>({F::text(&Arguments::ply, ply_of_two_states())}, *a),
                         options_of(a->common)});
  verb.run = [a] { return run(*a); };
  return verb;
}

}  // namespace sheaf
