// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/lens_rows.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "geometry/camera_model.h"
#include "lists/slices.h"
#include "reduced/scaling.h"
#include "systems/dogleg_passes.h"
#include "systems/implicit_solver.h"
#include "systems/product_sums.h"

namespace sheaf {

/// S x with the rows computed again, by blocks of images and lenses alike.
class LensRows::Operator : public StateOperator {
 public:
  Operator(const LensRows& rows, const Columns& columns)
      : rows_(rows),
        sums_(rows.chunks_, columns.num_images(),
              product_scratch_doubles(rows.arranged_.batches, rows.arranged_.tracks),
              rows.threads_) {}

  void prepare(const double*) override {}
  void apply(const double* x, double* y) override {
    const SteppedState& state = *rows_.state_;
    const LensProductInput in{rows_.held_input(), state.factors.data(), state.metric.data(), x};
    sums_.run([&](const Chunk& chunk, double* saved,
                  double* sums) { rows_.lens_kernels_.product(in, chunk, saved, sums); },
              [&](std::size_t i, const double* total) {
                std::copy_n(total, kCameraColumns, y + kImageVector * i);
              });
  }
  std::uint64_t bytes() const override { return sums_.bytes(); }
  ProductSums& sums() { return sums_; }

 private:
  const LensRows& rows_;
  ProductSums sums_;
};

/// S x with rows kept in single precision; the sums over blocks are double. x is scaled by its
/// columns before it is rounded, so that the result depends on no unit.
class LensRows::RoundedOperator : public StateOperator {
 public:
  RoundedOperator(const LensRows& rows, const Columns& columns, ProductSums& sums)
      : rows_(rows),
        columns_(columns),
        sums_(sums),
        kept_(8 * kept_row::fields(rows.arranged_.tracks.most_blocks) *
              rows.arranged_.batches.num_batches()),
        x_(kBlockVector * columns.num_images()) {}

  void prepare(const double* squares) override {
    squares_ = squares;
    unit_ = scene_frame(rows_.state_->held.cameras).unit;
    const SteppedState& state = *rows_.state_;
    const LensProductInput in{rows_.held_input(), state.factors.data(), state.metric.data()};
    const std::vector<Chunk>& chunks = rows_.chunks_.chunks;
    rows_.threads_.for_each(chunks.size(), [&](std::size_t c) {
      rows_.lens_kernels_.keep(in, unit_, chunks[c], kept_.data());
    });
  }

  void apply(const double* x, double* y) override {
    const double scale = scale_of_step(x);
    for (std::size_t i = 0; i < x_.size(); ++i) x_[i] = static_cast<float>(scale * x[i]);
    const KeptProductInput in{&rows_.arranged_.batches,
                              &rows_.arranged_.tracks,
                              kept_.data(),
                              rows_.state_->factors.data(),
                              unit_,
                              x_.data()};
    sums_.run([&](const Chunk& chunk, double*,
                  double* sums) { rows_.kept_product_.product(in, chunk, sums); },
              [&](std::size_t i, const double* total) {
                for (std::size_t k = 0; k < kCameraColumns; ++k)
                  y[kBlockVector * i + k] = total[k] / scale;
              });
  }
  std::uint64_t bytes() const override { return kept_.bytes() + x_.bytes(); }

 private:
  /// x scaled by its columns is what the residuals see of it, at most in pixels: next to 1.
  double scale_of_step(const double* x) const {
    double most = 0;
    for (std::size_t i = 0; i < columns_.num_images(); ++i)
      for (int k = 0; k < kCameraColumns; ++k)
        if (const std::int32_t c = columns_.image(i)[k]; c >= 0)
          most = std::max(most, std::sqrt(squares_[c]) *
                                    std::abs(x[kBlockVector * i + static_cast<std::size_t>(k)]));
    return towards_one(most);
  }

  const LensRows& rows_;
  const Columns& columns_;
  ProductSums& sums_;
  Buffer<float> kept_, x_;
  const double* squares_ = nullptr;
  double unit_ = 1;
};

/// What a dogleg asks of these rows.
class LensRows::Dogleg : public DoglegSource {
 public:
  explicit Dogleg(const LensRows& rows) : rows_(rows), x_(kBlockVector * rows.num_blocks()) {}

