// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "photometric/photometric_input.h"

#include <array>
#include <cmath>
#include <limits>

#include "platform/real_text.h"
#include "report/errors.h"
#include "verb.h"

namespace sheaf {
namespace {

std::string parse_intrinsics(const std::string& text, Pinhole& out) {
  std::array<double, 4> v{};
  const char *p = text.data(), *end = p + text.size();
  for (std::size_t k = 0; k < v.size(); ++k) {
    const auto [stop, error] = read_real(p, end, v[k]);
    const bool last = k + 1 == v.size();
    if (error != std::errc() || !std::isfinite(v[k]) || (k < 2 && v[k] == 0) ||
        (last ? stop != end : stop == end || *stop != ','))
      return "expected fx,fy,cx,cy in pixels, focal lengths not 0, not '" + text + "'";
    p = last ? stop : stop + 1;
  }
  out = {v[0], v[1], v[2], v[3]};
  return "";
}

/// Poses alone, for the code that compares reprojection problems.
Problem shell_of(const std::vector<Pose>& poses) {
  Problem out;
  for (const Pose& pose : poses) out.add_image(pose, Camera{});
  return out;
}

void add_depth_options(CLI::App& verb, PhotometricReadOptions& o) {
  const double most = std::numeric_limits<double>::max();
  verb.add_option("--depth-scale", o.depth_scale,
                  "RGB-D: what a depth image has for one unit of the poses, 0 being no depth")
      ->type_name("N")
      ->check(number_in(1e-6, 1e9, true, "a number from 1e-6 to 1e9"))
      ->capture_default_str();
  verb.add_option("--every", o.every, "RGB-D: take the first image and every N-th after it")
      ->type_name("N")
      ->check(whole_number_from(1, "a whole number from 1 up"))
      ->capture_default_str();
  verb.add_option("--cell", o.cell_px,
                  "RGB-D: take at most one point from each square of PX pixels")
      ->type_name("PX")
      ->check(whole_number_from(1, "a whole number of pixels from 1 up"))
      ->capture_default_str();
  verb.add_option("--min-slope", o.least_slope, "RGB-D: grey levels per pixel that a point needs")
      ->type_name("G")
      ->check(number_in(0, most, true, "a number from 0 up"))
      ->capture_default_str();
  verb.add_option("--max-points", o.max_points, "RGB-D: take those with the steepest slopes")
      ->type_name("N")
      ->check(whole_number_from(1, "a whole number from 1 up"))
      ->capture_default_str();
  verb.add_option("--depth-tolerance", o.depth_tolerance,
                  "RGB-D: a patch counts in an image whose depth map has its depth, to this part")
      ->type_name("F")
      ->check(number_in(0, most, false, "a number above 0"))
      ->capture_default_str();
}

}  // namespace

void add_photometric_input_options(CLI::App& verb, PhotometricInputArguments& a) {
  const double inf = std::numeric_limits<double>::infinity();
  verb.add_option("--intrinsics", a.intrinsics,
                  "fx,fy,cx,cy of all images, pixels, instead of intrinsics.txt; the first pixel's "
                  "centre is (0, 0)")
      ->type_name("FX,FY,CX,CY")
      ->check(parsed_by<Pinhole>(parse_intrinsics));
  verb.add_option("--images", a.images,
                  "of a COLMAP model: folder with its images (default: the model's own `images`)")
      ->type_name("FOLDER");
  add_depth_options(verb, a.read);
  verb.add_option(
          "--disturb-rotation", a.read.noise.rotation_rad,
          "an experiment: first turn every image by this, about an axis of its own; how far "
          "poses are from those given is then told")
      ->type_name("RAD")
      ->check(number_in(0, inf, true, "an angle in radians from 0 up"))
      ->capture_default_str();
  verb.add_option("--disturb-center", a.read.noise.center,
                  "likewise, move every camera centre by this, scene units")
      ->type_name("D")
      ->check(number_in(0, inf, true, "a number from 0 up"))
      ->capture_default_str();
  verb.add_option("--seed", a.read.noise.seed, "of the disturbance")
      ->type_name("N")
      ->check(whole_number_from(0, "a whole number from 0 up"))
      ->capture_default_str();
}

PhotometricReadOptions read_options(const PhotometricInputArguments& a) {
  PhotometricReadOptions options = a.read;
  options.images = a.images;
  if (a.intrinsics.empty()) return options;
  Pinhole camera;
  parse_intrinsics(a.intrinsics, camera);
  options.camera = camera;
  return options;
}

Json photometric_input_json(const PhotometricInputArguments& a) {
  const PhotometricReadOptions& o = a.read;
  return {{"intrinsics", a.intrinsics.empty() ? Json() : Json(a.intrinsics)},
          {"images", a.images.empty() ? Json() : Json(a.images)},
          {"depth_scale", o.depth_scale},
          {"every", o.every},
          {"cell_px", o.cell_px},
          {"min_slope", o.least_slope},
          {"max_points", o.max_points},
          {"depth_tolerance", o.depth_tolerance},
          {"disturb_rotation_rad", o.noise.rotation_rad},
          {"disturb_center", o.noise.center},
          {"seed", o.noise.seed}};
}

PoseErrors pose_errors(const PhotometricFolder& folder) {
  const StateErrors errors =
      compare_states(shell_of(folder.problem.poses), shell_of(folder.given_poses), true).value();
  return {errors.rotation_error_rad.mean, errors.center_error.mean};
}

Json pose_errors_json(const std::optional<PoseErrors>& before,
                      const std::optional<PoseErrors>& after) {
  if (!before || !after) return {};
  return {
      {"rotation_error_rad", {{"before", before->rotation_rad}, {"after", after->rotation_rad}}},
      {"center_error", {{"before", before->center}, {"after", after->center}}}};
}

}  // namespace sheaf
