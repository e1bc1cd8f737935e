// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/lens_system.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "geometry/camera_model.h"
#include "lists/slices.h"
#include "systems/lens_implicit.h"

namespace sheaf {
namespace {

constexpr std::size_t kGroupsPerTask = 1024;

double norm(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

}  // namespace

Result<LensArrangement> arrange_with_lenses(const Problem& problem, const Fixed& fixed,
                                            const std::vector<std::uint8_t>& skip,
                                            Threads& threads) {
  LensArrangement out;
  out.batches = arrange(problem, skip, threads);
  out.tracks = arrange_lenses(problem, fixed, out.batches, threads);
  if (!LensChunks::possible(out.batches, out.tracks))
    return Error(ErrorCode::usage, "a point is seen " + std::to_string(out.batches.longest_track) +
                                       " times; with these camera models and lenses, at most " +
                                       std::to_string(Chunks::kLongestTrack) +
                                       " observations and lenses of one point can be solved for");
  out.columns = number_lens_columns(out.tracks, fixed);
  return out;
}

LensSystem::LensSystem(const Problem& problem, const LensArrangement& arrangement,
                       LensChunks chunks, const LensRules& rules, const Plan& plan,
                       const Kernels& kernels, Threads& threads)
    : arranged_(arrangement),
      lists_(std::move(chunks)),
      chunks_(lists_.chunks),
      rules_(rules),
      kernels_(kernels),
      lens_kernels_(lens_kernels(kernels.name)),
      threads_(threads),
      poses_alone_(std::all_of(arrangement.tracks.lenses.begin(), arrangement.tracks.lenses.end(),
                               [](const LensPlaces& lens) { return lens.riders == 0; })),
      layout_(arrangement.batches, arrangement.tracks, chunks_, lists_.tiles),
      stage_(arrangement.columns) {
  fill_state(problem);
  factors_.allocate(kFactorGroup * arranged_.batches.groups.size());
  tiles_.allocate(num_slices() * kTileDoubles * chunks_.tiles.size());
  diagonal_.allocate(num_slices() * kDiagonalDoubles * arranged_.tracks.num_blocks);
  scratch_.resize(static_cast<std::size_t>(threads.count()));
  set_solver(plan);
}

LensProductInput LensSystem::held_product() const {
  return {{&arranged_.batches, &arranged_.tracks, held_.view()}, factors_.data(), weights_.data()};
}

void LensSystem::set_solver(const Plan& plan) {
  const Columns& columns = arranged_.columns;
  const bool iterates =
      plan.kind == SolverKind::explicit_cg || plan.kind == SolverKind::implicit_cg;
  if (iterates && !rules_.points_held && plan.clusters.count > 0) {
    pose_columns_ = image_columns(arranged_.tracks, columns, false);
    coarse_ = std::make_unique<CoarseSpace>(arranged_.batches, pose_columns_, plan.clusters,
                                            num_slices(), kernels_, threads_);
  }
  switch (plan.kind) {
    case SolverKind::blocks:
      return stage_.set_solver(make_block_solver(columns, threads_));
    case SolverKind::sparse:
      return stage_.set_solver(make_sparse_solver(columns, chunks_, kernels_, threads_));
    case SolverKind::explicit_cg:
      return stage_.set_solver(
          make_explicit_solver(columns, chunks_, plan.mixed, kernels_, threads_));
    case SolverKind::implicit_cg:
      return stage_.set_solver(make_lens_implicit_solver(
          columns, chunks_, [this] { return held_product(); }, lens_kernels_, threads_));
    case SolverKind::dense:
      return stage_.set_solver(make_dense_solver(columns, kernels_, threads_));
  }
}

void LensSystem::fill_state(const Problem& problem) {
  for (const Pose& pose : problem.poses) held_.poses.push_back({pose.rotation, pose.translation});
  for (const Camera& camera : problem.cameras) held_.lenses.push_back(camera.parameters);
  tried_.poses = held_.poses;
  tried_.lenses = held_.lenses;
  const Batches& batches = arranged_.batches;
  for (State* state : {&held_, &tried_}) {
    state->images.allocate(kLensStateRecord * held_.poses.size());
    state->lens_records.allocate(kLensStateRecord * held_.lenses.size());
    state->points.allocate(kPointGroup * batches.groups.size());
    for (std::size_t i = 0; i < held_.poses.size(); ++i)
      write_pose(held_.poses[i], &state->images[kLensStateRecord * i]);
    for (std::size_t c = 0; c < held_.lenses.size(); ++c)
      write_lens(held_.lenses[c], &state->lens_records[kLensStateRecord * c]);
  }
  threads_.for_ranges(batches.groups.size(), kGroupsPerTask, [&](std::size_t g, std::size_t end) {
    for (; g < end; ++g)
      for (std::size_t l = 0; l < 8; ++l) {
        const double* X = &problem.points[3 * std::size_t(batches.lane_point[8 * g + l])];
        for (std::size_t d = 0; d < 3; ++d) held_.points[kPointGroup * g + 8 * d + l] = X[d];
      }
  });
}

void LensSystem::write_pose(const RigidMotion<double>& pose, double* record) {
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  std::copy(R.begin(), R.end(), record);
  std::copy(pose.translation.begin(), pose.translation.end(), record + 9);
  std::fill(record + lens_record::kPoseStep, record + kLensStateRecord, 0.0);
}

void LensSystem::write_lens(const Parameters& lens, double* record) {
  std::copy(lens.begin(), lens.end(), record);
  std::fill(record + lens_record::kParameterStep, record + kLensStateRecord, 0.0);
}

Step LensSystem::propose(const StepRequest& request) {
  loss_ = request.loss;
  std::vector<EliminateOutput> outputs(num_slices());
  linearize(request, outputs);
  double square_sum = 0, loss_sum = 0, gradient2 = 0;
  point_decrease_ = 0;
  for (const EliminateOutput& out : outputs) {
    square_sum += out.square_sum;
    loss_sum += out.loss_sum;
    point_decrease_ += out.point_decrease;
    gradient2 = std::max(gradient2, out.gradient_max2);
  }
  Step step;
  step.plain_cost = square_sum / 2;
  step.cost = cost_of(square_sum, loss_sum);
  mean_square_ = 2 * step.cost / static_cast<double>(arranged_.batches.observations);
  const ReducedSums sums{&chunks_, tiles_.data(), diagonal_.data()};
  // w is whitened by V (1 + damping): undo the damping's part.
  step.gradient_max =
      std::max(std::sqrt(gradient2 * (1 + request.damping)), stage_.gather(sums, request.damping));
  const bool corrected = coarse_ && coarse_->factor(diagonal_.data(), stage_.damping());
  step.solved = std::isfinite(square_sum) &&
                stage_.solve(sums, request, corrected ? coarse_.get() : nullptr, step);
  if (coarse_) coarse_->solved(step.linear_iterations);
  return step;
}

void LensSystem::linearize(const StepRequest& request, std::vector<EliminateOutput>& outputs) {
  const LensTracks& tracks = arranged_.tracks;
  const std::size_t tile_doubles = kTileDoubles * chunks_.tiles.size();
  const std::size_t diagonal_doubles = kDiagonalDoubles * tracks.num_blocks;
  const std::size_t weights =
      loss_.kind == LossKind::none ? 0 : 8 * arranged_.batches.num_batches();
  if (weights_.size() != weights) weights_.allocate(weights);
  const LensEliminateInput in{
      {&arranged_.batches, &tracks, held_.view()}, request.damping, rules_.points_held, loss_};
  if (coarse_) coarse_->begin(held_.images.data(), request.damping);
  threads_.for_each(num_slices(), [&](std::size_t s) {
    Buffer<double>& scratch = scratch_[static_cast<std::size_t>(threads_.worker())];
    if (scratch.size() == 0) scratch.allocate(layout_.doubles);
    const LensRecords records = layout_.in(scratch.data());
    double* tiles = tiles_.data() + s * tile_doubles;
    double* diagonal = diagonal_.data() + s * diagonal_doubles;
    std::fill_n(tiles, tile_doubles, 0.0);
    std::fill_n(diagonal, diagonal_doubles, 0.0);
    if (coarse_) coarse_->clear(s);
    outputs[s] = {factors_.data(), 0, 0, 0, 0, weights_.data()};
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c) {
      const Chunk& chunk = chunks_.chunks[c];
      lens_kernels_.linearize(in, chunk, records, outputs[s]);
      kernels_.diagonal(arranged_.batches, chunks_, chunk, records.image, diagonal);
      (poses_alone_ ? lens_kernels_.pose_pairs : kernels_.pairs)(chunks_, chunk, records.image,
                                                                 tiles);
      kernels_.pairs(lists_.slots, lists_.slots.chunks[c], records.image, tiles);
      lens_kernels_.products(tracks, lists_.tiles, chunks_, chunk, records, diagonal, tiles);
      if (coarse_) coarse_->add(s, chunk, records.image);
    }
  });
  add_slices(tiles_, num_slices(), threads_);
  add_slices(diagonal_, num_slices(), threads_);
}

/// Steps every image's pose; returns the largest relative change of a block, as BundleSystem's.
double LensSystem::step_images() {
  double largest = 0;
  const Buffer<double>& step = stage_.step();
  for (std::size_t i = 0; i < held_.poses.size(); ++i) {
    const std::int32_t* c = arranged_.columns.image(i);
    if (c[0] < 0) continue;
    std::array<double, 6> d{};
    for (std::size_t k = 0; k < 6; ++k) d[k] = step[static_cast<std::size_t>(c[k])];
    const RigidMotion<double>& pose = held_.poses[i];
    tried_.poses[i] = left_perturbed(pose, {d[0], d[1], d[2]}, {d[3], d[4], d[5]});
    std::copy(d.begin(), d.end(), &held_.images[kLensStateRecord * i + lens_record::kPoseStep]);
    write_pose(tried_.poses[i], &tried_.images[kLensStateRecord * i]);
    const auto& t = pose.translation;
    largest = std::max({largest, norm(d[3], d[4], d[5]),
                        norm(d[0], d[1], d[2]) / (norm(t[0], t[1], t[2]) + 1e-300)});
  }
  return largest;
}

/// Steps every lens; lengths in pixels change relative to the focal length.
double LensSystem::step_lenses() {
  double largest = 0;
  const LensTracks& tracks = arranged_.tracks;
  std::vector<char> stepped(held_.lenses.size(), false);
  for (std::size_t i = 0; i < tracks.image_lens.size(); ++i) {
    const std::size_t lens = tracks.image_lens[i];
    if (std::exchange(stepped[lens], true)) continue;
    const LensPlaces& places = tracks.lenses[lens];
    const ParameterRoles roles = roles_of(places.model);
    const Parameters& k = held_.lenses[lens];
    Parameters d{};
    Parameters& tried = tried_.lenses[lens];
    tried = k;
    for (int p = 0; p < static_cast<int>(k.size()); ++p) {
      const int place = places.place[static_cast<std::size_t>(p)];
      if (place < 0) continue;
      const std::int32_t* c = arranged_.columns.image(i) + 6 + place;
      if (place >= LensPlaces::kRiders)
        c = arranged_.columns.image(places.first_block) + (place - LensPlaces::kRiders);
      const double change = stage_.step()[static_cast<std::size_t>(*c)];
      const bool length = p == roles.fx || p == roles.fy || p == roles.cx || p == roles.cy;
      const double unit = length ? std::abs(k[static_cast<std::size_t>(roles.fx)]) + 1e-300 : 1;
      largest = std::max(largest, std::abs(change) / unit);
      d[static_cast<std::size_t>(p)] = change;
      tried[static_cast<std::size_t>(p)] += change;
    }
    double* record = &held_.lens_records[kLensStateRecord * lens];
    std::copy(d.begin(), d.end(), record + lens_record::kParameterStep);
    write_lens(tried, &tried_.lens_records[kLensStateRecord * lens]);
  }
  return largest;
}

Trial LensSystem::trial() {
  Trial out;
  out.step_norm = std::max(step_images(), step_lenses());
  const LensTrialInput in{&arranged_.batches, &arranged_.tracks,
                          held_.view(),       tried_.view(),
                          factors_.data(),    rules_.points_held ? 0 : rules_.inner_iterations,
                          mean_square_,       loss_,
                          weights_.data()};
  std::vector<TrialOutput> outputs(num_slices());
  threads_.for_each(num_slices(), [&](std::size_t s) {
    outputs[s] = {tried_.points.data(), 0, 0, 0, 0};
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c)
      lens_kernels_.trial(in, chunks_.chunks[c], outputs[s]);
  });
  double decrease = point_decrease_, square_sum = 0, loss_sum = 0, step2 = 0;
  for (const TrialOutput& o : outputs) {
    square_sum += o.square_sum;
    loss_sum += o.loss_sum;
    decrease += o.damping_term;
    step2 = std::max(step2, o.step2_max);
  }
  decrease = stage_.add_decrease(decrease);
  out.plain_cost = square_sum / 2;
  out.cost = cost_of(square_sum, loss_sum);
  trial_cost_ = out.cost;
  out.predicted_decrease = decrease / 2;
  out.step_norm = std::max(out.step_norm, std::sqrt(step2));
  if (rules_.watch_behind) out.newly_behind = count_newly_unseen();
  return out;
}

