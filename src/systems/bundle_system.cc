// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/bundle_system.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "lists/slices.h"
#include "reduced/scaling.h"

namespace sheaf {

namespace {

constexpr std::size_t kGroupsPerTask = 1024;
/// Of the units that the linear system's products with points are computed in.
constexpr double kRounding = 1.1e-16, kFloatRounding = 6e-8;

/// Points that are held couple no images: no pairs. Lists number records with 16 bits, too few for
/// the longest tracks: sums then run over the records in their own order.
ChunkLists lists_for(SolverKind kind, bool points_held, std::uint32_t longest_track) {
  if (points_held)
    return longest_track > Chunks::kLongestTrack ? ChunkLists::none : ChunkLists::diagonal;
  switch (kind) {
    case SolverKind::dense:
    case SolverKind::sparse:
    case SolverKind::explicit_cg:
      return ChunkLists::pairs;
    case SolverKind::blocks:
      return ChunkLists::diagonal;
    case SolverKind::implicit_cg:
      return ChunkLists::none;
  }
  return ChunkLists::none;
}

}  // namespace

BundleSystem::BundleSystem(const Problem& problem, const Batches& batches, Columns columns,
                           const PointRules& rules, const Plan& plan, const Kernels& kernels,
                           Threads& threads)
    : rules_(rules),
      float_products_(plan.mixed && plan.kind == SolverKind::implicit_cg),
      kernels_(kernels),
      threads_(threads),
      batches_(batches),
      chunks_(cut_into_chunks(batches_, static_cast<std::uint32_t>(problem.num_images()),
                              lists_for(plan.kind, rules.held, batches_.longest_track), threads)),
      columns_(std::move(columns)) {
  fill_state(problem);
  place_charts();
  const std::size_t slices = chunks_.slices.size() - 1;
  factors_.allocate(kFactorGroup * batches_.groups.size());
  tiles_.allocate(slices * kTileDoubles * chunks_.tiles.size());
  diagonal_.allocate(slices * kDiagonalDoubles * problem.num_images());
  scratch_.resize(threads.count());
  const std::size_t padded = (static_cast<std::size_t>(columns_.count) + 7) / 8 * 8;
  damping_.allocate(padded);
  camera_step_.allocate(padded);
  make_coarse_space(plan);
  switch (plan.kind) {
    case SolverKind::blocks:
      solver_ = make_block_solver(columns_, threads);
      break;
    case SolverKind::dense:
      solver_ = make_dense_solver(columns_, kernels, threads);
      break;
    case SolverKind::sparse:
      solver_ = make_sparse_solver(columns_, chunks_, kernels, threads);
      break;
    case SolverKind::explicit_cg:
      solver_ = make_explicit_solver(columns_, chunks_, plan.mixed, kernels, threads);
      break;
    case SolverKind::implicit_cg:
      solver_ = make_implicit_solver(columns_, held_state(), plan.mixed, kernels, threads);
      break;
  }
}

HeldState BundleSystem::held_state() {
  return {&batches_, &chunks_, &cameras_, &points_, &factors_, &weights_};
}

void BundleSystem::make_coarse_space(const Plan& plan) {
  const bool iterates =
      plan.kind == SolverKind::explicit_cg || plan.kind == SolverKind::implicit_cg;
  if (!rules_.held && iterates && plan.clusters.count > 0)
    coarse_ = std::make_unique<CoarseSpace>(batches_, columns_, plan.clusters,
                                            chunks_.slices.size() - 1, kernels_, threads_);
}

void BundleSystem::fill_state(const Problem& problem) {
  poses_.reserve(problem.num_images());
  for (const Pose& pose : problem.poses) poses_.push_back({pose.rotation, pose.translation});
  image_camera_ = problem.image_camera;
  lenses_.reserve(problem.cameras.size());
  for (const Camera& camera : problem.cameras)
    lenses_.push_back({camera.parameters[0], camera.parameters[1], camera.parameters[2]});
  trial_poses_ = poses_;
  trial_lenses_ = lenses_;
  cameras_.allocate(kCameraRecord * problem.num_images());
  trial_cameras_.allocate(kCameraRecord * problem.num_images());
  for (std::size_t i = 0; i < poses_.size(); ++i)
    write_camera_record(i, poses_[i], lenses_[image_camera_[i]].data(), cameras_.data());
  points_.allocate(kPointGroup * batches_.groups.size());
  trial_points_.allocate(points_.size());
  threads_.for_ranges(batches_.groups.size(), kGroupsPerTask, [&](std::size_t g, std::size_t end) {
    for (; g < end; ++g)
      for (int l = 0; l < 8; ++l) {
        const double* X = &problem.points[3 * std::size_t(batches_.lane_point[8 * g + l])];
        for (int d = 0; d < 3; ++d) points_[kPointGroup * g + 8 * d + l] = X[d];
      }
  });
}

/// Homogeneous points are about the mean camera centre, in units of the cameras' mean distance from
/// it, so that neither the place of the scene nor its unit matters. Points that are held have no
/// charts: nothing of them may move.
void BundleSystem::place_charts() {
  if (rules_.held || rules_.charts == ChartBase::none) return;
  const std::size_t images = poses_.size();
  const auto centre = [&](std::size_t image, int k) {
    const double *R = &cameras_[kCameraRecord * image], *t = R + camera_record::kTranslation;
    return -(R[k] * t[0] + R[3 + k] * t[1] + R[6 + k] * t[2]);
  };
  chart_.base = rules_.charts;
  chart_.crosses = !rules_.watch_behind;
  for (int k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < images; ++i) chart_.origin[k] += centre(i, k);
    chart_.origin[k] /= static_cast<double>(images);
  }
  double length = 0;
  for (std::size_t i = 0; i < images; ++i)
    length += std::hypot(centre(i, 0) - chart_.origin[0], centre(i, 1) - chart_.origin[1],
                         centre(i, 2) - chart_.origin[2]);
  chart_.unit = towards_one(length / static_cast<double>(images));
}

