// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/pixel_rows.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "eliminate/lens_kernels.h"
#include "rows/exact_patches.h"
#include "systems/implicit_solver.h"
#include "systems/product_sums.h"

namespace sheaf {

namespace {

/// Elimination sees sights as observations without a measurement.
Batches arrange_sights(const PatchScene& scene, const PatchBlocks& blocks,
                       const std::vector<Sight>& sights, std::size_t points) {
  Problem shell;
  shell.poses.resize(blocks.count());
  shell.points.resize(3 * points);
  shell.observation_xy.resize(2 * sights.size());
  for (const Sight& sight : sights) {
    shell.observation_image.push_back(blocks.of(scene, sight));
    shell.observation_point.push_back(sight.point);
  }
  return arrange(shell);
}

Columns number_columns(std::size_t images, const PhotometricRules& rules) {
  Columns out;
  out.of_image.assign(9 * images, Columns::kFixed);
  for (std::size_t i = 0; i < images; ++i) {
    const bool bright = rules.brightness && (i > 0 || !rules.first_brightness_held);
    for (int k = 0; k < 8; ++k)
      if (k < 6 ? !rules.poses_held : bright) out.of_image[9 * i + k] = out.count++;
  }
  return out;
}

/// Nothing but tiles: the camera solvers ask for no more.
Chunks only_tiles(std::vector<Tile> tiles) {
  Chunks out;
  out.tiles = std::move(tiles);
  return out;
}

/// What blocks are made of.
std::vector<Sight> with_measured(std::vector<Sight> sights, const Anchor& anchor) {
  for (const Measurement& of : anchor.measurements) sights.push_back({of.point, of.image});
  return sights;
}

std::unique_ptr<MixedRows> mix_rows(const PatchScene& scene, const PatchBlocks& blocks,
                                    const Batches& patches, bool exact, const Anchor& anchor,
                                    std::size_t points, int lanes) {
  const int pairs = exact && scene.warped ? kExactPairs : 1;
  if (pairs == 1 && anchor.measurements.empty()) return nullptr;
  return std::make_unique<MixedRows>(scene, blocks, patches, pairs, anchor, points, lanes);
}

std::vector<Brightness> brightness_of(const CameraState& cameras) {
  std::vector<Brightness> out;
  out.reserve(cameras.sets.size());
  for (const CameraState::Parameters& set : cameras.sets) out.push_back({set[0], set[1]});
  return out;
}

}  // namespace

PixelRows::PixelRows(const PatchScene& scene, const std::vector<Sight>& sights, std::size_t points,
                     const PhotometricRules& rules, const Kernels& kernels, Threads& threads,
                     Anchor anchor)
    : scene_(scene),
      rules_(rules),
      kernels_(kernels),
      row_kernels_(row_kernels(kernels.name)),
      pose_pairs_(lens_kernels(kernels.name).pose_pairs),
      patch_kernels_(photometric_kernels(kernels.name)),
      threads_(threads),
      anchor_(std::move(anchor)),
      blocks_(scene, with_measured(sights, anchor_)),
      batches_(arrange_sights(scene, blocks_, sights, points)),
      mixed_(mix_rows(scene, blocks_, batches_, rules.exact_rows, anchor_, points,
                      row_kernels_.lanes)),
      chunks_(cut_into_chunks(batches(), blocks_.count(),
                              rules.points_held ? ChunkLists::diagonal : ChunkLists::pairs,
                              kBatchesPerChunk)),
      image_chunks_(
          only_tiles(blocks_.are_pairs() ? blocks_.image_tiles(chunks_.tiles) : chunks_.tiles)),
      columns_(number_columns(scene.num_images(), rules)) {
  pose_columns_ = columns_;
  for (std::size_t i = 0; i < pose_columns_.of_image.size(); ++i)
    if (i % kCameraColumns >= 6) pose_columns_.of_image[i] = Columns::kFixed;
  if (mixed_) patch_chunks_ = cut_into_chunks(batches_, blocks_.count(), ChunkLists::none);
  const std::size_t images = scene.num_images();
  allocate(held_);
  allocate(tried_);
  image_steps_.allocate(kBlockVector * images);
  steps_.allocate(kBlockVector * blocks_.count());
  if (blocks_.are_pairs()) {
    image_tiles_.allocate(kTileDoubles * image_chunks_.tiles.size());
    image_diagonal_.allocate(kDiagonalDoubles * images);
    tile_of_.assign(images * images, -1);
    for (std::size_t t = 0; t < image_chunks_.tiles.size(); ++t) {
      const Tile& tile = image_chunks_.tiles[t];
      tile_of_[tile.row * images + tile.column] = static_cast<std::int64_t>(t);
    }
  }
  if (!rules.leaving_is_free) {
    leaving_.allocate(16 * batches_.num_batches());
  }
}

void PixelRows::allocate(Half& half) const {
  half.views.allocate(kViewRecord * blocks_.count());
  if (!mixed_) {
    half.factors.allocate(patch_factors(rules_.brightness) * batches_.num_batches());
  } else {
    half.rows.allocate(kRowBatch * batches().num_batches());
    const std::size_t pairs = rules_.exact_rows && scene_.warped ? kExactPairs : 1;
    half.patch_points.allocate(kPointGroup * batches_.groups.size());
    half.patch_rows.allocate(kRowBatch * pairs * batches_.num_batches());
    half.measured_costs.allocate(8 * batches().groups.size());
  }
  half.brightness_sums.allocate(rules_.brightness ? kBrightnessBatch * batches_.num_batches() : 0);
  half.seen.allocate(16 * batches_.num_batches());
  half.costs.allocate(16 * batches_.num_batches());
}

void PixelRows::attach(const SteppedState& state) {
  state_ = &state;
  if (scene_.has_rays()) {
    rays_.allocate(kPointGroup * batches_.groups.size());
    for (std::size_t g = 0; g < batches_.groups.size(); ++g)
      for (std::size_t l = 0; l < 8; ++l)
        for (std::size_t d = 0; d < 3; ++d)
          rays_[kPointGroup * g + 8 * d + l] =
              scene_.rays[3 * std::size_t(batches_.lane_point[8 * g + l]) + d];
  }
  const CameraState& held = state.held.cameras;
  blocks_.write_views(held.poses, brightness_of(held), held_.views.data());
}

PixelRows::Totals PixelRows::collapse(const PointState& state, Half& half) {
  if (mixed_) mixed_->spread_points(batches_, state.points.data(), half.patch_points.data());
  Totals totals = collapse_patches(state, half);
  if (mixed_) gather_rows(state, half, totals);
  totals.cost += prior_cost(state.cameras);
  return totals;
}

PhotometricInput PixelRows::patches_at(const PointState& state, const Half& half) const {
  return {&batches_,
          scene_.planes.data(),
          blocks_.targets().data(),
          half.views.data(),
          mixed_ ? half.patch_points.data() : state.points.data(),
          scene_.has_rays() ? rays_.data() : nullptr,
          scene_.references.data(),
          &scene_.grid,
          leaving_.data(),
          scene_.camera,
          scene_.taps,
          loss_,
          rules_.loss_per_patch,
          rules_.brightness,
          scene_.warped};
}

/// The held state's; patches: those at it.
KeptRows PixelRows::kept(const PhotometricInput& patches) const {
  if (mixed_) return {held_.rows.data(), nullptr, nullptr};
  return {nullptr, &patches, held_.factors.data()};
}

/// Chunks write what is theirs; their costs are added in order.
PixelRows::Totals PixelRows::collapse_patches(const PointState& state, Half& half) {
  const bool exact = rules_.exact_rows && scene_.warped;
  const Chunks& chunks = patch_chunks();
  const PhotometricInput in = patches_at(state, half);
  std::vector<PhotometricOutput> outputs(
      chunks.chunks.size(),
      {mixed_ ? half.patch_rows.data() : nullptr, half.factors.data(), half.brightness_sums.data(),
       half.seen.data(), half.costs.data(), 0, 0, 0});
  threads_.for_each(outputs.size(), [&](std::size_t c) {
    const Chunk& chunk = chunks.chunks[c];
    if (exact)
      collapse_exactly(in, row_kernels_.lanes, chunk.first_group, chunk.end_group, outputs[c]);
    else
      patch_kernels_.collapse(in, chunk.first_group, chunk.end_group, outputs[c]);
  });
  Totals totals;
  for (const PhotometricOutput& out : outputs) {
    totals.cost += out.cost;
    totals.square_sum += out.square_sum;
    totals.left += out.left;
  }
  return totals;
}

/// The patches' rows to where elimination takes them, and the measurements' rows and costs.
void PixelRows::gather_rows(const PointState& at, Half& half, Totals& totals) const {
  const MixedRows::State state{half.views.data(), at.points.data(), half.patch_rows.data(),
                               half.measured_costs.data()};
  std::vector<MixedRows::Totals> measured(chunks_.chunks.size());
  threads_.for_each(measured.size(), [&](std::size_t c) {
    const Chunk& chunk = chunks_.chunks[c];
    measured[c] = mixed_->gather(state, chunk.first_group, chunk.end_group, half.rows.data());
  });
  for (const MixedRows::Totals& of : measured) {
    totals.cost += of.cost;
    totals.square_sum += of.square_sum;
  }
}

/// Collapses the held state under this loss, unless that is what its rows are.
void PixelRows::hold(const ScaledLoss& loss) {
  if (collapsed_ && loss == loss_) return;
  const bool same_costs = collapsed_ && loss.kind == loss_.kind && loss.scale_px == loss_.scale_px;
  loss_ = loss;
  anchor_.loss.floor = loss.floor;
  // Of the same patches: only what steps see of their curvature is new.
  if (same_costs || left_before_) {
    totals_ = collapse(state_->held, held_);
    collapsed_ = true;
    left_before_ = false;
    return;
  }
  leaving_.fill(0);
  totals_ = collapse(state_->held, held_);
  collapsed_ = true;
  if (rules_.leaving_is_free) return;
  set_leaving();
  if (totals_.left > 0) totals_ = collapse(state_->held, held_);
}

/// What a patch says of its image's brightness alone.
void PixelRows::add_brightness(const Chunk& chunk, double* diagonal) const {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = batches_.groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      for (std::uint32_t l = 0; l < group.lanes; ++l) {
        const double* from = &held_.brightness_sums[kBrightnessBatch * b + l];
        double* block = diagonal + kDiagonalDoubles * batches_.image[8 * b + l];
        block[diagonal_layout::at(6, 6)] += from[0];
        block[diagonal_layout::at(6, 7)] += from[8];
        block[diagonal_layout::at(7, 6)] += from[8];
        block[diagonal_layout::at(7, 7)] += from[16];
        block[diagonal_layout::right_side(6)] += from[24];
        block[diagonal_layout::right_side(7)] += from[32];
      }
  }
}