/// A loss may be finite where the residual is not: such a state has no finite cost either.
double LensSystem::cost_of(double square_sum, double loss_sum) const {
  return (loss_.kind == LossKind::none || !std::isfinite(square_sum) ? square_sum : loss_sum) / 2;
}

void LensSystem::accept() {
  if (coarse_) coarse_->moved(trial_cost_);
  std::swap(held_, tried_);
}

bool LensSystem::sees(const State& state, std::uint64_t batch, std::uint32_t lane,
                      const double* X) const {
  const std::size_t at = 8 * batch + lane;
  const double* pose = &state.images[kLensStateRecord * arranged_.batches.image[at]];
  const std::uint32_t lens = arranged_.tracks.lens[at];
  double P[3];
  for (int i = 0; i < 3; ++i)
    P[i] = pose[3 * i] * X[0] + pose[3 * i + 1] * X[8] + pose[3 * i + 2] * X[16] + pose[9 + i];
  return with_lens(arranged_.tracks.lenses[lens].model,
                   [&](auto model) { return model.sees(state.lenses[lens].data(), P); });
}

std::uint64_t LensSystem::count_newly_unseen() const {
  const Batches& batches = arranged_.batches;
  std::vector<std::uint64_t> counts(num_slices(), 0);
  threads_.for_each(num_slices(), [&](std::size_t s) {
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c)
      for (std::uint32_t g = chunks_.chunks[c].first_group; g < chunks_.chunks[c].end_group; ++g) {
        const Batches::Group& group = batches.groups[g];
        for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b)
          for (std::uint32_t l = 0; l < group.lanes; ++l)
            counts[s] += !sees(tried_, b, l, &tried_.points[kPointGroup * g + l]) &&
                         sees(held_, b, l, &held_.points[kPointGroup * g + l]);
      }
  });
  std::uint64_t all = 0;
  for (std::uint64_t count : counts) all += count;
  return all;
}

