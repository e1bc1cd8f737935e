// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/mapped_rows.h"

#include <algorithm>
#include <utility>

#include "systems/dogleg_passes.h"

namespace sheaf {
namespace {

/// Block vectors by columns; held columns are 0.
void spread(const Columns& columns, const double* x, double* blocks) {
  std::fill_n(blocks, kBlockVector * columns.num_images(), 0.0);
  for (std::size_t i = 0; i < columns.num_images(); ++i)
    for (std::size_t k = 0; k < 9; ++k)
      if (const std::int32_t c = columns.image(i)[k]; c >= 0) blocks[kBlockVector * i + k] = x[c];
}

}  // namespace

/// M^T S_rows M x.
class MappedRows::Operator : public StateOperator {
 public:
  Operator(const MappedRows& rows, std::unique_ptr<StateOperator> of_rows)
      : rows_(rows),
        of_rows_(std::move(of_rows)),
        x_(kBlockVector * rows.map_.row_blocks()),
        y_(kBlockVector * rows.map_.row_blocks()) {}

  /// The rows scale by their own columns before they round.
  void prepare(const double*) override {
    vectors_.gather({nullptr, nullptr, rows_.row_diagonal_}, rows_.columns_);
    of_rows_->prepare(vectors_.squares.data());
  }
  void apply(const double* x, double* y) override {
    to_rows(rows_.map_, rows_.adjoints_, x, x_.data());
    of_rows_->apply(x_.data(), y_.data());
    to_solved(rows_.map_, rows_.adjoints_, y_.data(), y);
  }
  std::uint64_t bytes() const override { return of_rows_->bytes() + x_.bytes() + y_.bytes(); }

 private:
  const MappedRows& rows_;
  std::unique_ptr<StateOperator> of_rows_;
  Buffer<double> x_, y_;
  CameraVectors vectors_;
};

/// What a dogleg asks, by solved blocks.
class MappedRows::Dogleg : public DoglegSource {
 public:
  Dogleg(const MappedRows& rows, std::unique_ptr<DoglegSource> of_rows)
      : rows_(rows), of_rows_(std::move(of_rows)), x_(kBlockVector * rows.map_.row_blocks()) {}

  void write_steps(const double* x, std::size_t) override {
    to_rows(rows_.map_, rows_.adjoints_, x, x_.data());
    of_rows_->write_steps(x_.data(), rows_.map_.row_blocks());
  }
  void gradient(const Chunk& chunk, double* sums) override { of_rows_->gradient(chunk, sums); }
  void gather(const double* sums, std::size_t blocks, double* solved) const override {
    std::vector<double> of_rows(kBlockVector * rows_.map_.row_blocks());
    of_rows_->gather(sums, blocks, of_rows.data());
    to_solved(rows_.map_, rows_.adjoints_, of_rows.data(), solved);
  }
  double other_curvature() const override { return of_rows_->other_curvature(); }
  void curvature(const Chunk& chunk, double lambda, bool points_held,
                 CurvatureOutput& out) override {
    of_rows_->curvature(chunk, lambda, points_held, out);
  }
  double point_damping(const Chunk& chunk) override { return of_rows_->point_damping(chunk); }

 private:
  const MappedRows& rows_;
  std::unique_ptr<DoglegSource> of_rows_;
  Buffer<double> x_;
};

MappedRows::MappedRows(std::unique_ptr<PointRows> rows, const Columns& columns, const BlockMap& map,
                       bool forms_tiles, const char* simd_name, Threads& threads)
    : rows_(std::move(rows)),
      columns_(columns),
      map_(map),
      fold_(map, rows_->reduced_chunks().tiles, forms_tiles, simd_name, threads),
      solved_(kBlockVector * map.columns.num_images()),
      of_rows_(kBlockVector * map.row_blocks()),
      row_columns_((static_cast<std::size_t>(columns.count) + 7) / 8 * 8) {
  solved_chunks_.tiles = fold_.tiles();
}

void MappedRows::attach(const SteppedState& state) {
  state_ = &state;
  adjoints_of(state.held.cameras, adjoints_);
  rows_->attach(state);
}

ReducedSums MappedRows::finish(double* tiles, double* diagonal) {
  const ReducedSums of_rows = rows_->finish(tiles, diagonal);
  row_diagonal_ = of_rows.diagonal;
  fold_.fold(adjoints_, of_rows.tiles, of_rows.diagonal);
  return {&solved_chunks_, fold_.tile_sums(), fold_.diagonal(), of_rows.diagonal,
          of_rows.couplings};
}

CoarseSpace::State MappedRows::coarse_state() {
  if (records_.size() == 0) records_.allocate(kCameraRecord * map_.columns.num_images());
  records_.fill(0);
  const CameraState& held = state_->held.cameras;
  const auto write = [&](std::uint32_t block, const RigidMotion<double>& pose) {
    if (block == BlockMap::kNone) return;
    double* record = &records_[kCameraRecord * block];
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    std::copy(R.begin(), R.end(), record);
    std::copy(pose.translation.begin(), pose.translation.end(), record + pose_record::kTranslation);
  };
  for (std::size_t f = 0; f < map_.frame_block.size(); ++f)
    write(map_.frame_block[f], held.frames[f]);
  for (std::size_t i = 0; i < map_.image_block.size(); ++i)
    write(map_.image_block[i], held.poses[i]);
  for (std::uint32_t j = 0; j < map_.kept; ++j)
    std::copy_n(held.kept[j].begin(), 3,
                &records_[kCameraRecord * (map_.first_kept + std::size_t(j))]);
  return {records_.data(), adjoints_.empty() ? nullptr : adjoints_.front().at.data(),
          map_.first_kept};
}

void MappedRows::step(const Buffer<double>& columns) {
  spread(map_.columns, columns.data(), solved_.data());
  to_rows(map_, adjoints_, solved_.data(), of_rows_.data());
  for (std::size_t i = 0; i < columns_.num_images(); ++i)
    for (std::size_t k = 0; k < 9; ++k)
      if (const std::int32_t c = columns_.image(i)[k]; c >= 0)
        row_columns_[static_cast<std::size_t>(c)] = of_rows_[kBlockVector * i + k];
  rows_->step(row_columns_);
}

void MappedRows::accepted() {
  rows_->accepted();
  adjoints_of(state_->held.cameras, adjoints_);
}

PointRows::Operators MappedRows::make_operators(const Columns&, bool mixed) {
  Operators of_rows = rows_->make_operators(columns_, mixed);
  Operators out;
  if (of_rows.exact) out.exact = std::make_unique<Operator>(*this, std::move(of_rows.exact));
  if (of_rows.rounded) out.rounded = std::make_unique<Operator>(*this, std::move(of_rows.rounded));
  return out;
}

std::unique_ptr<DoglegSource> MappedRows::make_dogleg() {
  return std::make_unique<Dogleg>(*this, rows_->make_dogleg());
}

std::uint64_t MappedRows::bytes() const {
  return rows_->bytes() + fold_.bytes() + solved_.bytes() + of_rows_.bytes() + row_columns_.bytes();
}

}  // namespace sheaf