void PixelRows::add_priors(double* diagonal) const {
  const double wa = 1 / (rules_.prior_a * rules_.prior_a);
  const double wb = 1 / (rules_.prior_b * rules_.prior_b);
  const std::vector<Brightness> held = brightness_of(state_->held.cameras);
  for (std::size_t i = 0; i < held.size(); ++i) {
    double* block = diagonal + kDiagonalDoubles * i;
    block[diagonal_layout::at(6, 6)] += wa;
    block[diagonal_layout::at(7, 7)] += wb;
    block[diagonal_layout::right_side(6)] += wa * (held[i].a - 1);
    block[diagonal_layout::right_side(7)] += wb * held[i].b;
  }
}

/// Twice the priors' part of the cost.
double PixelRows::prior_cost(const CameraState& cameras) const {
  double sum = 0;
  if (!rules_.brightness) return sum;
  for (const Brightness& of : brightness_of(cameras)) {
    const double ra = (of.a - 1) / rules_.prior_a, rb = of.b / rules_.prior_b;
    sum += ra * ra + rb * rb;
  }
  return sum;
}

Records PixelRows::eliminate(const Elimination& of, std::uint32_t c, double* scratch, double* tiles,
                             double* diagonal, EliminateOutput& out) {
  const PhotometricInput patches = patches_at(state_->held, held_);
  const StoredRowsInput in{&batches(),     kept(patches),      of.damping,
                           of.points_held, !rules_.brightness, of.own_damping};
  const Chunk& chunk = chunks_.chunks[c];
  const Records records = records_in(scratch, chunks_);
  row_kernels_.eliminate(in, chunk, records, out);
  if (rules_.brightness) {
    kernels_.diagonal(batches(), chunks_, chunk, records, diagonal);
    kernels_.pairs(chunks_, chunk, records, tiles);
    if (!mixed_) add_brightness(chunk, diagonal);
  } else {
    row_kernels_.pose_diagonal(chunks_, chunk, records, diagonal);
    pose_pairs_(chunks_, chunk, records, tiles);
  }
  return records;
}

