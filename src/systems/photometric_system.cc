// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/photometric_system.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "eliminate/lens_kernels.h"
#include "lists/slices.h"
#include "rows/exact_patches.h"
#include "systems/plan.h"

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

double norm3(const double* v) { return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]); }

}  // namespace

PhotometricSystem::PhotometricSystem(const PatchScene& scene, const PatchState& state,
                                     const std::vector<Sight>& sights,
                                     const PhotometricRules& rules, const Kernels& kernels,
                                     Threads& threads, Anchor anchor)
    : scene_(scene),
      rules_(rules),
      kernels_(kernels),
      row_kernels_(row_kernels(kernels.name)),
      pose_pairs_(lens_kernels(kernels.name).pose_pairs),
      patch_kernels_(photometric_kernels(kernels.name)),
      threads_(threads),
      anchor_(std::move(anchor)),
      blocks_(scene, with_measured(sights, anchor_)),
      batches_(arrange_sights(scene, blocks_, sights, state.points.size() / 3)),
      mixed_(mix_rows(scene, blocks_, batches_, rules.exact_rows, anchor_, state.points.size() / 3,
                      row_kernels_.lanes)),
      chunks_(cut_into_chunks(rows(), blocks_.count(),
                              rules.points_held ? ChunkLists::diagonal : ChunkLists::pairs,
                              kBatchesPerChunk)),
      image_chunks_(
          only_tiles(blocks_.are_pairs() ? blocks_.image_tiles(chunks_.tiles) : chunks_.tiles)),
      columns_(number_columns(scene.num_images(), rules)),
      initial_points_(state.points),
      stage_(columns_) {
  if (mixed_) patch_chunks_ = cut_into_chunks(batches_, blocks_.count(), ChunkLists::none);
  fill_state(state);
  const std::size_t slices = chunks_.slices.size() - 1, images = scene.num_images();
  factors_.allocate(kFactorGroup * rows().groups.size());
  tiles_.allocate(slices * kTileDoubles * chunks_.tiles.size());
  diagonal_.allocate(slices * kDiagonalDoubles * blocks_.count());
  image_steps_.allocate(kStepRecord * images);
  steps_.allocate(kStepRecord * blocks_.count());
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
    leaving_costs_.allocate(16 * batches_.num_batches());
  }
  scratch_.resize(static_cast<std::size_t>(threads.count()));
  const SolverKind kind =
      columns_.count <= kMostDenseColumns ? SolverKind::dense : SolverKind::sparse;
  solver_name_ = to_string(kind);
  stage_.set_solver(kind == SolverKind::dense
                        ? make_dense_solver(columns_, kernels, threads)
                        : make_sparse_solver(columns_, image_chunks_, kernels, threads));
}

void PhotometricSystem::allocate(Half& half) const {
  half.views.allocate(kViewRecord * blocks_.count());
  half.points.allocate(kPointGroup * rows().groups.size());
  if (!mixed_) {
    half.factors.allocate(patch_factors(rules_.brightness) * batches_.num_batches());
  } else {
    half.rows.allocate(kRowBatch * rows().num_batches());
    const std::size_t pairs = rules_.exact_rows && scene_.warped ? kExactPairs : 1;
    half.patch_points.allocate(kPointGroup * batches_.groups.size());
    half.patch_rows.allocate(kRowBatch * pairs * batches_.num_batches());
  }
  half.brightness_sums.allocate(rules_.brightness ? kBrightnessBatch * batches_.num_batches() : 0);
  half.seen.allocate(16 * batches_.num_batches());
}

