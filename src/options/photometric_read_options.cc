// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "options/photometric_options.h"
#include "platform/real_text.h"

namespace sheaf {
namespace {

using F = FieldsOf<PhotometricReadOptions>;
using Table = OptionTable<PhotometricReadOptions>;

std::optional<Pinhole> read_intrinsics(const std::string& text) {
  std::array<double, 4> v{};
  const char *p = text.data(), *end = p + text.size();
  for (std::size_t k = 0; k < v.size(); ++k) {
    const auto [stop, error] = read_real(p, end, v[k]);
    const bool last = k + 1 == v.size();
    if (error != std::errc() || !std::isfinite(v[k]) || (k < 2 && v[k] == 0) ||
        (last ? stop != end : stop == end || *stop != ','))
      return {};
    p = last ? stop : stop + 1;
  }
  return Pinhole{v[0], v[1], v[2], v[3]};
}

std::string intrinsics_text(const Pinhole& c) {
  std::string out;
  for (const double number : {c.fx, c.fy, c.cx, c.cy})
    out += (out.empty() ? "" : ",") + text_of(OptionValue(number));
  return out;
}

OptionField<PhotometricReadOptions> intrinsics_field() {
  return F::made(
      OptionKind::text,
      {.name = "intrinsics",
       .placeholder = "FX,FY,CX,CY",
       .nothing = true,
       .help = "fx,fy,cx,cy of all images, pixels, instead of intrinsics.txt; the first pixel's "
               "centre is (0, 0)",
       .wrong =
           [](const std::string& text) {
             return read_intrinsics(text) ? std::string()
                                          : "expected fx,fy,cx,cy in pixels, focal lengths not 0, "
                                            "not '" +
                                                text + "'";
           }},
      [](const PhotometricReadOptions& o) {
        return o.camera ? OptionValue(intrinsics_text(*o.camera)) : OptionValue();
      },
      [](PhotometricReadOptions& o, const OptionValue& value) {
        const std::string* text = std::get_if<std::string>(&value);
        o.camera = text != nullptr ? read_intrinsics(*text) : std::nullopt;
      });
}

OptionField<PhotometricReadOptions> images_field() {
  return F::made(
      OptionKind::text,
      {.name = "images",
       .placeholder = "FOLDER",
       .nothing = true,
       .help = "of a COLMAP model: folder with its images; not given: the model's own `images`"},
      [](const PhotometricReadOptions& o) {
        return o.images.empty() ? OptionValue() : OptionValue(o.images.string());
      },
      [](PhotometricReadOptions& o, const OptionValue& value) {
        const std::string* text = std::get_if<std::string>(&value);
        o.images = text != nullptr ? *text : "";
      });
}

/// Which points an RGB-D sequence gives, and where they count.
Table depth_fields() {
  using O = PhotometricReadOptions;
  return {
      F::real(&O::depth_scale, {.name = "depth-scale",
                                .placeholder = "N",
                                .range = between(1e-6, 1e9),
                                .help = "RGB-D: what a depth image has for one unit of the poses, "
                                        "0 and 65535 being no depth"}),
      F::whole(&O::every, {.name = "every",
                           .placeholder = "N",
                           .range = from(1),
                           .help = "RGB-D: take the first image and every N-th after it"}),
      F::whole(&O::cell_px,
               {.name = "cell",
                .placeholder = "PX",
                .unit = "px",
                .range = from(1),
                .help = "RGB-D: take at most one point from each square of this size"}),
      F::real(&O::least_slope, {.name = "min-slope",
                                .placeholder = "G",
                                .range = from(0),
                                .help = "RGB-D: grey levels per pixel that a point needs"}),
      F::whole(&O::max_points, {.name = "max-points",
                                .placeholder = "N",
                                .range = from(1),
                                .help = "RGB-D: take those with the steepest slopes"}),
      F::real(&O::depth_tolerance,
              {.name = "depth-tolerance",
               .placeholder = "F",
               .range = above(0),
               .help = "RGB-D: a patch counts in an image whose depth map has its depth, to this "
                       "part"}),
  };
}

/// Of poses, for an experiment.
Table noise_fields() {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  return {
      F::real([](auto& o) -> auto& { return o.noise.rotation_rad; },
              {.name = "disturb-rotation",
               .placeholder = "RAD",
               .unit = "rad",
               .range = between(0, kInfinity),
               .help = "an experiment: first turn every image by this, about an axis of its own; "
                       "how far poses are from those given is then told"}),
      F::real([](auto& o) -> auto& { return o.noise.center; },
              {.name = "disturb-center",
               .placeholder = "D",
               .range = between(0, kInfinity),
               .help = "likewise, move every camera centre by this, scene units"}),
      F::whole(
          [](auto& o) -> auto& { return o.noise.seed; },
          {.name = "seed", .placeholder = "N", .range = from(0), .help = "of the disturbance"}),
  };
}

Table make_table() {
  Table table = {intrinsics_field(), images_field()};
  for (const Table& part : {depth_fields(), noise_fields()})
    table.insert(table.end(), part.begin(), part.end());
  return table;
}

}  // namespace

const OptionTable<PhotometricReadOptions>& photometric_read_fields() {
  static const Table kTable = make_table();
  return kTable;
}

}  // namespace sheaf
