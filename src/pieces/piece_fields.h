// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// What the file of a piece consists of, field by field (platform/archive.h).
#pragma once

#include "pieces/scene_piece.h"
#include "solve/checkpoint_fields.h"

namespace sheaf {

template <class A>
void archive(A& a, Ghost& x) {
  a(x.piece, x.index);
}
/// Without rigs and metadata, which pieces have not.
template <class A>
void archive(A& a, Problem& x) {
  a(x.poses, x.image_camera, x.cameras, x.points, x.observation_image, x.observation_point,
    x.observation_xy, x.observation_sigma, x.terms);
}
template <class A>
void archive(A& a, ScenePiece& x) {
  a(x.number, x.pieces, x.scene, x.scene_images, x.scene_points, x.scene_observations, x.problem,
    x.owned_images, x.owned_cameras, x.image, x.camera, x.point, x.ghost_images, x.ghost_cameras);
}

}  // namespace sheaf
