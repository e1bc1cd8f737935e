// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// What a checkpoint and its fingerprint consist of, field by field (platform/archive.h).
#pragma once

#include "platform/archive.h"
#include "solve/checkpoint.h"

namespace sheaf {

template <class A>
void archive(A& a, Pose& x) {
  a(x.rotation, x.translation);
}
template <class A>
void archive(A& a, Camera& x) {
  a(x.model, x.parameters, x.width_px, x.height_px);
}
template <class A>
void archive(A& a, Rigs& x) {
  a(x.count, x.sensor_from_rig, x.sensor_rig, x.is_reference, x.rig_from_world, x.frame_rig,
    x.image_frame, x.image_sensor);
}
template <class A>
void archive(A& a, Fixed& x) {
  a(x.points, x.poses, x.intrinsics, x.f, x.k1, x.k2, x.sensors, x.pose_ids, x.frame_ids,
    x.sensor_ids, x.camera_ids, x.k1_ids, x.k2_ids, x.parameters);
}

template <class A>
void archive(A& a, TermLoss& x) {
  a(x.kind, x.scale);
}
template <class A>
void archive(A& a, CentrePrior& x) {
  a(x.image, x.position, x.covariance, x.loss, x.lever_arm);
}
template <class A>
void archive(A& a, RotationPrior& x) {
  a(x.image, x.rotation, x.covariance, x.loss);
}
template <class A>
void archive(A& a, GravityPrior& x) {
  a(x.image, x.measured, x.down, x.sigma_rad, x.loss);
}
template <class A>
void archive(A& a, RelativePosePrior& x) {
  a(x.first, x.second, x.rotation, x.translation, x.square_root, x.loss);
}
template <class A>
void archive(A& a, ParameterPrior& x) {
  a(x.camera, x.parameter, x.value, x.sigma, x.loss);
}
template <class A>
void archive(A& a, ParameterBound& x) {
  a(x.camera, x.parameter, x.lower, x.upper);
}
template <class A>
void archive(A& a, PointPrior& x) {
  a(x.point, x.position, x.covariance);
}
template <class A>
void archive(A& a, DistancePrior& x) {
  a(x.first, x.second, x.distance, x.sigma, x.loss);
}
template <class A>
void archive(A& a, GaussianPrior::Block& x) {
  a(x.kind, x.index, x.state);
}
template <class A>
void archive(A& a, GaussianPrior& x) {
  a(x.blocks, x.square_root, x.mean, x.loss);
}
template <class A>
void archive(A& a, Terms& x) {
  a(x.centres, x.rotations, x.gravities, x.relative_poses, x.parameters, x.points, x.distances,
    x.gaussians, x.bounds, x.kept_points);
}

template <class A>
void archive(A& a, Iteration& x) {
  a(x.index, x.round, x.start_cost, x.cost, x.trial_cost, x.accepted, x.damping, x.radius, x.reused,
    x.gain_ratio, x.gradient_max, x.step_norm, x.scale_px, x.loss_floor, x.linear_iterations,
    x.passes, x.time_s);
}
template <class A>
void archive(A& a, LossRound& x) {
  a(x.scale_px, x.sigma_px, x.initial_cost, x.final_cost, x.steps);
}
template <class A>
void archive(A& a, Recovery& x) {
  a(x.after_step, x.passes, x.taken, x.from_start, x.cost_before, x.cost_after);
}
template <class A>
void archive(A& a, SolverChange& x) {
  a(x.after_step, x.iterations, x.from, x.to);
}
/// What a run that goes on does not find out anew.
template <class A>
void archive(A& a, Summary& x) {
  a(x.initial_cost, x.final_cost, x.initial_plain_cost, x.final_plain_cost, x.termination, x.words,
    x.iterations, x.recoveries, x.loss, x.rounds, x.final_sigma_px, x.solver, x.solver_reason,
    x.solver_changes, x.points, x.points_reason, x.precision, x.forecast_bytes,
    x.behind_camera_before);
}

template <class A>
void archive(A& a, Damping& x) {
  a(x.lambda, x.growth, x.first, x.was_exact, x.floor);
}
template <class A>
void archive(A& a, CurvatureFloor& x) {
  a(x.delta);
}
template <class A>
void archive(A& a, StepControl::State& x) {
  a(x.damping, x.radius, x.shorten, x.floor, x.raise);
}
template <class A>
void archive(A& a, LoopHistory& x) {
  a(x.control, x.costs_known, x.cost, x.plain_cost, x.forcing, x.precise, x.small_decreases,
    x.last_decrease, x.stretch);
}
template <class A>
void archive(A& a, RunProgress& x) {
  a(x.provisional, x.returns, x.round_begin, x.rejected_in_a_row, x.any_finite_trial,
    x.last_iterations, x.attempt_begin);
}

template <class A>
void archive(A& a, RecycledModes::History& x) {
  std::uint64_t kept = x.kept, next = x.next;
  a(kept, next, x.modes, x.weights);
  x.kept = kept, x.next = next;
}
template <class A>
void archive(A& a, CoarseSchedule& x) {
  x.fields(a);
}
template <class A>
void archive(A& a, CoarseSpace::History& x) {
  a(x.schedule, x.basis, x.row_basis, x.sums, x.own);
}
template <class A>
void archive(A& a, CameraStage::History& x) {
  a(x.modes, x.coarse);
}
template <class A>
void archive(A& a, HomeHistory& x) {
  a(x.stage, x.own_damping);
}
template <class A>
void archive(A& a, RigidMotion<double>& x) {
  a(x.rotation, x.translation);
}
template <class A>
void archive(A& a, CameraState& x) {
  a(x.poses, x.sets, x.sensors, x.frames, x.kept);
}
template <class A>
void archive(A& a, Estimate& x) {
  a(x.poses, x.cameras, x.points, x.sensors, x.frames);
}
template <class A>
void archive(A& a, RunIdentity& x) {
  a(x.problem, x.names, x.values);
}
template <class A>
void archive(A& a, Checkpoint& x) {
  a(x.identity, x.summary, x.loop, x.progress, x.home, x.attempt_start, x.cameras, x.points,
    x.recoveries, x.solver, x.initial_damping);
}

}  // namespace sheaf
