// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "counting_sink.h"
#include "geometry/camera_model.h"
#include "inspect/statistics.h"
#include "interrupt.h"
#include "json_document.h"
#include "options/scene_options.h"
#include "outputs.h"
#include "photometric/generate_photometric.h"
#include "platform/memory.h"
#include "scene_arguments.h"
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
  FamilyArguments family;
  LensArguments lens;
  RigArguments rigs;
  PhotometricSceneArguments photometric;
  std::string out, truth;
  std::set<std::string> given;  ///< names of the options that were
};

/// What was written, whatever way it was made.
struct Made {
  Json counts;
  std::string text;
  Statistics statistics;
  double rms_px = 0;
  Json problem_bytes;  ///< null: it was never held
  double write_s = 0;  ///< of what was held: else writing and making are one
};

bool is_point_cloud(std::filesystem::path path) {
  if (path.extension() == ".gz" || path.extension() == ".bz2") path.replace_extension();
  return path.extension() == ".ply";
}

bool is_model(const Arguments& arguments) {
  return arguments.lens.chosen() || arguments.rigs.chosen();
}

// A scene of rigs or of named lenses is a COLMAP model where its name does not say otherwise.
WriteOptions format_of(const std::string& path, const Arguments& arguments) {
  if (!is_model(arguments) || !std::filesystem::path(path).extension().empty()) return {};
  // Models that COLMAP has no number for stand in its text form by their names.
  const auto lens = camera_model_named(arguments.lens.camera);
  const bool unnumbered = lens && *lens != CameraModel::bal && colmap_id(*lens) < 0;
  return {.format = unnumbered ? "colmap-text" : "colmap"};
}

Made write_whole(const Scene& scene, const Arguments& arguments, Interrupt& interrupt) {
  interrupt.begin_write();
  const Timer writing;
  write(scene.start, arguments.out, format_of(arguments.out, arguments)).value();
  if (!arguments.truth.empty())
    write(scene.truth, arguments.truth, format_of(arguments.truth, arguments)).value();
  const double write_s = writing.seconds();
  return {counts_json(scene.start),     counts_text(scene.start),      statistics_of(scene.start),
          evaluate(scene.start).rms_px, Json(size_bytes(scene.start)), write_s};
}

StreamedScene stream_to(CountingSink& sink, const FamilyOptions& options, SceneState state) {
  const StreamedScene scene = stream(options, state, sink).value();
  sink.commit().value();
  return scene;
}

// What is written while it is made is given up by a signal; what is there already is written.
Made make(const Arguments& arguments, Interrupt& interrupt) {
  if (arguments.rigs.chosen())
    return write_whole(
        generate(rig_options(arguments.rigs, arguments.lens, arguments.scene)).value(), arguments,
        interrupt);
  if (arguments.lens.chosen())
    return write_whole(generate(lens_options(arguments.lens, arguments.scene)).value(), arguments,
                       interrupt);
  if (!arguments.family.chosen())
    return write_whole(generate(arguments.scene).value(), arguments, interrupt);
  const FamilyOptions options = family_options(arguments.family, arguments.scene);
  if (is_point_cloud(arguments.out) || is_point_cloud(arguments.truth))
    return write_whole(generate(options).value(), arguments, interrupt);
  CountingSink start(create_output(arguments.out).value());
  const StreamedScene scene = stream_to(start, options, SceneState::start);
  if (!arguments.truth.empty()) {
    CountingSink truth(create_output(arguments.truth).value());
    stream_to(truth, options, SceneState::truth);
  }
  return {start.totals_json(), start.totals_text(), start.statistics(), scene.rms_px, Json(), 0};
}

Json document_of(const Arguments& arguments, const Made& made, double total_s) {
  Json document = {{"version", SHEAF_VERSION},
                   {"options", scene_options_json(arguments.scene)},
                   {"output", arguments.out},
                   {"truth", arguments.truth.empty() ? Json() : Json(arguments.truth)}};
  document["options"].update(family_json(arguments.family, arguments.scene));
  document["options"].update(lens_json(arguments.lens));
  document["options"].update(rig_json(arguments.rigs, arguments.lens));
  document.update(made.counts);
  document.update(statistics_json(made.statistics));
  document["rms_px"] = number(made.rms_px);
  document["memory"] = {{"problem_bytes", made.problem_bytes},
                        {"peak_bytes", peak_resident_bytes()}};
  document["time"] = {{"write_s", made.write_s}, {"total_s", total_s}};
  return document;
}

