// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/image_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sheaf {
namespace {

constexpr std::size_t kRecord = 16;  // the first fields of a camera record

/// Observations of a piece whose point has P.z > 0; and, where `before` is given, had not there.
std::uint64_t count_behind_in(const ImageBatches& batches, const ImageBatches::Piece& piece,
                              const double* now, const double* before) {
  std::uint64_t count = 0;
  const auto depth = [](const double* c, const double* z) {
    return c[6] * z[0] + c[7] * z[8] + c[8] * z[16] + c[11];
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
      double& to = i < 8 ? block[8 * i + k] : block[k < 8 ? 64 + k : 88];
      to += sums[image_sums::entry(i, k)];
    }
    block[i < 8 ? 72 + i : 89] += sums[image_sums::kGradient + i];
  }
}

struct Cost {
  double square = 0, loss = 0;
};

Cost sum_of(const Buffer<double>& sums) {
  Cost out;
  for (std::size_t at = 0; at < sums.size(); at += image_sums::kCount) {
    out.square += sums[at + image_sums::kSquare];
    out.loss += sums[at + image_sums::kLoss];
  }
  return out;
}

}  // namespace

ImageSystem::ImageSystem(const Problem& problem, ImageBatches batches, Columns columns,
                         bool watch_behind, const ImageKernels& kernels, Threads& threads)
    : batches_(std::move(batches)),
      columns_(std::move(columns)),
      watch_behind_(watch_behind),
      kernels_(kernels),
      threads_(threads),
      image_camera_(problem.image_camera),
      blocks_(columns_, threads) {
  const std::size_t images = problem.num_images();
  lenses_free_ = false;
  for (std::size_t i = 0; i < images; ++i) {
    held_.poses.push_back({problem.poses[i].rotation, problem.poses[i].translation});
    const auto& lens = problem.cameras[image_camera_[i]].parameters;
    held_.lenses.push_back({lens[0], lens[1], lens[2]});
    const std::int32_t* c = columns_.image(i);
    lenses_free_ = lenses_free_ || std::any_of(c + 6, c + 9, [](auto k) { return k >= 0; });
  }
  tried_.poses = held_.poses;
  tried_.lenses = held_.lenses;
  for (State* state : {&held_, &tried_}) {
    state->cameras.allocate(kRecord * images);
    state->sums.allocate(image_sums::kCount * batches_.pieces.size());
  }
  for (std::size_t i = 0; i < images; ++i) write_record(i, held_);
  diagonal_.allocate(kDiagonalDoubles * images);
  const std::size_t padded = (static_cast<std::size_t>(columns_.count) + 7) / 8 * 8;
  damping_.allocate(padded);
  step_.allocate(padded);
}

std::uint64_t ImageSystem::bytes(std::uint64_t images, std::uint64_t columns,
                                 std::uint64_t batches) {
  const std::uint64_t pieces = batches / ImageBatches::kBatchesPerPiece + images;
  return batches * 8 * ImageBatches::kBatchDoubles +
         pieces * (sizeof(ImageBatches::Piece) + 2 * 8 * image_sums::kCount) +
         images * (2 * (8 * kRecord + 56 + 24) + 36 + 4 + 8 * kDiagonalDoubles + 81 * 8 + 80) +
         5 * 8 * columns;
}

void ImageSystem::write_record(std::size_t image, State& state) const {
  double* record = &state.cameras[kRecord * image];
  const Matrix3<double> R = matrix_from_quaternion(state.poses[image].rotation);
  std::copy(R.begin(), R.end(), record);
  std::copy_n(state.poses[image].translation.begin(), 3, record + 9);
  std::copy_n(state.lenses[image].begin(), 3, record + 12);
  record[15] = 0;
}

void ImageSystem::linearize(State& state) {
  constexpr std::size_t kPiecesPerTask = 4;
  const auto& pieces = batches_.pieces;
  threads_.for_each((pieces.size() + kPiecesPerTask - 1) / kPiecesPerTask, [&](std::size_t task) {
    const std::size_t end = std::min(pieces.size(), (task + 1) * kPiecesPerTask);
    for (std::size_t p = task * kPiecesPerTask; p < end; ++p)
      kernels_.sum(batches_.batches(pieces[p]), pieces[p],
                   &state.cameras[kRecord * pieces[p].image], loss_, lenses_free_,
                   &state.sums[image_sums::kCount * p]);
  });
}

void ImageSystem::gather(const State& state) {
  diagonal_.fill(0);
  for (std::size_t p = 0; p < batches_.pieces.size(); ++p)
    add_to_block(&state.sums[image_sums::kCount * p],
                 &diagonal_[kDiagonalDoubles * batches_.pieces[p].image]);
  vectors_.gather({nullptr, nullptr, diagonal_.data()}, columns_);
}

