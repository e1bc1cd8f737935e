// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "photometric/photometric_demo.h"

#include <fmt/format.h>

#include "errors_document.h"
#include "sheaf/io.h"
#include "terminal.h"
#include "timer.h"

namespace sheaf {

PhotometricDemo run_photometric_demo(std::uint64_t seed, int threads, const StopToken& stop) {
  PhotometricDemo demo;
  PhotometricSceneOptions& o = demo.scene;
  o.images = 5, o.points = 800, o.relief = 0.01;
  o.eight_bit = true, o.noise_grey = 2, o.brightness = 0.1, o.start_px = 1.5;
  o.seed = seed;
  PhotometricScene scene = generate(o).value();
  const Problem truth = cloud_of(scene.truth);
  demo.before = compare_states(cloud_of(scene.start), truth, true).value();
  PhotometricOptions options;
  options.threads = threads;
  options.stop = stop;
  const Timer timer;
  demo.summary = refine_photometric(scene.start, options).value();
  demo.seconds = timer.seconds();
  demo.after = compare_states(cloud_of(scene.start), truth, true).value();
  return demo;
}

void tell(const PhotometricDemo& demo) {
  const PhotometricSceneOptions& o = demo.scene;
  print_out(
      "\nThe same from pixels: {} images of {} x {}, {} patches of 4 x 4 pixels and no features;\n"
      "{} grey levels of noise, brightness off by up to {:.0f} %, the start by {} px.\n\n",
      o.images, o.width, o.height, o.points, o.noise_grey, 100 * o.brightness, o.start_px);
  const auto line = [](const char* what, double a, double b) {
    print_out("{:<28} {:>12.6g} {:>12.6g}\n", what, a, b);
  };
  print_out("{:<28} {:>12} {:>12}\n", "rms, then median errors", "start", "refined");
  line("rms (grey levels)", demo.summary.initial_rms_grey, demo.summary.final_rms_grey);
  line("rotations (rad)", demo.before.rotation_error_rad.median,
       demo.after.rotation_error_rad.median);
  line("camera centres", demo.before.center_error.median, demo.after.center_error.median);
  line("points", demo.before.point_error.median, demo.after.point_error.median);
  print_out("\n{} steps in {:.3f} s: {}.\n", demo.summary.solve.iterations.size() - 1, demo.seconds,
            demo.summary.solve.words);
}

Json photometric_demo_json(const PhotometricDemo& demo) {
  const PhotometricSummary& s = demo.summary;
  return {
      {"images", demo.scene.images},
      {"points", demo.scene.points},
      {"rms_grey", {{"before", number(s.initial_rms_grey)}, {"after", number(s.final_rms_grey)}}},
      {"errors", {{"before", errors_json(demo.before)}, {"after", errors_json(demo.after)}}},
      {"solve_s", demo.seconds}};
}

}  // namespace sheaf
