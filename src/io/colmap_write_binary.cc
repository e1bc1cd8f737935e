// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <concepts>

#include "geometry/camera_model.h"
#include "io/colmap_form.h"
#include "io/colmap_lens.h"

namespace sheaf {
namespace {

void put(std::string& out, std::unsigned_integral auto word) {
  for (std::size_t shift = 0; shift < 8 * sizeof word; shift += 8)
    out += static_cast<char>(word >> shift);
}
void put(std::string& out, double x) { put(out, std::bit_cast<std::uint64_t>(x)); }

}  // namespace

std::string cameras_binary(const ColmapForm& form) {
  std::string out;
  put(out, std::uint64_t{form.problem->cameras.size()});
  for (std::size_t c = 0; c < form.problem->cameras.size(); ++c) {
    const Camera camera = *colmap_lens(form.problem->cameras[c]);
    put(out, form.camera_ids[c]);
    put(out, static_cast<std::uint32_t>(colmap_id(camera.model)));
    put(out, camera.width_px);
    put(out, camera.height_px);
    for (std::size_t k = 0; k < parameter_count(camera.model); ++k) put(out, camera.parameters[k]);
  }
  return out;
}

std::string images_binary(const ColmapForm& form) {
  const FeatureTable& features = form.features;
  std::string out;
  put(out, std::uint64_t{form.problem->num_images()});
  for (std::size_t j = 0; j < form.problem->num_images(); ++j) {
    put(out, form.image_ids[j]);
    for (const double x : form.poses[j]) put(out, x);
    put(out, form.camera_ids[form.problem->image_camera[j]]);
    out.append(form.names[j]) += '\0';
    put(out, std::uint64_t{features.begin[j + 1] - features.begin[j]});
    for (std::uint64_t k = features.begin[j]; k < features.begin[j + 1]; ++k) {
      put(out, features.xy[2 * k]);
      put(out, features.xy[2 * k + 1]);
      put(out, features.point[k]);
    }
  }
  return out;
}

std::string points_binary(const ColmapForm& form) {
  const FeatureTable& features = form.features;
  std::string out;
  put(out, std::uint64_t{form.problem->num_points()});
  for (std::size_t p = 0; p < form.problem->num_points(); ++p) {
    put(out, form.point_ids[p]);
    for (std::size_t k = 0; k < 3; ++k) put(out, form.problem->points[3 * p + k]);
    for (const std::uint8_t c : form.colours[p]) put(out, c);
    put(out, form.errors_px[p]);
    put(out, std::uint64_t{features.track[p + 1] - features.track[p]});
    for (std::uint64_t k = features.track[p]; k < features.track[p + 1]; ++k) {
      const std::uint64_t i = features.order[k];
      put(out, form.image_ids[form.problem->observation_image[i]]);
      put(out, features.of_observation[i]);
    }
  }
  return out;
}

}  // namespace sheaf