void BundleSystem::write_camera_record(std::size_t image, const RigidMotion<double>& pose,
                                       const double* parameters, double* records) {
  double* record = records + kCameraRecord * image;
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  std::copy(R.begin(), R.end(), record);
  std::copy(pose.translation.begin(), pose.translation.end(), record + 9);
  std::copy(parameters, parameters + 3, record + camera_record::kFocal);
  std::fill(record + camera_record::kStep, record + kCameraRecord, 0.0);
}

Step BundleSystem::propose(const StepRequest& request) {
  const bool reuse = only_radius_is_new(request);
  request_ = request;
  if (reuse) {
    step_.reused = true;
    step_.linear_iterations = 0;
    shorten_newton();
    return step_;
  }
  plane_.reset();
  proposed_ = descended_ = false;
  step_ = linearize(request);
  proposed_ = step_.solved;
  return step_;
}

Step BundleSystem::linearize(const StepRequest& request) {
  const std::size_t slices = chunks_.slices.size() - 1;
  const std::size_t tile_doubles = kTileDoubles * chunks_.tiles.size();
  const std::size_t diagonal_doubles = diagonal_.size() / slices;
  loss_ = request.loss;
  const std::size_t weights = loss_.kind == LossKind::none ? 0 : 8 * batches_.num_batches();
  if (weights_.size() != weights) weights_.allocate(weights);
  chart_.rounding = 1e2 * (float_products_ && !request.precise ? kFloatRounding : kRounding);
  const EliminateInput in{&batches_,       &chunks_,    cameras_.data(), points_.data(),
                          request.damping, rules_.held, loss_,           chart_};
  if (coarse_) coarse_->begin(cameras_.data(), request.damping);
  std::vector<EliminateOutput> outputs(slices);
  threads_.for_each(slices, [&](std::size_t s) {
    Buffer<double>& scratch = scratch_[threads_.worker()];
    if (scratch.size() == 0) scratch.allocate(scratch_doubles(batches_, chunks_));
    const Records records = records_in(scratch.data(), chunks_);
    double* tiles = tiles_.data() + s * tile_doubles;
    double* diagonal = diagonal_.data() + s * diagonal_doubles;
    std::fill_n(tiles, tile_doubles, 0.0);
    std::fill_n(diagonal, diagonal_doubles, 0.0);
    if (coarse_) coarse_->clear(s);
    outputs[s] = {factors_.data(), 0, 0, 0, 0, weights_.data()};
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c) {
      kernels_.linearize(in, chunks_.chunks[c], records, outputs[s]);
      kernels_.diagonal(batches_, chunks_, chunks_.chunks[c], records, diagonal);
      kernels_.pairs(chunks_, chunks_.chunks[c], records, tiles);
      if (coarse_) coarse_->add(s, chunks_.chunks[c], records);
    }
  });
  add_slices(tiles_, slices, threads_);
  add_slices(diagonal_, slices, threads_);
  return collect_step(request, outputs);
}