ReducedSums PixelRows::finish(double* tiles, double* diagonal) {
  if (rules_.brightness && mixed_)
    for (const Chunk& chunk : patch_chunks_.chunks) add_brightness(chunk, diagonal);
  ReducedSums sums{&image_chunks_, tiles, diagonal};
  if (blocks_.are_pairs()) {
    const CameraState& held = state_->held.cameras;
    image_tiles_.fill(0);
    image_diagonal_.fill(0);
    blocks_.fold(
        held.poses, brightness_of(held), scene_.num_images(),
        {&chunks_.tiles, tiles, diagonal, &tile_of_, image_tiles_.data(), image_diagonal_.data()});
    sums.tiles = image_tiles_.data();
    sums.diagonal = image_diagonal_.data();
  }
  if (rules_.brightness) add_priors(blocks_.are_pairs() ? image_diagonal_.data() : diagonal);
  return sums;
}

void PixelRows::step(const Buffer<double>& columns) {
  for (std::size_t i = 0; i < scene_.num_images(); ++i) {
    const std::int32_t* c = columns_.image(i);
    double* d = &image_steps_[kBlockVector * i];
    std::fill(d, d + kBlockVector, 0.0);
    for (int k = 0; k < 8; ++k)
      if (c[k] >= 0) d[k] = columns[static_cast<std::size_t>(c[k])];
  }
  const CameraState &held = state_->held.cameras, &tried = state_->tried.cameras;
  blocks_.write_views(tried.poses, brightness_of(tried), tried_.views.data());
  blocks_.step(held.poses, brightness_of(held), image_steps_.data(), steps_.data());
}

