// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/bal_rows.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "eliminate/lens_kernels.h"
#include "lists/block_layout.h"
#include "lists/slices.h"

namespace sheaf {

BalRows::BalRows(const Arrangement& arrangement, std::vector<std::uint32_t> image_camera,
                 const Kernels& kernels, Threads& threads)
    : batches_(arrangement.batches),
      chunks_(arrangement.lists.chunks),
      image_camera_(std::move(image_camera)),
      columns_(arrangement.columns),
      kernels_(kernels),
      pairs_(has_poses_alone() &&
                     is_small(linearize_flops(batches_.num_batches(), chunks_.pairs.size()),
                              chunks_.tiles.size(), image_camera_.size())
                 ? lens_kernels(kernels.name).pose_pairs
                 : kernels.pairs),
      threads_(threads) {
  held_.allocate(kCameraRecord * image_camera_.size());
  tried_.allocate(kCameraRecord * image_camera_.size());
}

/// Windows have their intrinsics held. Sums of six columns have another order than those of nine,
/// and larger scenes keep theirs.
bool BalRows::has_poses_alone() const {
  for (std::size_t i = 0; i < columns_.num_images(); ++i)
    for (int k = 6; k < 9; ++k)
      if (columns_.image(i)[k] >= 0) return false;
  return true;
}

void BalRows::attach(const SteppedState& state) {
  state_ = &state;
  write_records(state.held.cameras, held_);
}

BalState BalRows::held_state() {
  return {&batches_, &chunks_, &held_, &state_->held.points, &state_->factors, &state_->metric};
}

void BalRows::write_records(const CameraState& cameras, Buffer<double>& records) const {
  for (std::size_t i = 0; i < image_camera_.size(); ++i) {
    double* record = &records[kCameraRecord * i];
    const Matrix3<double> R = matrix_from_quaternion(cameras.poses[i].rotation);
    const auto& t = cameras.poses[i].translation;
    std::copy(R.begin(), R.end(), record);
    std::copy(t.begin(), t.end(), record + camera_record::kTranslation);
    std::copy_n(cameras.sets[image_camera_[i]].begin(), 3, record + camera_record::kFocal);
    std::fill(record + camera_record::kStep, record + kCameraRecord, 0.0);
  }
}

Records BalRows::eliminate(const Elimination& of, std::uint32_t c, double* scratch, double* tiles,
                           double* diagonal, EliminateOutput& out) {
  const EliminateInput in{&batches_,     &chunks_,       held_.data(), state_->held.points.data(),
                          of.damping,    of.points_held, of.loss,      of.chart,
                          of.own_damping};
  const Chunk& chunk = chunks_.chunks[c];
  const Records records = records_in(scratch, chunks_);
  kernels_.linearize(in, chunk, records, out);
  kernels_.diagonal(batches_, chunks_, chunk, records, diagonal);
  pairs_(chunks_, chunk, records, tiles);
  return records;
}

void BalRows::step(const Buffer<double>& columns) {
  for (std::size_t i = 0; i < image_camera_.size(); ++i) {
    const std::int32_t* c = columns_.image(i);
    std::array<double, 9> x{};
    for (std::size_t k = 0; k < 9; ++k)
      if (c[k] >= 0) x[k] = columns[static_cast<std::size_t>(c[k])];
    double* record = &held_[kCameraRecord * i];
    camera_record::write_step(record + camera_record::kFocal, x.data(),
                              record + camera_record::kStep);
  }
  write_records(state_->tried.cameras, tried_);
}

void BalRows::trial(const PointTrial& of, std::uint32_t chunk, TrialOutput& out) {
  const TrialInput in{&batches_,
                      held_.data(),
                      tried_.data(),
                      state_->held.points.data(),
                      state_->factors.data(),
                      of.watch_behind,
                      of.inner_iterations,
                      of.mean_square,
                      of.loss,
                      state_->metric.data(),
                      of.chart,
                      of.blend,
                      of.own};
  kernels_.trial(in, chunks_.chunks[chunk], out);
}

double BalRows::residual_scale(double quantile) const {
  return residual_quantile(batches_, chunks_, quantile, threads_, residual_scratch_,
                           [&](const Chunk& chunk, double* out) {
                             kernels_.residuals(batches_, held_.data(), state_->held.points.data(),
                                                chunk, out);
                           });
}

double BalRows::pixel_rms() const {
  return sheaf::pixel_rms(
      batches_, chunks_, threads_, residual_scratch_, [&](const Chunk& chunk, double* out) {
        kernels_.residuals(batches_, held_.data(), state_->held.points.data(), chunk, out);
      });
}

std::uint64_t BalRows::count_behind() const {
  std::array<std::uint64_t, kMostSlices> counts{};
  threads_.for_each(chunks_.slices.size() - 1, [&](std::size_t s) {
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c)
      counts[s] += kernels_.count_behind(batches_, held_.data(), state_->held.points.data(),
                                         chunks_.chunks[c]);
  });
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t(0));
}

PointRows::Operators BalRows::make_operators(const Columns& columns, bool mixed) {
  auto exact = std::make_unique<BalOperator>(columns, held_state(), kernels_, threads_);
  std::unique_ptr<StateOperator> rounded;
  if (mixed)
    rounded = std::make_unique<FloatBalOperator>(columns, held_state(), kernels_, exact->sums());
  return {std::move(exact), std::move(rounded)};
}

}  // namespace sheaf