double LensSystem::residual_scale(double quantile) {
  QuantileSearch search(quantile, 2 * arranged_.batches.observations);
  while (!search.done()) search.narrow(count_residuals(search));
  return search.value();
}

/// Counts are whole numbers: the threads' shares add up to the same in any order.
DigitCounts LensSystem::count_residuals(const QuantileSearch& search) {
  std::vector<DigitCounts> counts(static_cast<std::size_t>(threads_.count()));
  const LensInput in{&arranged_.batches, &arranged_.tracks, held_.view()};
  threads_.for_each(num_slices(), [&](std::size_t s) {
    Buffer<double>& scratch = scratch_[static_cast<std::size_t>(threads_.worker())];
    if (scratch.size() == 0) scratch.allocate(layout_.doubles);
    DigitCounts& mine = counts[static_cast<std::size_t>(threads_.worker())];
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c) {
      const Chunk& chunk = chunks_.chunks[c];
      lens_kernels_.residuals(in, chunk, scratch.data());
      for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
        const Batches::Group& group = arranged_.batches.groups[g];
        const double* of = scratch.data() + 16 * (group.first_batch - chunk.first_batch);
        for (std::uint32_t row = 0; row < 2 * group.track; ++row)
          for (std::uint32_t l = 0; l < group.lanes; ++l) search.count(of[8 * row + l], mine);
      }
    }
  });
  return sum_of(counts);
}

void LensSystem::store(Problem& problem) const {
  for (std::size_t i = 0; i < held_.poses.size(); ++i) {
    problem.poses[i].rotation = held_.poses[i].rotation;
    problem.poses[i].translation = held_.poses[i].translation;
  }
  for (std::size_t c = 0; c < held_.lenses.size(); ++c)
    problem.cameras[c].parameters = held_.lenses[c];
  const Batches& batches = arranged_.batches;
  threads_.for_ranges(batches.groups.size(), kGroupsPerTask, [&](std::size_t g, std::size_t end) {
    for (; g < end; ++g)
      for (std::uint32_t l = 0; l < batches.groups[g].lanes; ++l) {
        double* X = &problem.points[3 * std::size_t(batches.lane_point[8 * g + l])];
        for (std::size_t d = 0; d < 3; ++d) X[d] = held_.points[kPointGroup * g + 8 * d + l];
      }
  });
}

}  // namespace sheaf
