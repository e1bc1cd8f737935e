// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "rigs_option.h"

#include <fmt/format.h>

#include <cstdio>

#include "io/rig_configuration_file.h"
#include "scene/rig_configuration.h"
#include "terminal.h"

namespace sheaf {
namespace {

void report(const RigLayout& layout, const std::string& path) {
  print_err("rigs        {}: {} sensors, {} frames of {} images, {} images of no rig\n", path,
            layout.sensors.size(), layout.frames, layout.images, layout.images_of_no_rig);
  if (layout.copied_cameras > 0)
    print_err(
        "            {} sensors that shared a camera have a copy of it, since a COLMAP "
        "model has one camera for each sensor\n",
        layout.copied_cameras);
  for (const SensorSpread& s : layout.sensors) {
    if (s.reference) {
      print_err("            {}: reference, {} images\n", s.image_prefix, s.images);
      continue;
    }
    print_err(
        "            {}: {}, {} images; in {} frames their poses were off by {:.3g} rad and "
        "{:.3g} (medians), {:.3g} rad and {:.3g} at most\n",
        s.image_prefix,
        s.stated ? "pose as stated" : "pose averaged (the mean within three medians of the median)",
        s.images, s.frames, s.median_rotation_rad, s.median_translation, s.max_rotation_rad,
        s.max_translation);
  }
}

Json sensors_json(const RigLayout& layout) {
  Json list = Json::array();
  for (const SensorSpread& s : layout.sensors)
    list.push_back(
        {{"image_prefix", s.image_prefix},
         {"reference", s.reference},
         {"stated", s.stated},
         {"images", s.images},
         {"frames", s.frames},
         {"rotation_rad",
          {{"median", number(s.median_rotation_rad)}, {"max", number(s.max_rotation_rad)}}},
         {"translation",
          {{"median", number(s.median_translation)}, {"max", number(s.max_translation)}}}});
  return list;
}

}  // namespace

std::vector<BoundOption> options_of(RigsArguments& arguments) {
  using F = FieldsOf<RigsArguments>;
  return bound<RigsArguments>(
      {F::text(&RigsArguments::path,
               {.name = "rigs",
                .placeholder = "FILE",
                .help = "COLMAP's rig_config.json: images whose names begin with a prefix are of a "
                        "sensor, those whose names go on alike of one frame, and move as one"})},
      arguments);
}

Json lay_rigs(const RigsArguments& arguments, InputFile& input, bool quiet) {
  if (arguments.path.empty()) return {};
  const RigConfigurationFile file = read_rig_configuration(arguments.path).value();
  const Result<RigLayout> laid = lay_rigs(input.problem, file.rigs);
  if (!laid.ok()) throw Error(laid.error().code(), arguments.path + ": " + laid.error().what());
  const RigLayout& layout = laid.value();
  if (!quiet) report(layout, arguments.path);
  input.notes.insert(input.notes.end(), file.notes.begin(), file.notes.end());
  return {{"path", arguments.path},
          {"sensors", sensors_json(layout)},
          {"frames", layout.frames},
          {"images", layout.images},
          {"images_of_no_rig", layout.images_of_no_rig},
          {"copied_cameras", layout.copied_cameras},
          {"notes", file.notes}};
}

}  // namespace sheaf