Step BundleSystem::collect_step(const StepRequest& request,
                                const std::vector<EliminateOutput>& outputs) {
  Step step;
  double square_sum = 0, loss_sum = 0, gradient2 = 0;
  point_decrease_ = 0;
  for (const EliminateOutput& out : outputs) {
    square_sum += out.square_sum;
    loss_sum += out.loss_sum;
    point_decrease_ += out.point_decrease;
    gradient2 = std::max(gradient2, out.gradient_max2);
  }
  step.plain_cost = square_sum / 2;
  step.cost = cost_of(square_sum, loss_sum);
  mean_square_ = 2 * step.cost / static_cast<double>(batches_.observations);
  // w is whitened by V (1 + damping): undo the damping's part.
  step.gradient_max = std::sqrt(gradient2 * (1 + request.damping));
  vectors_.gather({&chunks_, tiles_.data(), diagonal_.data()}, columns_);
  for (std::int32_t c = 0; c < columns_.count; ++c) {
    const double square = std::clamp(vectors_.squares[c], kDiagonalFloor, kDiagonalCeiling);
    damping_[c] = request.damping * square;
    step.gradient_max = std::max(step.gradient_max, std::abs(vectors_.rhs[c]) / std::sqrt(square));
  }
  step.solved = std::isfinite(square_sum) && solve_cameras(request, step);
  return step;
}

bool BundleSystem::solve_cameras(const StepRequest& request, Step& step) {
  residual_ = nullptr;
  cut_ = false;
  if (columns_.count == 0) return true;
  corrected_ = coarse_ && coarse_->factor(diagonal_.data(), damping_.data());
  const CameraSolution solution = solver_->solve(camera_system(request), camera_step_);
  ++camera_solves_;
  step.linear_iterations = solution.iterations;
  if (coarse_) coarse_->solved(solution.iterations);
  residual_ = solution.residual;
  cut_ = solution.cut;
  return solution.solved && std::all_of(camera_step_.begin(), camera_step_.begin() + columns_.count,
                                        [](double x) { return std::isfinite(x); });
}

CameraSystem BundleSystem::camera_system(const StepRequest& request) const {
  return {{&chunks_, tiles_.data(), diagonal_.data()},
          &vectors_,
          damping_.data(),
          request.forcing,
          request.cancelled,
          corrected_ ? coarse_.get() : nullptr,
          request.precise,
          request.radius,
          request.damping,
          request.dogleg};
}

