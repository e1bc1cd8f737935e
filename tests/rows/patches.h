// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "geometry/rigid_motion.h"
#include "rows/photometric.h"
#include "sheaf/photometric.h"
#include "solve/patch_level.h"
#include "systems/patch_blocks.h"

namespace sheaf::test {

/// One scene as the kernels take it, points in the world or on rays.
struct Patches {
  PhotometricOptions options;
  PhotometricScene made;
  PatchScene scene;
  PatchState state;
  std::vector<Sight> sights;
  Batches batches;
  std::vector<double> views, points, rays, leaving;
  std::vector<std::uint32_t> targets;

  explicit Patches(bool on_rays, Interpolation interpolation = Interpolation::bicubic,
                   const char* pattern = "4x4") {
    PhotometricSceneOptions o;
    o.images = 3, o.points = 40, o.width = 96, o.height = 80, o.brightness = 0.1;
    o.start_px = 0.7;
    made = generate(o).value();
    made.start.brightness = {{1.1, -3}, {0.9, 4}, {1.05, 1}};
    options.parametrisation = on_rays ? Parametrisation::inverse_depth : Parametrisation::xyz;
    options.interpolation = interpolation;
    scene = scene_of_level(made.start, options, make_pattern(pattern).value(), 0);
    state = state_of(made.start, on_rays);
    for (const Sight& sight : all_sights(made.start, on_rays))
      if (is_seen(scene, state, sight)) sights.push_back(sight);
    arrange_all();
  }

  void arrange_all() {
    const PatchBlocks blocks(scene, sights);
    Problem shell;
    shell.poses.resize(blocks.count());
    shell.points.resize(state.points.size());
    shell.observation_xy.resize(2 * sights.size());
    for (const Sight& sight : sights) {
      shell.observation_image.push_back(blocks.of(scene, sight));
      shell.observation_point.push_back(sight.point);
    }
    batches = arrange(shell);
    targets = blocks.targets();
    std::vector<RigidMotion<double>> poses;
    for (const Pose& pose : state.poses) poses.push_back({pose.rotation, pose.translation});
    views.resize(kViewRecord * blocks.count());
    blocks.write_views(poses, state.brightness, views.data());
    for (std::size_t g = 0; g < batches.groups.size(); ++g)
      for (int d = 0; d < 3; ++d)
        for (int l = 0; l < 8; ++l) {
          const std::size_t at = 3 * std::size_t(batches.lane_point[8 * g + l]) + d;
          points.push_back(state.points[at]);
          if (scene.has_rays()) rays.push_back(scene.rays[at]);
        }
    leaving.assign(16 * batches.num_batches(), 0);
  }
};

}  // namespace sheaf::test