int run(const Arguments& arguments) {
  const Timer total;
  Interrupt interrupt(arguments.common.quiet);
  const std::string& json = arguments.common.json;
  const bool folders = is_model(arguments);
  check_outputs(
      {{"OUT", arguments.out, folders}, {"--truth", arguments.truth, folders}, {"--json", json}});
  const Made made = make(arguments, interrupt);
  const Statistics& statistics = made.statistics;
  print_out("{}: {}\n", arguments.out, made.text);
  print_out("tracks      {:.0f} to {:.0f} observations a point, mean {:.3f}\n",
            statistics.track.min, statistics.track.max, statistics.mean_track);
  print_out("images      {:.0f} to {:.0f} observations, median {:.6g}\n",
            statistics.observations_per_image.min, statistics.observations_per_image.max,
            statistics.observations_per_image.median);
  print_out("rms         {:.6g} px at the start\n", made.rms_px);
  if (!json.empty()) write_json(document_of(arguments, made, total.seconds()), json);
  return 0;
}

// Of images; what both kinds of scenes have under one name has a default of its own in each.
int run_photometric(const Arguments& arguments) {
  PhotometricSceneOptions options = arguments.photometric.scene;
  options.eight_bit = true;
  if (arguments.given.contains("cameras"))
    options.images = static_cast<std::uint32_t>(arguments.scene.images);
  if (arguments.given.contains("points"))
    options.points = static_cast<std::uint32_t>(arguments.scene.points);
  if (arguments.given.contains("outliers")) options.outliers = arguments.family.outliers;
  options.seed = arguments.scene.seed;
  Interrupt interrupt(arguments.common.quiet);
  return generate_photometric(options, arguments.out, arguments.truth, arguments.common.json,
                              interrupt);
}

void remember_given(std::vector<BoundOption>& options, std::set<std::string>& given) {
  for (BoundOption& option : options)
    option.put = [&given, name = option.spec.name, put = option.put](const OptionValue& value) {
      given.insert(name);
      put(value);
    };
}

}  // namespace

Verb generate_verb() {
  using F = FieldsOf<Arguments>;
  auto a = std::make_shared<Arguments>();
  Verb verb{"generate", "make a synthetic scene, disturbed",
            "Example:\n  sheaf generate scene.txt --cameras 40 --points 3000 --truth truth.txt\n"
            "\nA synthetic scene of a published problem's size:\n"
            "  sheaf generate street.txt --like ladybug-138\n"
            "\nA COLMAP model of 500 images through one fisheye:\n"
            "  sheaf generate model --camera OPENCV_FISHEYE --shared --cameras 500 --points 20000\n"
            "\nA COLMAP model of six cameras around that drive along a street:\n"
            "  sheaf generate drive --rigs around --frames 100 --points 10000\n"
            "\nImages of a textured surface, poses and points for sheaf photometric:\n"
            "  sheaf generate scene --photometric --truth truth"};
  verb.places = bound<Arguments>(
      {F::text(&Arguments::out,
               {.name = "OUT",
                .placeholder = "FILE",
                .help = "the disturbed start: BAL, .gz and .bz2 compressed; a folder with --camera "
                        "and --rigs (a COLMAP model) and --photometric"})},
      *a);
  verb.options = joined(
      {bound<Arguments>(
           {F::text(&Arguments::truth, {.name = "truth",
                                        .placeholder = "FILE",
                                        .help = "also write the undisturbed scene, with its exact "
                                                "pixels"})},
           *a),
       bound(scene_fields(), a->scene), options_of(a->family), options_of(a->lens),
       options_of(a->rigs), options_of(a->photometric), options_of(a->common)});
  remember_given(verb.options, a->given);
  verb.run = [a] { return a->photometric.chosen ? run_photometric(*a) : run(*a); };
  return verb;
}

}  // namespace sheaf