void PixelRows::trial(const PointTrial&, std::uint32_t chunk, TrialOutput& out) {
  const PhotometricInput patches = patches_at(state_->held, held_);
  const RowTrialInput in{&batches(), kept(patches), steps_.data(), state_->held.points.data(),
                         state_->factors.data()};
  row_kernels_.back_substitute(in, chunks_.chunks[chunk], out);
}

Costs PixelRows::tried_costs(const PointTrial& in, const Costs&, Settling& points, Trial& out) {
  tried_totals_ = collapse(state_->tried, tried_);
  if (points.own_damping != nullptr) settle(in.own.damping, points);
  out.motion_px = median_motion();
  return {tried_totals_.square_sum, tried_totals_.cost};
}

void PixelRows::accepted() {
  std::swap(held_, tried_);
  totals_ = tried_totals_;
}

/// Of the patches that are in their image before and after: of some two thousand, evenly spread.
double PixelRows::median_motion() const {
  constexpr std::uint64_t kSamples = 256;
  const std::uint64_t batches = batches_.num_batches();
  std::vector<double> squares;
  squares.reserve(8 * kSamples);
  for (std::uint64_t k = 0; k < std::min(kSamples, batches); ++k) {
    const std::uint64_t b = k * batches / std::min(kSamples, batches);
    for (std::uint64_t at = 16 * b; at < 16 * b + 8; ++at) {
      const double dx = tried_.seen[at] - held_.seen[at];
      const double dy = tried_.seen[at + 8] - held_.seen[at + 8];
      const double square = dx * dx + dy * dy;
      if (!std::isnan(square)) squares.push_back(square);
    }
  }
  if (squares.empty()) return 0;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::sqrt(*middle);
}

/// Of |r| over the pixels of all patches in their images.
double PixelRows::residual_scale(double quantile) const {
  const PatchState now = held_state();
  std::vector<double> sizes, patch;
  for (std::size_t g = 0; g < batches_.groups.size(); ++g) {
    const Batches::Group& group = batches_.groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      for (std::uint32_t l = 0; l < group.lanes; ++l) {
        const Sight sight{batches_.lane_point[8 * g + l],
                          blocks_.targets()[batches_.image[8 * b + l]]};
        if (!patch_residuals(scene_, now, sight, patch)) continue;
        for (double r : patch) sizes.push_back(std::abs(r));
      }
  }
  if (sizes.empty()) return 0;
  const double rank = std::ceil(quantile * static_cast<double>(sizes.size())) - 1;
  const auto at = sizes.begin() + static_cast<std::ptrdiff_t>(std::max(0.0, rank));
  std::nth_element(sizes.begin(), at, sizes.end());
  return *at;
}