void PhotometricSystem::fill_state(const PatchState& state) {
  for (const Pose& pose : state.poses) held_.poses.push_back({pose.rotation, pose.translation});
  held_.brightness = state.brightness;
  tried_.poses = held_.poses;
  tried_.brightness = held_.brightness;
  allocate(held_);
  allocate(tried_);
  const auto spread = [](const Batches& batches, const std::vector<double>& from, double* to) {
    for (std::size_t g = 0; g < batches.groups.size(); ++g)
      for (int l = 0; l < 8; ++l)
        for (int d = 0; d < 3; ++d)
          to[kPointGroup * g + 8 * d + l] =
              from[3 * std::size_t(batches.lane_point[8 * g + l]) + d];
  };
  spread(rows(), state.points, held_.points.data());
  if (scene_.has_rays()) {
    rays_.allocate(kPointGroup * batches_.groups.size());
    spread(batches_, scene_.rays, rays_.data());
  }
  blocks_.write_views(held_.poses, held_.brightness, held_.views.data());
}

PhotometricSystem::Totals PhotometricSystem::collapse(Half& half, double* costs) {
  if (mixed_) mixed_->spread_points(batches_, half.points.data(), half.patch_points.data());
  Totals totals = collapse_patches(half, costs);
  if (mixed_) gather_rows(half, totals);
  totals.cost += prior_cost(half);
  return totals;
}

