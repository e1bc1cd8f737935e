// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/image_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "systems/quantile.h"

namespace sheaf {
namespace {

constexpr std::size_t kRecord = 8 * camera_record::kStateOctets;  // first fields of a camera's

/// Observations of a piece whose point has P.z > 0; and, where `before` is given, had not there.
std::uint64_t count_behind_in(const ImageBatches& batches, const ImageBatches::Piece& piece,
                              const double* now, const double* before) {
  std::uint64_t count = 0;
  const auto depth = [](const double* c, const double* z) {
    return c[6] * z[0] + c[7] * z[8] + c[8] * z[16] + c[camera_record::kTranslation + 2];
  };
  for (std::uint32_t b = 0; b < piece.batches; ++b) {
    const double* z = batches.batches(piece) + ImageBatches::kBatchDoubles * b;
    const std::uint32_t lanes = b + 1 == piece.batches ? piece.last_lanes : 8;
    for (std::uint32_t l = 0; l < lanes; ++l)
      count += depth(now, z + l) > 0 && (before == nullptr || !(depth(before, z + l) > 0));
  }
  return count;
}

/// Adds a piece's sums to a diagonal block as elimination would leave it.
void add_to_block(const double* sums, double* block) {
  for (int i = 0; i < 9; ++i) {
    for (int k = 0; k <= i; ++k) {
      block[diagonal_layout::at(i, k)] += sums[image_sums::entry(i, k)];
    }
    block[diagonal_layout::right_side(i)] += sums[image_sums::kGradient + i];
  }
}

}  // namespace

ImageSystem::ImageSystem(CameraState start, std::vector<std::uint32_t> image_camera,
                         ImageBatches batches, Columns columns, bool watch_behind,
                         const ImageKernels& kernels, Threads& threads)
    : batches_(std::move(batches)),
      columns_(std::move(columns)),
      image_camera_(std::move(image_camera)),
      camera_columns_(CameraColumns::of_bal(columns_, image_camera_)),
      watch_behind_(watch_behind),
      kernels_(kernels),
      threads_(threads),
      lenses_free_(!camera_columns_.parameters().empty()),
      stage_(columns_) {
  held_.cameras = std::move(start);
  tried_.cameras = held_.cameras;
  for (State* state : {&held_, &tried_}) {
    state->records.allocate(kRecord * image_camera_.size());
    state->sums.allocate(image_sums::kCount * batches_.pieces.size());
  }
  write_records(held_);
  diagonal_.allocate(kDiagonalDoubles * image_camera_.size());
  stage_.set_solver(make_block_solver(columns_, threads));
}

std::uint64_t ImageSystem::bytes(std::uint64_t images, std::uint64_t columns,
                                 std::uint64_t batches) {
  const std::uint64_t pieces = batches / ImageBatches::kBatchesPerPiece + images;
  return batches * 8 * ImageBatches::kBatchDoubles +
         pieces * (sizeof(ImageBatches::Piece) + 2 * 8 * image_sums::kCount) +
         images * (2 * (8 * kRecord + 56 + 24) + 36 + 4 + 8 * kDiagonalDoubles + 81 * 8 + 80) +
         5 * 8 * columns;
}

std::uint64_t ImageSystem::bytes() const {
  return held_.records.bytes() + tried_.records.bytes() + held_.sums.bytes() + tried_.sums.bytes() +
         diagonal_.bytes() + stage_.bytes();
}

void ImageSystem::write_records(State& state) const {
  for (std::size_t i = 0; i < image_camera_.size(); ++i) {
    double* record = &state.records[kRecord * i];
    const RigidMotion<double>& pose = state.cameras.poses[i];
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    std::copy(R.begin(), R.end(), record);
    std::copy(pose.translation.begin(), pose.translation.end(),
              record + camera_record::kTranslation);
    std::copy_n(state.cameras.sets[image_camera_[i]].begin(), 3, record + camera_record::kFocal);
    record[kRecord - 1] = 0;
  }
}

void ImageSystem::linearize(State& state) {
  constexpr std::size_t kPiecesPerTask = 4;
  const auto& pieces = batches_.pieces;
  threads_.for_each((pieces.size() + kPiecesPerTask - 1) / kPiecesPerTask, [&](std::size_t task) {
    const std::size_t end = std::min(pieces.size(), (task + 1) * kPiecesPerTask);
    for (std::size_t p = task * kPiecesPerTask; p < end; ++p)
      kernels_.sum(batches_.batches(pieces[p]), pieces[p],
                   &state.records[kRecord * pieces[p].image], loss_, lenses_free_,
                   &state.sums[image_sums::kCount * p]);
  });
}

ReducedSums ImageSystem::gather(const State& state) {
  diagonal_.fill(0);
  for (std::size_t p = 0; p < batches_.pieces.size(); ++p)
    add_to_block(&state.sums[image_sums::kCount * p],
                 &diagonal_[kDiagonalDoubles * batches_.pieces[p].image]);
  return {nullptr, nullptr, diagonal_.data()};
}

Costs ImageSystem::costs_of(const State& state) const {
  double square = 0, loss = 0;
  for (std::size_t at = 0; at < state.sums.size(); at += image_sums::kCount) {
    square += state.sums[at + image_sums::kSquare];
    loss += state.sums[at + image_sums::kLoss];
  }
  return Costs::of(loss_, square, loss);
}

Step ImageSystem::propose(const StepRequest& request) {
  stretch_ = request.stretch;
  const bool same_loss = request.loss == loss_;
  loss_ = request.loss;
  if (!linearized_ || !same_loss) linearize(held_);
  linearized_ = true;
  const Costs costs = costs_of(held_);
  const ReducedSums sums = gather(held_);
  Step step;
  step.plain_cost = costs.square / 2;
  step.cost = costs.robust / 2;
  step.gradient_max = stage_.gather(sums, request.damping);
  step.solved = costs.finite() && stage_.solve(sums, request, step);
  return step;
}

Trial ImageSystem::trial() {
  Trial out;
  const Buffer<double>& step = stage_.step();
  out.step_norm = camera_columns_.step(
      held_.cameras, stretch_ == 1 ? step : stage_.blend(stretch_, 0, step), tried_.cameras);
  write_records(tried_);
  linearize(tried_);
  const Costs costs = costs_of(tried_);
  out.plain_cost = costs.square / 2;
  out.cost = costs.robust / 2;
  out.predicted_decrease = stage_.add_decrease(0) / 2;
  if (watch_behind_) out.newly_behind = count_newly_behind();
  return out;
}

void ImageSystem::accept() { std::swap(held_, tried_); }

std::uint64_t ImageSystem::count_newly_behind() const {
  std::uint64_t count = 0;
  for (const auto& piece : batches_.pieces)
    count += count_behind_in(batches_, piece, &tried_.records[kRecord * piece.image],
                             &held_.records[kRecord * piece.image]);
  return count;
}

std::uint64_t ImageSystem::count_behind() {
  std::uint64_t count = 0;
  for (const auto& piece : batches_.pieces)
    count += count_behind_in(batches_, piece, &held_.records[kRecord * piece.image], nullptr);
  return count;
}

double ImageSystem::residual_scale(double quantile) {
  QuantileSearch search(quantile, 2 * batches_.observations);
  Buffer<double> residuals(16 * ImageBatches::kBatchesPerPiece);
  while (!search.done()) {
    DigitCounts counts;
    for (const auto& piece : batches_.pieces) {
      kernels_.residuals(batches_.batches(piece), piece, &held_.records[kRecord * piece.image],
                         residuals.data());
      for (std::uint32_t b = 0; b < piece.batches; ++b)
        for (std::uint32_t l = 0; l < (b + 1 == piece.batches ? piece.last_lanes : 8); ++l)
          for (std::uint32_t d = 0; d < 2; ++d) search.count(residuals[16 * b + 8 * d + l], counts);
    }
    search.narrow(counts);
  }
  return search.value();
}

}  // namespace sheaf