PatchState PixelRows::held_state() const {
  PatchState out;
  for (const RigidMotion<double>& pose : state_->held.cameras.poses)
    out.poses.push_back({pose.rotation, pose.translation});
  out.brightness = brightness_of(state_->held.cameras);
  out.points.resize(3 * scene_.references.size() / scene_.grid.cells());
  for (std::size_t g = 0; g < batches().groups.size(); ++g)
    for (std::uint32_t l = 0; l < batches().groups[g].lanes; ++l)
      for (std::size_t d = 0; d < 3; ++d)
        out.points[3 * std::size_t(batches().lane_point[8 * g + l]) + d] =
            state_->held.points[kPointGroup * g + 8 * d + l];
  return out;
}

/// S x by images: their blocks' rows read again, what patches say of brightness alone, the priors.
class PixelRows::Operator : public StateOperator {
 public:
  explicit Operator(const PixelRows& rows)
      : rows_(rows),
        sums_(rows.chunks_, rows.blocks_.count(), 0, rows.threads_),
        alone_(kDiagonalDoubles * rows.blocks_.count()),
        x_(kBlockVector * rows.blocks_.count()),
        y_(kBlockVector * rows.blocks_.count()) {}

  void prepare(const double*) override {
    const CameraState& held = rows_.state_->held.cameras;
    maps_ = rows_.blocks_.all_maps(held.poses, brightness_of(held));
    alone_.fill(0);
    if (!rows_.rules_.brightness) return;
    for (const Chunk& chunk : rows_.patch_chunks().chunks)
      rows_.add_brightness(chunk, alone_.data());
  }

  void apply(const double* x, double* y) override {
    rows_.blocks_.to_blocks(maps_, x, x_.data());
    const PhotometricInput patches = rows_.patches_at(rows_.state_->held, rows_.held_);
    const RowTrialInput in{&rows_.batches(), rows_.kept(patches), x_.data(),
                           rows_.state_->held.points.data(), rows_.state_->factors.data()};
    sums_.run([&](const Chunk& chunk, double*,
                  double* sums) { rows_.row_kernels_.product(in, chunk, sums); },
              [&](std::size_t b, const double* total) { finish(b, total); });
    const std::size_t images = rows_.scene_.num_images();
    std::fill_n(y, kBlockVector * images, 0.0);
    rows_.blocks_.add_to_images(maps_, y_.data(), y);
    if (!rows_.rules_.brightness) return;
    for (std::size_t i = 0; i < images; ++i) {
      y[kBlockVector * i + 6] += x[kBlockVector * i + 6] / square(rows_.rules_.prior_a);
      y[kBlockVector * i + 7] += x[kBlockVector * i + 7] / square(rows_.rules_.prior_b);
    }
  }
  std::uint64_t bytes() const override {
    return sums_.bytes() + alone_.bytes() + x_.bytes() + y_.bytes() +
           maps_.size() * sizeof(PatchBlocks::Maps);
  }

 private:
  static double square(double x) { return x * x; }
  void finish(std::size_t block, const double* total) {
    double* to = &y_[kBlockVector * block];
    std::fill_n(to, kBlockVector, 0.0);
    std::copy_n(total, kCameraColumns, to);
    const double *S = &alone_[kDiagonalDoubles * block], *x = &x_[kBlockVector * block];
    for (int r = 6; r < 8; ++r)
      for (int k = 6; k < 8; ++k) to[r] += S[diagonal_layout::at(r, k)] * x[k];
  }

  const PixelRows& rows_;
  ProductSums sums_;
  Buffer<double> alone_;  ///< kDiagonalDoubles per block: brightness of patches alone
  Buffer<double> x_, y_;  ///< kBlockVector per block
  std::vector<PatchBlocks::Maps> maps_;
};

PointRows::Operators PixelRows::make_operators(const Columns&, bool) {
  return {std::make_unique<Operator>(*this), nullptr};
}

std::uint64_t PixelRows::bytes() const {
  std::uint64_t sum = rays_.bytes() + leaving_.bytes() + image_tiles_.bytes() +
                      image_diagonal_.bytes() + steps_.bytes();
  for (const Half* half : {&held_, &tried_})
    sum += half->views.bytes() + half->brightness_sums.bytes() + half->seen.bytes() +
           half->costs.bytes() + half->measured_costs.bytes() + half->factors.bytes() +
           half->rows.bytes() + half->patch_points.bytes() + half->patch_rows.bytes();
  return sum;
}

}  // namespace sheaf