  void write_steps(const double* x, std::size_t blocks) override {
    std::copy_n(x, kBlockVector * blocks, x_.data());
  }
  void gradient(const Chunk& chunk, double* sums) override {
    rows_.lens_kernels_.gradient(input(), chunk, sums);
  }
  void curvature(const Chunk& chunk, double lambda, bool points_held,
                 CurvatureOutput& out) override {
    rows_.lens_kernels_.curvature(input(), lambda, points_held, chunk, out);
  }
  double point_damping(const Chunk& chunk) override {
    return rows_.lens_kernels_.point_damping(input(), chunk);
  }

 private:
  LensProductInput input() const {
    const SteppedState& state = *rows_.state_;
    return {rows_.held_input(), state.factors.data(), state.metric.data(), x_.data()};
  }

  const LensRows& rows_;
  Buffer<double> x_;  ///< kBlockVector per block
};

LensRows::LensRows(const Arrangement& arrangement, const Kernels& kernels, Threads& threads)
    : arranged_(arrangement),
      chunks_(arrangement.lists.chunks),
      kernels_(kernels),
      lens_kernels_(lens_kernels(kernels.name)),
      kept_product_(kept_product(kernels.name)),
      threads_(threads),
      poses_alone_(std::all_of(arrangement.tracks.lenses.begin(), arrangement.tracks.lenses.end(),
                               [](const LensPlaces& lens) { return lens.riders == 0; })),
      layout_(arrangement.batches, arrangement.tracks, chunks_, arrangement.lists.tiles),
      columns_(CameraColumns::of_lenses(arrangement.columns, arrangement.tracks)) {
  for (LensCameras* records : {&held_, &tried_}) {
    records->images.allocate(kImageRecord * arrangement.tracks.image_lens.size());
    records->lenses.allocate(kLensRecord * arrangement.tracks.lenses.size());
  }
}

void LensRows::attach(const SteppedState& state) {
  state_ = &state;
  write_records(state.held.cameras, held_);
}

void LensRows::write_records(const CameraState& cameras, LensCameras& records) const {
  for (std::size_t i = 0; i < cameras.poses.size(); ++i) {
    double* record = &records.images[kImageRecord * i];
    const Matrix3<double> R = matrix_from_quaternion(cameras.poses[i].rotation);
    const auto& t = cameras.poses[i].translation;
    std::copy(R.begin(), R.end(), record);
    std::copy(t.begin(), t.end(), record + pose_record::kTranslation);
    std::fill(record + image_record::kStep, record + kImageRecord, 0.0);
  }
  for (std::size_t c = 0; c < cameras.sets.size(); ++c) {
    double* record = &records.lenses[kLensRecord * c];
    std::copy(cameras.sets[c].begin(), cameras.sets[c].end(), record);
    std::fill(record + lens_record::kStep, record + kLensRecord, 0.0);
  }
}

LensInput LensRows::held_input() const {
  return {&arranged_.batches, &arranged_.tracks, view(held_, state_->held)};
}

Records LensRows::eliminate(const Elimination& of, std::uint32_t c, double* scratch, double* tiles,
                            double* diagonal, EliminateOutput& out) {
  const LensEliminateInput in{held_input(), of.damping, of.points_held,
                              of.loss,      of.chart,   of.own_damping};
  const LensChunks& lists = arranged_.lists;
  const Chunk& chunk = chunks_.chunks[c];
  const LensRecords records = layout_.in(scratch);
  lens_kernels_.linearize(in, chunk, records, out);
  kernels_.diagonal(arranged_.batches, chunks_, chunk, records.image, diagonal);
  (poses_alone_ ? lens_kernels_.pose_pairs : kernels_.pairs)(chunks_, chunk, records.image, tiles);
  kernels_.pairs(lists.slots, lists.slots.chunks[c], records.image, tiles);
  lens_kernels_.products(arranged_.tracks, lists.tiles, chunks_, chunk, records, diagonal, tiles);
  return records.image;
}

void LensRows::step(const Buffer<double>& columns) {
  const std::size_t images = state_->held.cameras.poses.size();
  for (std::size_t i = 0; i < images; ++i) {
    const std::int32_t* c = arranged_.columns.image(i);
    if (c[0] < 0) continue;
    double* to = &held_.images[kImageRecord * i + image_record::kStep];
    for (std::size_t k = 0; k < 6; ++k) to[k] = columns[static_cast<std::size_t>(c[k])];
  }
  for (const CameraColumns::Parameter& p : columns_.parameters())
    held_.lenses[kLensRecord * p.set + lens_record::kStep + p.index] =
        columns[static_cast<std::size_t>(p.column)];
  write_records(state_->tried.cameras, tried_);
}

void LensRows::trial(const PointTrial& of, std::uint32_t chunk, TrialOutput& out) {
  const LensTrialInput in{&arranged_.batches,
                          &arranged_.tracks,
                          view(held_, state_->held),
                          view(tried_, state_->tried),
                          state_->factors.data(),
                          of.inner_iterations,
                          of.mean_square,
                          of.loss,
                          state_->metric.data(),
                          of.chart,
                          of.blend,
                          of.own};
  lens_kernels_.trial(in, chunks_.chunks[chunk], out);
}

Costs LensRows::tried_costs(const PointTrial& in, const Costs& summed, Settling&, Trial& out) {
  if (in.watch_behind) out.newly_behind = count_newly_unseen();
  return summed;
}

bool LensRows::sees(const LensCameras& records, const PointState& state, std::uint64_t batch,
                    std::uint32_t lane, std::size_t group) const {
  const std::size_t at = 8 * batch + lane;
  const double* pose = &records.images[kImageRecord * arranged_.batches.image[at]];
  const double* X = &state.points[kPointGroup * group + lane];
  const std::uint32_t lens = arranged_.tracks.lens[at];
  double P[3];
  for (int i = 0; i < 3; ++i)
    P[i] = pose[3 * i] * X[0] + pose[3 * i + 1] * X[8] + pose[3 * i + 2] * X[16] +
           pose[pose_record::kTranslation + i];
  return with_lens(arranged_.tracks.lenses[lens].model,
                   [&](auto model) { return model.sees(state.cameras.sets[lens].data(), P); });
}

template <class Counts>
std::uint64_t LensRows::count_where(const Counts& counts) const {
  const Batches& batches = arranged_.batches;
  std::array<std::uint64_t, kMostSlices> of_slice{};
  threads_.for_each(chunks_.slices.size() - 1, [&](std::size_t s) {
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c)
      for (std::uint32_t g = chunks_.chunks[c].first_group; g < chunks_.chunks[c].end_group; ++g) {
        const Batches::Group& group = batches.groups[g];
        for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
          for (std::uint32_t l = 0; l < group.lanes; ++l) of_slice[s] += counts(b, l, g);
      }
  });
  return std::accumulate(of_slice.begin(), of_slice.end(), std::uint64_t(0));
}