/// Steps every camera by these columns; returns the largest relative change of a block: radians for
/// rotations, relative to its length for translations and focal lengths, absolute for the
/// distortion (it stands beside 1). The records keep the step that was solved for: points follow it
/// by back-substitution.
double BundleSystem::step_cameras(const Buffer<double>& columns) {
  double largest = 0;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    const std::int32_t* c = columns_.image(i);
    std::array<double, 9> d{}, newton{};
    for (int k = 0; k < 9; ++k)
      if (c[k] >= 0) d[k] = columns[c[k]], newton[k] = camera_step_[c[k]];
    const RigidMotion<double>& pose = poses_[i];
    if (c[0] >= 0) trial_poses_[i] = left_perturbed(pose, {d[0], d[1], d[2]}, {d[3], d[4], d[5]});
    const std::uint32_t lens = image_camera_[i];
    const auto& k = lenses_[lens];
    for (int j = 0; j < 3; ++j)
      if (c[6 + j] >= 0) trial_lenses_[lens][j] = k[j] + d[6 + j];
    camera_record::write_step(k.data(), newton.data(),
                              &cameras_[kCameraRecord * i + camera_record::kStep]);
    write_camera_record(i, trial_poses_[i], trial_lenses_[lens].data(), trial_cameras_.data());
    const auto norm = [](double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); };
    const auto& t = pose.translation;
    for (double change :
         {norm(d[3], d[4], d[5]), norm(d[0], d[1], d[2]) / (norm(t[0], t[1], t[2]) + 1e-300),
          std::abs(d[6]) / (std::abs(k[0]) + 1e-300), std::abs(d[7]), std::abs(d[8])})
      largest = std::max(largest, change);
  }
  return largest;
}

Trial BundleSystem::try_step(const DoglegStep& step) {
  Trial out;
  out.step_norm = step_cameras(blend_cameras(step));
  PointBlend blend;
  if (plane_ && !rules_.held) {
    blend.newton = step.newton;
    blend.descent = step.descent * request_.damping;
    blend.inner_damping *= std::max(1.0, damping_of(*plane_, step) / request_.damping);
  }
  const std::size_t slices = chunks_.slices.size() - 1;
  const TrialInput in{&batches_,
                      cameras_.data(),
                      trial_cameras_.data(),
                      points_.data(),
                      factors_.data(),
                      rules_.watch_behind,
                      rules_.held ? 0 : rules_.inner_iterations,
                      mean_square_,
                      loss_,
                      weights_.data(),
                      chart_,
                      blend};
  std::vector<TrialOutput> outputs(slices);
  threads_.for_each(slices, [&](std::size_t s) {
    outputs[s] = {trial_points_.data(), 0, 0, 0, 0};
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c)
      kernels_.trial(in, chunks_.chunks[c], outputs[s]);
  });
  double decrease = point_decrease_, square_sum = 0, loss_sum = 0, step2 = 0;
  newton_damping_ = 0;
  for (const TrialOutput& o : outputs) {
    square_sum += o.square_sum;
    loss_sum += o.loss_sum;
    decrease += o.damping_term;
    newton_damping_ += o.damping_term;
    step2 = std::max(step2, o.step2_max);
    out.newly_behind += o.newly_behind;
  }
  for (std::int32_t c = 0; c < columns_.count; ++c)
    decrease += camera_step_[c] * (vectors_.rhs[c] + damping_[c] * camera_step_[c]);
  out.plain_cost = square_sum / 2;
  out.cost = cost_of(square_sum, loss_sum);
  trial_cost_ = out.cost;
  out.predicted_decrease = decrease / 2;
  out.step_norm = std::max(out.step_norm, std::sqrt(step2));
  return out;
}

/// A loss may be finite where the residual is not: such a state has no finite cost either.
double BundleSystem::cost_of(double square_sum, double loss_sum) const {
  return (loss_.kind == LossKind::none || !std::isfinite(square_sum) ? square_sum : loss_sum) / 2;
}

void BundleSystem::accept() {
  if (coarse_) coarse_->moved(trial_cost_);
  std::swap(poses_, trial_poses_);
  std::swap(lenses_, trial_lenses_);
  std::swap(cameras_, trial_cameras_);
  std::swap(points_, trial_points_);
  proposed_ = false;
}