PhotometricInput PhotometricSystem::patches_at(const Half& half) const {
  return {&batches_,
          scene_.planes.data(),
          blocks_.targets().data(),
          half.views.data(),
          mixed_ ? half.patch_points.data() : half.points.data(),
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
KeptRows PhotometricSystem::kept(const PhotometricInput& patches) const {
  if (mixed_) return {held_.rows.data(), nullptr, nullptr};
  return {nullptr, &patches, held_.factors.data()};
}

/// Chunks write what is theirs; their costs are added in order.
PhotometricSystem::Totals PhotometricSystem::collapse_patches(Half& half, double* costs) {
  const bool exact = rules_.exact_rows && scene_.warped;
  const Chunks& chunks = patch_chunks();
  const PhotometricInput in = patches_at(half);
  std::vector<PhotometricOutput> outputs(
      chunks.chunks.size(), {mixed_ ? half.patch_rows.data() : nullptr, half.factors.data(),
                             half.brightness_sums.data(), half.seen.data(), costs, 0, 0, 0});
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
void PhotometricSystem::gather_rows(Half& half, Totals& totals) const {
  const MixedRows::State state{half.views.data(), half.points.data(), half.patch_rows.data()};
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
void PhotometricSystem::hold(const ScaledLoss& loss) {
  if (collapsed_ && loss.kind == loss_.kind && loss.scale_px == loss_.scale_px) return;
  loss_ = loss;
  leaving_.fill(0);
  totals_ = collapse(held_, leaving_costs_.data());
  collapsed_ = true;
  if (rules_.leaving_is_free) return;
  set_leaving();
  if (totals_.left > 0) totals_ = collapse(held_, nullptr);
}

/// A patch that leaves costs as much as it does now, and no less than the mean does.
void PhotometricSystem::set_leaving() {
  double sum[2] = {0, 0};
  std::uint64_t count = 0;
  const auto for_each_patch = [&](const auto& visit) {
    for (const Batches::Group& group : batches_.groups)
      for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
        for (std::uint32_t l = 0; l < group.lanes; ++l) visit(16 * b + l);
  };
  for_each_patch([&](std::uint64_t at) {
    if (std::isnan(held_.seen[at])) return;
    sum[0] += leaving_costs_[at], sum[1] += leaving_costs_[at + 8];
    ++count;
  });
  if (count == 0) return;
  for_each_patch([&](std::uint64_t at) {
    for (int k = 0; k < 2; ++k)
      leaving_[at + 8 * k] =
          std::max(leaving_costs_[at + 8 * k], sum[k] / static_cast<double>(count));
  });
}

/// What a patch says of its image's brightness alone.
void PhotometricSystem::add_brightness(const Chunk& chunk, double* diagonal) const {
  for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
    const Batches::Group& group = batches_.groups[g];
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
      for (std::uint32_t l = 0; l < group.lanes; ++l) {
        const double* from = &held_.brightness_sums[kBrightnessBatch * b + l];
        double* block = diagonal + kDiagonalDoubles * batches_.image[8 * b + l];
        block[8 * 6 + 6] += from[0];
        block[8 * 6 + 7] += from[8];
        block[8 * 7 + 6] += from[8];
        block[8 * 7 + 7] += from[16];
        block[72 + 6] += from[24];
        block[72 + 7] += from[32];
      }
  }
}

void PhotometricSystem::add_priors() {
  double* diagonal = blocks_.are_pairs() ? image_diagonal_.data() : diagonal_.data();
  const double wa = 1 / (rules_.prior_a * rules_.prior_a);
  const double wb = 1 / (rules_.prior_b * rules_.prior_b);
  for (std::size_t i = 0; i < held_.brightness.size(); ++i) {
    double* block = diagonal + kDiagonalDoubles * i;
    block[8 * 6 + 6] += wa;
    block[8 * 7 + 7] += wb;
    block[72 + 6] += wa * (held_.brightness[i].a - 1);
    block[72 + 7] += wb * held_.brightness[i].b;
  }
}

/// Twice the priors' part of the cost.
double PhotometricSystem::prior_cost(const Half& half) const {
  double sum = 0;
  if (!rules_.brightness) return sum;
  for (const Brightness& of : half.brightness) {
    const double ra = (of.a - 1) / rules_.prior_a, rb = of.b / rules_.prior_b;
    sum += ra * ra + rb * rb;
  }
  return sum;
}

void PhotometricSystem::eliminate(double damping, std::vector<EliminateOutput>& outputs) {
  const std::size_t slices = outputs.size();
  const std::size_t tile_doubles = tiles_.size() / slices;
  const std::size_t diagonal_doubles = diagonal_.size() / slices;
  const PhotometricInput patches = patches_at(held_);
  const StoredRowsInput in{&rows(), kept(patches), damping, rules_.points_held, !rules_.brightness};
  threads_.for_each(slices, [&](std::size_t s) {
    Buffer<double>& scratch = scratch_[static_cast<std::size_t>(threads_.worker())];
    if (scratch.size() == 0) scratch.allocate(scratch_doubles(rows(), chunks_));
    const Records records = records_in(scratch.data(), chunks_);
    double* tiles = tiles_.data() + s * tile_doubles;
    double* diagonal = diagonal_.data() + s * diagonal_doubles;
    std::fill_n(tiles, tile_doubles, 0.0);
    std::fill_n(diagonal, diagonal_doubles, 0.0);
    outputs[s] = {factors_.data(), 0, 0, 0};
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c) {
      const Chunk& chunk = chunks_.chunks[c];
      row_kernels_.eliminate(in, chunk, records, outputs[s]);
      if (rules_.brightness) {
        kernels_.diagonal(rows(), chunks_, chunk, records, diagonal);
        kernels_.pairs(chunks_, chunk, records, tiles);
        if (!mixed_) add_brightness(chunk, diagonal);
      } else {
        row_kernels_.pose_diagonal(chunks_, chunk, records, diagonal);
        pose_pairs_(chunks_, chunk, records, tiles);
      }
    }
  });
  add_slices(tiles_, slices, threads_);
  add_slices(diagonal_, slices, threads_);
  if (rules_.brightness && mixed_)
    for (const Chunk& chunk : patch_chunks_.chunks) add_brightness(chunk, diagonal_.data());
}

void PhotometricSystem::fold_to_images() {
  image_tiles_.fill(0);
  image_diagonal_.fill(0);
  blocks_.fold(held_.poses, held_.brightness, scene_.num_images(),
               {&chunks_.tiles, tiles_.data(), diagonal_.data(), &tile_of_, image_tiles_.data(),
                image_diagonal_.data()});
}

Step PhotometricSystem::propose(const StepRequest& request) {
  hold(request.loss);
  std::vector<EliminateOutput> outputs(chunks_.slices.size() - 1);
  eliminate(request.damping, outputs);
  if (blocks_.are_pairs()) fold_to_images();
  if (rules_.brightness) add_priors();

  Step step;
  double gradient2 = 0;
  point_decrease_ = 0;
  for (const EliminateOutput& out : outputs) {
    point_decrease_ += out.point_decrease;
    gradient2 = std::max(gradient2, out.gradient_max2);
  }
  step.cost = totals_.cost / 2;
  step.plain_cost = totals_.square_sum / 2;
  step.gradient_max = std::max(std::sqrt(gradient2 * (1 + request.damping)),
                               stage_.gather(sums(), request.damping));
  step.solved = std::isfinite(totals_.cost) && stage_.solve(sums(), request, nullptr, step);
  return step;
}

/// Steps every image; returns the largest change of a block: radians, relative translation,
/// relative brightness.
double PhotometricSystem::step_cameras() {
  double largest = 0;
  for (std::size_t i = 0; i < held_.poses.size(); ++i) {
    const std::int32_t* c = columns_.image(i);
    double* d = &image_steps_[kStepRecord * i];
    std::fill(d, d + kStepRecord, 0.0);
    for (int k = 0; k < 8; ++k)
      if (c[k] >= 0) d[k] = stage_.step()[c[k]];
    const RigidMotion<double>& pose = held_.poses[i];
    if (c[0] >= 0) tried_.poses[i] = left_perturbed(pose, {d[0], d[1], d[2]}, {d[3], d[4], d[5]});
    tried_.brightness[i] = {held_.brightness[i].a + d[6], held_.brightness[i].b + d[7]};
    for (double change : {norm3(d + 3), norm3(d) / (norm3(pose.translation.data()) + 1e-300),
                          std::abs(d[6]), std::abs(d[7]) / 255})
      largest = std::max(largest, change);
  }
  blocks_.write_views(tried_.poses, tried_.brightness, tried_.views.data());
  blocks_.step(held_.poses, held_.brightness, image_steps_.data(), steps_.data());
  return largest;
}

Trial PhotometricSystem::trial() {
  Trial out;
  out.step_norm = step_cameras();
  const PhotometricInput patches = patches_at(held_);
  const RowTrialInput in{&rows(), kept(patches), steps_.data(), held_.points.data(),
                         factors_.data()};
  std::vector<TrialOutput> outputs(chunks_.slices.size() - 1,
                                   TrialOutput{tried_.points.data(), 0, 0, 0, 0});
  threads_.for_each(outputs.size(), [&](std::size_t s) {
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c)
      row_kernels_.back_substitute(in, chunks_.chunks[c], outputs[s]);
  });
  double decrease = point_decrease_, step2 = 0;
  for (const TrialOutput& o : outputs) {
    decrease += o.damping_term;
    step2 = std::max(step2, o.step2_max);
  }
  decrease = stage_.add_decrease(decrease);
  tried_totals_ = collapse(tried_, nullptr);
  out.cost = tried_totals_.cost / 2;
  out.plain_cost = tried_totals_.square_sum / 2;
  out.predicted_decrease = decrease / 2;
  out.step_norm = std::max(out.step_norm, std::sqrt(step2));
  out.motion_px = median_motion();
  return out;
}

/// Of the patches that are in their image before and after: of some two thousand, evenly spread.
double PhotometricSystem::median_motion() const {
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

void PhotometricSystem::accept() {
  std::swap(held_, tried_);
  totals_ = tried_totals_;
}

/// Of |r| over the pixels of all patches in their images.
double PhotometricSystem::residual_scale(double quantile) {
  const PatchState now = state();
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

PatchState PhotometricSystem::state() const {
  PatchState out;
  for (const RigidMotion<double>& pose : held_.poses)
    out.poses.push_back({pose.rotation, pose.translation});
  out.brightness = held_.brightness;
  out.points = initial_points_;
  for (std::size_t g = 0; g < rows().groups.size(); ++g)
    for (std::uint32_t l = 0; l < rows().groups[g].lanes; ++l)
      for (int d = 0; d < 3; ++d)
        out.points[3 * std::size_t(rows().lane_point[8 * g + l]) + d] =
            held_.points[kPointGroup * g + 8 * d + l];
  return out;
}

}  // namespace sheaf
