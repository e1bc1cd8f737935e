// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/build.h"

#include <string>
#include <utility>

#include "eliminate/kernel_table.h"
#include "platform/memory.h"
#include "scene/rigs.h"
#include "systems/bal_rows.h"
#include "systems/image_system.h"
#include "systems/lens_rows.h"
#include "systems/mapped_rows.h"
#include "systems/point_system.h"

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
    : options_(options), kernels_(&kernels), threads_(&threads) {}

Result<Build> Build::plan(const Problem& problem, const SolveOptions& options,
                          const std::vector<std::uint8_t>& skip, const Kernels& kernels,
                          Threads& threads) {
  Build build(options, kernels, threads);
  build.points_ = choose_points(problem, skip, options);
  build.options_.points = build.points_.points;
  if (BalView::serves(problem, options.fixed)) build.view_.emplace(problem, options.fixed);
  const Result<void> done =
      build.view_ ? build.plan_bal(problem, skip) : build.plan_lenses(problem, skip);
  if (!done.ok()) return done.error();
  return build;
}

Result<void> Build::plan_bal(const Problem& problem, const std::vector<std::uint8_t>& skip) {
  Columns columns = number_columns(problem, fixed_images(problem, options_.fixed), view_->held());
  const bool only_images = options_.fixed.points && !has_rigid_frames(problem.rigs) &&
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
  Batches batches = arrange(problem, skip, *threads_);
  view_->turn(problem, batches, *threads_);
  arranged_ = std::make_unique<Arrangement>();
  if (has_rigid_frames(problem.rigs))
    arranged_->map = map_rigs(problem, options_.fixed, columns, view_->turns());
  Clusters clusters;
  WorkCounts counts = count_work(batches, columns, arranged_->map ? &*arranged_->map : nullptr,
                                 held, clusters, *threads_);
  counts.weighted = options_.loss.kind != LossKind::none;
  counts.dogleg = options_.trust_region == TrustRegion::dogleg;
  lends_ = lends_observations(problem, batches, options_, *threads_);
  const std::uint64_t lent = lends_ ? LentObservations::bytes(problem, !view_->turns()) : 0;
  Result<Choice> choice = choose_solver(counts, options_, threads_->count(),
                                        {resident_bytes() - lent, peak_resident_bytes()});
  if (!choice.ok()) return choice.error();
  choice_ = std::move(choice).value();
  choice_.plan.clusters = std::move(clusters);
  arranged_->batches = std::move(batches);
  arranged_->columns = std::move(columns);
  return {};
}

Result<void> Build::plan_lenses(const Problem& problem, const std::vector<std::uint8_t>& skip) {
  Result<Arrangement> arranged = arrange_with_lenses(problem, options_.fixed, skip, *threads_);
  if (!arranged.ok()) return arranged.error();
  arranged_ = std::make_unique<Arrangement>(std::move(arranged).value());
  Result<LensChoice> chosen = choose_for_lenses(*arranged_, options_, *threads_);
  if (!chosen.ok()) return chosen.error();
  choice_ = std::move(chosen.value().choice);
  arranged_->lists = std::move(chosen.value().chunks);
  return {};
}

void Build::lend(Problem& problem, std::optional<LentObservations>& lent) const {
  lent.emplace(problem, arranged_->batches, *threads_, !view_->turns());
}

CameraState Build::cameras(const Problem& problem) const {
  return view_ ? view_->cameras(problem) : camera_state(problem);
}

std::unique_ptr<Home> Build::make_home(const Problem& problem) {
  const Kernels& kernels = *kernels_;
  if (by_image_)
    return std::make_unique<ImageSystem>(cameras(problem), problem.image_camera,
                                         std::move(*by_image_), arranged_->columns,
                                         watches_behind(), image_kernels(kernels.name), *threads_);
  const PointRules rules{options_.fixed.points, watches_behind(), options_.inner_iterations,
                         chart_base(options_.points), points_.crosses};
  if (view_) cut_bal_lists(choice_.plan.kind, rules.held, *threads_, *arranged_);
  const Columns& columns = arranged_->columns;
  CameraColumns camera_columns = view_ ? CameraColumns::of_bal(columns, problem.image_camera)
                                       : CameraColumns::of_lenses(columns, arranged_->tracks);
  std::unique_ptr<PointRows> rows;
  if (view_)
    rows = std::make_unique<BalRows>(*arranged_, problem.image_camera, kernels, *threads_);
  else
    rows = std::make_unique<LensRows>(*arranged_, kernels, *threads_);
  if (arranged_->map) {
    const SolverKind kind = choice_.plan.kind;
    const bool forms = kind != SolverKind::implicit_cg && kind != SolverKind::blocks;
    rows =
        std::make_unique<MappedRows>(std::move(rows), columns, *arranged_->map, forms, *threads_);
    camera_columns = camera_columns.through(*arranged_->map, problem.rigs);
  }
  return std::make_unique<PointSystem>(
      std::move(rows),
      PointSystem::Start{cameras(problem), std::move(camera_columns), &problem.points},
      PointSystem::Numbering{&arranged_->solved_columns(), &arranged_->solved_coarse_columns()},
      rules, choice_.plan, kernels, *threads_);
}

void Build::store(const Home& home, Problem& problem) const {
  if (view_)
    view_->store(home.cameras(), problem);
  else
    sheaf::store(home.cameras(), problem);
  home.store_points(problem.points);
  follow_images(problem);
  place_images(problem);
}

}  // namespace sheaf