std::uint64_t LensRows::count_newly_unseen() const {
  return count_where([&](std::uint64_t b, std::uint32_t l, std::size_t g) {
    return !sees(tried_, state_->tried, b, l, g) && sees(held_, state_->held, b, l, g);
  });
}

std::uint64_t LensRows::count_behind() const {
  return count_where([&](std::uint64_t b, std::uint32_t l, std::size_t g) {
    return !sees(held_, state_->held, b, l, g);
  });
}

double LensRows::residual_scale(double quantile) const {
  return residual_quantile(
      arranged_.batches, chunks_, quantile, threads_, residual_scratch_,
      [&](const Chunk& chunk, double* out) { lens_kernels_.residuals(held_input(), chunk, out); });
}

double LensRows::pixel_rms() const {
  return sheaf::pixel_rms(
      arranged_.batches, chunks_, threads_, residual_scratch_,
      [&](const Chunk& chunk, double* out) { lens_kernels_.residuals(held_input(), chunk, out); });
}

PointRows::Operators LensRows::make_operators(const Columns& columns, bool mixed) {
  auto exact = std::make_unique<Operator>(*this, columns);
  std::unique_ptr<StateOperator> rounded;
  if (mixed) rounded = std::make_unique<RoundedOperator>(*this, columns, exact->sums());
  return {std::move(exact), std::move(rounded)};
}

std::unique_ptr<DoglegSource> LensRows::make_dogleg() { return std::make_unique<Dogleg>(*this); }

std::uint64_t LensRows::bytes() const {
  return held_.images.bytes() + held_.lenses.bytes() + tried_.images.bytes() +
         tried_.lenses.bytes();
}

}  // namespace sheaf