Step ImageSystem::propose(const StepRequest& request) {
  const bool same_loss = request.loss.kind == loss_.kind && request.loss.scale_px == loss_.scale_px;
  loss_ = request.loss;
  if (!linearized_ || !same_loss) linearize(held_);
  linearized_ = true;
  gather(held_);
  const Cost cost = sum_of(held_.sums);
  Step step;
  step.plain_cost = cost.square / 2;
  step.cost = cost_of(cost.square, cost.loss);
  for (std::int32_t c = 0; c < columns_.count; ++c) {
    const double square = std::clamp(vectors_.squares[c], kDiagonalFloor, kDiagonalCeiling);
    damping_[c] = request.damping * square;
    step.gradient_max = std::max(step.gradient_max, std::abs(vectors_.rhs[c]) / std::sqrt(square));
  }
  if (!std::isfinite(cost.square) || !blocks_.factor(diagonal_.data(), damping_.data()))
    return step;
  blocks_.solve(vectors_.rhs.data(), step_.data());
  step.solved = std::all_of(step_.begin(), step_.begin() + columns_.count,
                            [](double x) { return std::isfinite(x); });
  return step;
}

/// Steps every image; returns the largest relative change of a block, as BundleSystem's.
double ImageSystem::step_images() {
  double largest = 0;
  const auto norm = [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); };
  for (std::size_t i = 0; i < held_.poses.size(); ++i) {
    const std::int32_t* c = columns_.image(i);
    std::array<double, 9> d{};
    for (int k = 0; k < 9; ++k)
      if (c[k] >= 0) d[k] = step_[c[k]];
    const RigidMotion<double>& pose = held_.poses[i];
    const auto& lens = held_.lenses[i];
    tried_.poses[i] =
        c[0] >= 0 ? left_perturbed(pose, {d[0], d[1], d[2]}, {d[3], d[4], d[5]}) : pose;
    for (int j = 0; j < 3; ++j) tried_.lenses[i][j] = lens[j] + d[6 + j];
    write_record(i, tried_);
    const auto& t = pose.translation;
    for (double change :
         {norm(d[3], d[4], d[5]), norm(d[0], d[1], d[2]) / (norm(t[0], t[1], t[2]) + 1e-300),
          std::abs(d[6]) / (std::abs(lens[0]) + 1e-300), std::abs(d[7]), std::abs(d[8])})
      largest = std::max(largest, change);
  }
  return largest;
}

Trial ImageSystem::trial() {
  Trial out;
  out.step_norm = step_images();
  linearize(tried_);
  const Cost cost = sum_of(tried_.sums);
  out.plain_cost = cost.square / 2;
  out.cost = cost_of(cost.square, cost.loss);
  double decrease = 0;
  for (std::int32_t c = 0; c < columns_.count; ++c)
    decrease += step_[c] * (vectors_.rhs[c] + damping_[c] * step_[c]);
  out.predicted_decrease = decrease / 2;
  if (watch_behind_) out.newly_behind = count_newly_behind();
  return out;
}

/// A loss may be finite where the residual is not: such a state has no finite cost either.
double ImageSystem::cost_of(double square_sum, double loss_sum) const {
  return (loss_.kind == LossKind::none || !std::isfinite(square_sum) ? square_sum : loss_sum) / 2;
}

void ImageSystem::accept() { std::swap(held_, tried_); }

std::uint64_t ImageSystem::count_newly_behind() const {
  std::uint64_t count = 0;
  for (const auto& piece : batches_.pieces)
    count += count_behind_in(batches_, piece, &tried_.cameras[kRecord * piece.image],
                             &held_.cameras[kRecord * piece.image]);
  return count;
}

std::uint64_t ImageSystem::count_behind() const {
  std::uint64_t count = 0;
  for (const auto& piece : batches_.pieces)
    count += count_behind_in(batches_, piece, &held_.cameras[kRecord * piece.image], nullptr);
  return count;
}

double ImageSystem::residual_scale(double quantile) {
  QuantileSearch search(quantile, 2 * batches_.observations);
  Buffer<double> residuals(16 * ImageBatches::kBatchesPerPiece);
  while (!search.done()) {
    DigitCounts counts;
    for (const auto& piece : batches_.pieces) {
      kernels_.residuals(batches_.batches(piece), piece, &held_.cameras[kRecord * piece.image],
                         residuals.data());
      for (std::uint32_t b = 0; b < piece.batches; ++b)
        for (std::uint32_t l = 0; l < (b + 1 == piece.batches ? piece.last_lanes : 8); ++l)
          for (std::uint32_t d = 0; d < 2; ++d) search.count(residuals[16 * b + 8 * d + l], counts);
    }
    search.narrow(counts);
  }
  return search.value();
}

void ImageSystem::store(Problem& problem) const {
  for (std::size_t i = 0; i < held_.poses.size(); ++i) {
    problem.poses[i].rotation = held_.poses[i].rotation;
    problem.poses[i].translation = held_.poses[i].translation;
    // Images that share a lens hold it: all say the same.
    std::copy(held_.lenses[i].begin(), held_.lenses[i].end(),
              problem.cameras[image_camera_[i]].parameters.begin());
  }
}

}  // namespace sheaf
