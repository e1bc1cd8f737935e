// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/build.h"

#include <algorithm>
#include <string>
#include <utility>

#include "eliminate/kernel_table.h"
#include "platform/cancel.h"
#include "platform/memory.h"
#include "scene/rigs.h"
#include "scene/terms.h"
#include "systems/bal_rows.h"
#include "systems/image_system.h"
#include "systems/lens_rows.h"
#include "systems/mapped_rows.h"
#include "systems/point_system.h"
#include "systems/term_rows.h"

namespace sheaf {
namespace {

const char* simd_name(Simd simd) {
  switch (simd) {
    case Simd::scalar:
      return "scalar";
    case Simd::sse4:
      return "sse4";
    case Simd::avx2:
      return "avx2";
    case Simd::avx512:
      return "avx512";
    case Simd::neon:
      return "neon";
    case Simd::best:
      break;
  }
  return "";
}

ChartBase chart_base(PointParametrisation points) {
  switch (points) {
    case PointParametrisation::automatic:  // Build::plan has chosen
    case PointParametrisation::xyz:
      return ChartBase::none;
    case PointParametrisation::homogeneous:
      return ChartBase::origin;
    case PointParametrisation::inverse_depth:
      return ChartBase::host;
  }
  return ChartBase::none;
}

/// `skip`, and what the terms have of the kept points.
std::vector<std::uint8_t> skipped(const Problem& problem, const std::vector<std::uint8_t>& skip,
                                  const std::vector<std::uint32_t>& kept) {
  if (kept.empty()) return skip;
  std::vector<std::uint8_t> out = skip;
  out.resize(problem.num_observations(), 0);
  for (std::size_t i = 0; i < out.size(); ++i)
    if (std::binary_search(kept.begin(), kept.end(), problem.observation_point[i])) out[i] = 1;
  return out;
}

/// Kept points go with the images that see them.
void join_kept(const Problem& problem, const std::vector<std::uint32_t>& kept, const BlockMap& map,
               Clusters& clusters) {
  if (clusters.count == 0) return;
  std::vector<std::int32_t> of_kept(kept.size(), Clusters::kNone);
  for (std::size_t i = 0; i < problem.num_observations() && !kept.empty(); ++i) {
    const auto at = std::lower_bound(kept.begin(), kept.end(), problem.observation_point[i]);
    if (at == kept.end() || *at != problem.observation_point[i]) continue;
    std::int32_t& cluster = of_kept[static_cast<std::size_t>(at - kept.begin())];
    if (cluster == Clusters::kNone) cluster = clusters.of_row_image[problem.observation_image[i]];
  }
  clusters.of_image.resize(map.columns.num_images(), Clusters::kNone);
  clusters.of_row_image.resize(map.row_blocks(), Clusters::kNone);
  for (std::size_t j = 0; j < kept.size(); ++j) {
    clusters.of_image[map.first_kept + j] = of_kept[j];
    clusters.of_row_image[map.row_blocks() - kept.size() + j] = of_kept[j];
  }
}

/// Whether terms are of states that BAL's view would restate.
bool restates_terms(const Problem& problem) {
  return (!problem.terms.gaussians.empty() || !problem.terms.parameters.empty() ||
          !problem.terms.bounds.empty()) &&
         !has_only_bal_cameras(problem);
}

/// A few hundred megabytes are worth a pass over the observations at the end.
bool lends_observations(const Problem& problem, const Batches& batches, const SolveOptions& options,
                        Threads& threads) {
  constexpr std::size_t kWorthLending = 4000000;
  return options.lend_observations && problem.num_observations() >= kWorthLending &&
         LentObservations::possible(problem, batches, threads);
}

}  // namespace

Result<const Kernels*> choose_kernels(Simd simd) {
  const auto available = available_kernels();
  if (simd == Simd::best) return available.front();
  std::string names;
  for (const Kernels* kernels : available) {
    if (std::string(kernels->name) == simd_name(simd)) return kernels;
    names += std::string(names.empty() ? "" : ", ") + kernels->name;
  }
  return Error(ErrorCode::usage, std::string("this machine cannot run the instruction set ") +
                                     simd_name(simd) + "; it can run: " + names);
}

Build::Build(const SolveOptions& options, const Kernels& kernels, Threads& threads)
    : options_(options), asked_points_(options.points), kernels_(&kernels), threads_(&threads) {}

Result<Build> Build::plan(const Problem& problem, const SolveOptions& options,
                          const std::vector<std::uint8_t>& skip, const Kernels& kernels,
                          Threads& threads, bool lens_blocks) {
  Build build(options, kernels, threads);
  build.points_ = choose_points(problem, skip, options);
  build.options_.points = build.points_.points;
  build.skips_ = !skip.empty();
  build.kept_ = kept_points(problem.terms);
  if (!lens_blocks && BalView::serves(problem, options.fixed) && !restates_terms(problem))
    build.view_.emplace(problem, options.fixed);
  const Result<void> done =
      build.view_ ? build.plan_bal(problem, skip) : build.plan_lenses(problem, skip);
  if (!done.ok()) return done.error();
  return build;
}

Result<void> Build::plan_bal(const Problem& problem, const std::vector<std::uint8_t>& skip) {
  Columns columns = number_columns(problem, fixed_images(problem, options_.fixed), view_->held());
  const bool only_images = options_.fixed.points && !has_rigid_frames(problem.rigs) &&
                           problem.observation_sigma.empty() && problem.terms.empty() &&
                           !columns.lens_shared && options_.trust_region == TrustRegion::lm &&
                           options_.solver == CameraSolverKind::automatic;
  return only_images ? plan_images(problem, skip, std::move(columns))
                     : plan_points(problem, skip, std::move(columns));
}

/// Images by themselves.
Result<void> Build::plan_images(const Problem& problem, const std::vector<std::uint8_t>& skip,
                                Columns columns) {
  Result<Choice> choice = choose_for_images(columns, count_image_batches(problem), options_,
                                            {resident_bytes(), peak_resident_bytes()});
  if (!choice.ok()) return choice.error();
  choice_ = std::move(choice).value();
  by_image_ = arrange_by_image(problem, skip);
  view_->turn(problem, *by_image_, *threads_);
  arranged_ = std::make_unique<Arrangement>();
  arranged_->columns = std::move(columns);
  return {};
}

Result<void> Build::plan_points(const Problem& problem, const std::vector<std::uint8_t>& skip,
                                Columns columns) {
  const bool held = options_.fixed.points;
  Batches batches = arrange(problem, skipped(problem, skip, kept_), *threads_);
  view_->turn(problem, batches, *threads_);
  poll_cancelled();
  arranged_ = std::make_unique<Arrangement>();
  arranged_->columns = columns;
  map_blocks_of(problem, skip);
  Clusters clusters;
  WorkCounts counts = count_work(batches, columns, arranged_->map ? &*arranged_->map : nullptr,
                                 held, clusters, *threads_);
  counts.weighted = options_.loss.kind != LossKind::none || batches.weighted();
  counts.dogleg = options_.trust_region == TrustRegion::dogleg;
  lends_ = lends_observations(problem, batches, options_, *threads_);
  const std::uint64_t lent = lends_ ? LentObservations::bytes(problem, !view_->turns()) : 0;
  Result<Choice> choice = choose_solver(counts, options_, threads_->count(),
                                        {resident_bytes() - lent, peak_resident_bytes()});
  if (!choice.ok()) return choice.error();
  choice_ = std::move(choice).value();
  choice_.plan.clusters = std::move(clusters);
  if (arranged_->map) join_kept(problem, kept_, *arranged_->map, choice_.plan.clusters);
  arranged_->batches = std::move(batches);
  return {};
}

Result<void> Build::plan_lenses(const Problem& problem, const std::vector<std::uint8_t>& skip) {
  Result<Arrangement> arranged =
      arrange_with_lenses(problem, options_.fixed, skipped(problem, skip, kept_), *threads_);
  if (!arranged.ok()) return arranged.error();
  arranged_ = std::make_unique<Arrangement>(std::move(arranged).value());
  map_blocks_of(problem, skip);
  Result<LensChoice> chosen = choose_for_lenses(*arranged_, options_, *threads_);
  if (!chosen.ok()) return chosen.error();
  choice_ = std::move(chosen.value().choice);
  arranged_->lists = std::move(chosen.value().chunks);
  if (arranged_->map) join_kept(problem, kept_, *arranged_->map, choice_.plan.clusters);
  return {};
}

void Build::lend(Problem& problem, std::optional<LentObservations>& lent) const {
  lent.emplace(problem, arranged_->batches, *threads_, !view_->turns());
}

void Build::map_blocks_of(const Problem& problem, const std::vector<std::uint8_t>& skip) {
  if (!has_rigid_frames(problem.rigs) && problem.terms.empty()) return;
  Arrangement& to = *arranged_;
  const TermPlaces places = view_ ? TermPlaces::of_bal(problem) : TermPlaces::of_lenses(to.tracks);
  terms_ = make_terms(problem, places, kept_, skip, view_ ? &*view_ : nullptr);
  const auto kept = static_cast<std::uint32_t>(kept_.size());
  to.row_columns = with_kept_points(to.columns, kept, options_.fixed.points);
  to.map = map_blocks(problem, options_.fixed, to.row_columns, kept, view_ && view_->turns());
  to.map->term_tiles = tiles_of(terms_);
}

void Build::cameras(const Problem& problem, CameraState& out) const {
  if (view_)
    view_->cameras(problem, out);
  else
    camera_state(problem, out);
  for (const std::uint32_t point : kept_) {
    const double* X = &problem.points[3 * std::size_t(point)];
    out.kept.push_back({X[0], X[1], X[2]});
  }
}

bool Build::fits(const CameraState& held, const Problem& problem) const {
  CameraState own;
  cameras(problem, own);
  return held.poses.size() == own.poses.size() && held.sets.size() == own.sets.size() &&
         held.sensors.size() == own.sensors.size() && held.frames.size() == own.frames.size() &&
         held.kept.size() == own.kept.size();
}

std::unique_ptr<Home> Build::make_home(const Problem& problem, const CameraState* held) {
  if (by_image_) {
    CameraState start;
    if (held != nullptr)
      start = *held;
    else
      cameras(problem, start);
    return std::make_unique<ImageSystem>(
        std::move(start), problem.image_camera, std::move(*by_image_), arranged_->columns,
        watches_behind(), image_kernels(kernels_->name), *threads_);
  }
  Parts parts = make_parts(problem, held);
  return std::make_unique<PointSystem>(
      std::move(parts.rows),
      PointSystem::Start{std::move(parts.cameras), std::move(parts.camera_columns),
                         &problem.points},
      PointSystem::Numbering{parts.columns, &arranged_->solved_coarse_columns()}, parts.rules,
      choice_.plan, *kernels_, *threads_);
}

Build::Parts Build::make_parts(const Problem& problem, const CameraState* held) {
  const Kernels& kernels = *kernels_;
  Parts out;
  if (held != nullptr)
    out.cameras = *held;
  else
    cameras(problem, out.cameras);
  out.rules = {options_.fixed.points, watches_behind(), options_.inner_iterations,
               chart_base(options_.points), points_.crosses};
  if (view_) cut_bal_lists(choice_.plan.kind, out.rules.held, *threads_, *arranged_);
  poll_cancelled();
  const Columns& columns = arranged_->columns;
  out.camera_columns = view_ ? CameraColumns::of_bal(columns, problem.image_camera)
                             : CameraColumns::of_lenses(columns, arranged_->tracks);
  out.camera_columns.keep_within(problem.terms.bounds);
  if (view_)
    out.rows = std::make_unique<BalRows>(*arranged_, problem.image_camera, kernels, *threads_);
  else
    out.rows = std::make_unique<LensRows>(*arranged_, kernels, *threads_);
  if (arranged_->map) {
    const SolverKind kind = choice_.plan.kind;
    const bool forms = kind != SolverKind::implicit_cg && kind != SolverKind::blocks;
    const std::size_t kept = kept_.size(), first_kept = columns.num_images();
    if (!terms_.empty())
      out.rows = std::make_unique<TermRows>(std::move(out.rows), std::move(terms_), columns, kept);
    out.rows = std::make_unique<MappedRows>(std::move(out.rows), arranged_->row_columns,
                                            *arranged_->map, forms, kernels.name, *threads_);
    out.camera_columns.add_kept(arranged_->row_columns, first_kept, kept);
    out.camera_columns = out.camera_columns.through(*arranged_->map, problem.rigs);
  }
  out.columns = &arranged_->solved_columns();
  return out;
}

void Build::store(const CameraState& cameras, Problem& problem) const {
  if (view_)
    view_->store(cameras, problem);
  else
    sheaf::store(cameras, problem);
}

void Build::store(const Home& home, Problem& problem) const {
  store(home.cameras(), problem);
  home.store_points(problem.points);
  for (std::size_t j = 0; j < kept_.size(); ++j)
    std::copy(home.cameras().kept[j].begin(), home.cameras().kept[j].end(),
              &problem.points[3 * std::size_t(kept_[j])]);
  follow_images(problem);
  place_images(problem);
}

void Build::stay(const Problem& problem) {
  constexpr std::size_t kWords = 128;
  for (PointChoice* choice : {&points_, &new_points_}) choice->reason.reserve(kWords);
  refill_ = Refill(problem, {}, arranged_->batches, *threads_);
  cameras(problem, start_);
  options_.points = asked_points_;
  choose_points(problem, {}, options_, parallax_, new_points_);
  options_.points = points_.points;
}

bool Build::restart(const Problem& problem, Home& home) {
  options_.points = asked_points_;
  choose_points(problem, {}, options_, parallax_, new_points_);
  options_.points = points_.points;
  if (new_points_.points != points_.points || new_points_.crosses != points_.crosses) return false;
  points_.reason = new_points_.reason;
  refill_.fill(problem, *threads_, arranged_->batches);
  if (view_) {
    view_->renew(problem);
    view_->turn(problem, arranged_->batches, *threads_);
  }
  cameras(problem, start_);
  return home.restart(start_, problem.points);
}

}  // namespace sheaf