void BundleSystem::store(Problem& problem) const {
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    problem.poses[i].rotation = poses_[i].rotation;
    problem.poses[i].translation = poses_[i].translation;
  }
  for (std::size_t i = 0; i < lenses_.size(); ++i)
    std::copy(lenses_[i].begin(), lenses_[i].end(), problem.cameras[i].parameters.begin());
  threads_.for_ranges(batches_.groups.size(), kGroupsPerTask, [&](std::size_t g, std::size_t end) {
    for (; g < end; ++g)
      for (std::uint32_t l = 0; l < batches_.groups[g].lanes; ++l) {
        double* X = &problem.points[3 * std::size_t(batches_.lane_point[8 * g + l])];
        for (int d = 0; d < 3; ++d) X[d] = points_[kPointGroup * g + 8 * d + l];
      }
  });
}

double BundleSystem::residual_scale(double quantile) {
  QuantileSearch search(quantile, 2 * batches_.observations);
  while (!search.done()) search.narrow(count_residuals(search));
  return search.value();
}

/// One pass over the residuals. Counts are whole numbers: the threads' shares add up to the same
/// in any order.
DigitCounts BundleSystem::count_residuals(const QuantileSearch& search) {
  std::vector<DigitCounts> counts(static_cast<std::size_t>(threads_.count()));
  threads_.for_each(chunks_.slices.size() - 1, [&](std::size_t s) {
    Buffer<double>& scratch = scratch_[threads_.worker()];
    if (scratch.size() == 0) scratch.allocate(scratch_doubles(batches_, chunks_));
    DigitCounts& mine = counts[threads_.worker()];
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c) {
      const Chunk& chunk = chunks_.chunks[c];
      kernels_.residuals(batches_, cameras_.data(), points_.data(), chunk, scratch.data());
      for (std::uint32_t g = chunk.first_group; g < chunk.end_group; ++g) {
        const Batches::Group& group = batches_.groups[g];
        const double* of = scratch.data() + 16 * (group.first_batch - chunk.first_batch);
        for (std::uint32_t row = 0; row < 2 * group.track; ++row)
          for (std::uint32_t l = 0; l < group.lanes; ++l) search.count(of[8 * row + l], mine);
      }
    }
  });
  return sum_of(counts);
}

std::uint64_t BundleSystem::count_behind() {
  const std::size_t slices = chunks_.slices.size() - 1;
  std::vector<std::uint64_t> counts(slices, 0);
  threads_.for_each(slices, [&](std::size_t s) {
    for (std::uint32_t c = chunks_.slices[s]; c < chunks_.slices[s + 1]; ++c)
      counts[s] +=
          kernels_.count_behind(batches_, cameras_.data(), points_.data(), chunks_.chunks[c]);
  });
  return std::accumulate(counts.begin(), counts.end(), std::uint64_t(0));
}

std::uint64_t BundleSystem::bytes() const {
  const auto size = [](const auto& v) { return v.size() * sizeof(v[0]); };
  std::uint64_t sum = batches_.image.bytes() + batches_.uniform.bytes() + batches_.xy.bytes() +
                      size(batches_.groups) + size(batches_.lane_point);
  sum += size(chunks_.pairs) + size(chunks_.diagonal) + size(chunks_.pair_runs) +
         size(chunks_.diagonal_runs) + size(chunks_.tiles);
  sum += cameras_.bytes() + trial_cameras_.bytes() + points_.bytes() + trial_points_.bytes() +
         factors_.bytes() + tiles_.bytes() + diagonal_.bytes();
  sum += weights_.bytes() + scratch_.size() * 8 * scratch_doubles(batches_, chunks_);
  if (passes_) sum += passes_->bytes();
  return sum + solver_->bytes() + (coarse_ ? coarse_->bytes() : 0);
}

}  // namespace sheaf
