// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "photometric/generate_photometric.h"

#include <fmt/format.h>

#include <utility>

#include "json_document.h"
#include "options/scene_options.h"
#include "outputs.h"
#include "sheaf/io.h"
#include "terminal.h"
#include "timer.h"

namespace sheaf {
namespace {

void write_folder(PhotometricProblem problem, const std::string& path) {
  PhotometricFolder folder;
  folder.problem = std::move(problem);
  write_photometric(folder, path).value();
}

Json document_of(const PhotometricSceneOptions& o, const std::string& out, const std::string& truth,
                 double total_s) {
  return {{"version", SHEAF_VERSION},
          {"options",
           {{"cameras", o.images},
            {"points", o.points},
            {"wavelength_px", o.wavelength_px},
            {"relief", o.relief},
            {"grey_noise", o.noise_grey},
            {"brightness", o.brightness},
            {"vignette", o.vignette},
            {"occluder", o.occluder},
            {"outliers", o.outliers},
            {"start_px", o.start_px},
            {"measured_px", o.measured_px < 0 ? Json() : Json(o.measured_px)},
            {"seed", o.seed}}},
          {"output", out},
          {"truth", truth.empty() ? Json() : Json(truth)},
          {"images", o.images},
          {"points", o.points},
          {"time", {{"total_s", total_s}}}};
}

}  // namespace

std::vector<BoundOption> options_of(PhotometricSceneArguments& arguments) {
  using F = FieldsOf<PhotometricSceneArguments>;
  std::vector<BoundOption> out = bound<PhotometricSceneArguments>(
      {F::flag(&PhotometricSceneArguments::chosen,
               {.name = "photometric",
                .help = "make images of a textured surface instead: OUT and --truth are folders "
                        "for `sheaf photometric`; of the other options --cameras (6), --points "
                        "(2000), --outliers (0, points at a wrong depth) and --seed count",
                .excludes = {"like", "family", "camera", "drift", "mean-track", "pixel-noise",
                             "rotation-noise", "center-noise", "point-noise", "focal-noise"}})},
      arguments);
  for (BoundOption& option : bound(photometric_scene_fields(), arguments.scene)) {
    option.spec.needs = {"photometric"};
    out.push_back(std::move(option));
  }
  return out;
}

int generate_photometric(const PhotometricSceneOptions& options, const std::string& out,
                         const std::string& truth, const std::string& json, Interrupt& interrupt) {
  const Timer total;
  check_outputs({{.option = "OUT", .path = out, .folder = true},
                 {.option = "--truth", .path = truth, .folder = true},
                 {"--json", json}});
  PhotometricScene made = generate(options).value();
  interrupt.begin_write();
  if (!truth.empty()) write_folder(std::move(made.truth), truth);
  write_folder(std::move(made.start), out);
  print_out("{}: {} images of {} x {} pixels, {} points\n", out, options.images, options.width,
            options.height, options.points);
  if (!json.empty()) write_json(document_of(options, out, truth, total.seconds()), json);
  return 0;
}

}  // namespace sheaf
