// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// How a DistributedSystem comes to be: its pieces are read, agree on what they do and on who owns
// what.
#include <algorithm>
#include <cmath>
#include <utility>

#include "distributed/distributed_system.h"
#include "reduced/scaling.h"

namespace sheaf {
namespace {

/// What this home does not know, said before anything is read.
Result<void> can_solve(const SolveOptions& options) {
  const auto refuse = [](const std::string& what) {
    return Error(ErrorCode::usage, what + " on several machines");
  };
  if (options.trust_region == TrustRegion::dogleg) return refuse("the dogleg is not to be had");
  if (options.loss.kind != LossKind::none && !(options.loss.scale_px > 0))
    return refuse("a loss's scale that residuals decide is not to be had");
  if (options.solver != CameraSolverKind::automatic &&
      options.solver != CameraSolverKind::iterative &&
      options.solver != CameraSolverKind::iterative_implicit)
    return refuse("no camera solver but iterative-implicit is to be had");
  if (!options.checkpoint.empty() || !options.resume.empty())
    return refuse(
        "checkpoints are not to be had: the pieces of an earlier end can be gone on from");
  return {};
}

}  // namespace

Result<std::unique_ptr<DistributedSystem>> DistributedSystem::make(
    const Ranks& ranks, const std::filesystem::path& folder, const DistributedOptions& options,
    const Kernels& kernels, Threads& threads) {
  if (const Result<void> can = can_solve(options.solve); !can.ok()) return can.error();
  auto out = std::unique_ptr<DistributedSystem>(new DistributedSystem(ranks));
  if (const Result<void> done = out->load(folder, options, kernels, threads); !done.ok())
    return done.error();
  return out;
}

Result<void> DistributedSystem::load(const std::filesystem::path& folder,
                                     const DistributedOptions& options, const Kernels& kernels,
                                     Threads& threads) {
  Result<std::vector<ScenePiece>> files = read(folder);
  if (!files.ok()) return files.error();
  const ScenePiece& first = files.value()[0];
  images_ = first.scene_images;
  scene_points_ = first.scene_points;
  observations_ = first.scene_observations;
  const PieceRules rules = rules_for(files.value(), options);
  choice_ = rules.points;
  if (Result<void> made = make_pieces(std::move(files).value(), rules, kernels, threads);
      !made.ok())
    return made;
  floats_ = pieces_[0]->rounds();
  number_blocks();
  place_charts();
  return {};
}

/// Errors are everybody's: nobody waits for a rank that has left.
Result<std::vector<ScenePiece>> DistributedSystem::read(const std::filesystem::path& folder) const {
  std::string failed;
  std::vector<ScenePiece> files;
  for (std::uint32_t p = ranks_.first_piece(); p < ranks_.end_piece() && failed.empty(); ++p) {
    Result<ScenePiece> piece = read_piece(folder, p);
    if (!piece.ok())
      failed = piece.error().what();
    else if (piece.value().pieces != ranks_.pieces())
      failed = piece_path(folder, p).string() + ": found a piece of " +
               std::to_string(piece.value().pieces) + ", expected one of " +
               std::to_string(ranks_.pieces());
    else
      files.push_back(std::move(piece).value());
  }
  const std::string scene = ranks_.first_text(files.empty() ? "" : files[0].scene);
  for (const ScenePiece& piece : files)
    if (failed.empty() && piece.scene != scene)
      failed = piece_path(folder, piece.number).string() + ": is a piece of another scene";
  failed = ranks_.first_text(failed);
  if (!failed.empty()) return Error(ErrorCode::unreadable_input, failed);
  return files;
}

Result<void> DistributedSystem::make_pieces(std::vector<ScenePiece> files, const PieceRules& rules,
                                            const Kernels& kernels, Threads& threads) {
  std::string failed;
  ErrorCode code = ErrorCode::usage;
  for (ScenePiece& file : files) {
    auto piece = RankPiece::make(std::move(file), rules, kernels, threads);
    if (!piece.ok()) {
      failed = piece.error().what();
      code = piece.error().code();
      break;
    }
    pieces_.push_back(std::move(piece).value());
  }
  failed = ranks_.first_text(failed);
  if (!failed.empty()) return Error(code, failed);
  return {};
}

/// All pieces do as the whole scene asks for.
PieceRules DistributedSystem::rules_for(const std::vector<ScenePiece>& files,
                                        const DistributedOptions& options) {
  PieceRules out{options.solve, options.fixed, {}, false};
  ParallaxScratch scratch;
  std::vector<double> mine;
  bool shared = false;
  for (const ScenePiece& piece : files) {
    const double points = static_cast<double>(piece.point.size());
    mine.push_back(points * share_of_small_parallax(piece.problem, {}, kSmallParallax_px, scratch));
    mine.push_back(points);
    std::vector<char> used(piece.problem.cameras.size(), 0);
    for (const std::uint32_t c : piece.problem.image_camera) shared |= used[c]++ != 0;
  }
  const std::vector<double> sums = ranks_.sum(2, mine);
  if (asks_for_parallax(options.solve, out.points))
    choose_by_parallax(sums[1] > 0 ? sums[0] / sums[1] : 0, options.solve, out.points);
  out.lens_blocks = ranks_.any(shared);
  return out;
}

void DistributedSystem::number_blocks() {
  // Where lenses' own blocks stand is their owners' to say.
  std::vector<std::uint32_t> lenses, owned;
  std::vector<std::vector<Ghost>> ghost_lenses, ghosts;
  std::vector<double> places;
  for (auto& piece : pieces_) {
    const ScenePiece& file = piece->scene_piece();
    lenses.push_back(file.owned_cameras);
    owned.push_back(piece->num_owned());
    ghost_lenses.push_back(file.ghost_cameras);
    const std::vector<double> mine = piece->lens_places();
    places.insert(places.end(), mine.begin(), mine.end());
  }
  BlockExchange of_lenses(ranks_, lenses, ghost_lenses);
  std::vector<double> told(2 * of_lenses.ghosts());
  of_lenses.to_ghosts(2, places.data(), told.data());
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    const double* from = told.data() + 2 * of_lenses.first_ghost(p);
    pieces_[p]->place_ghosts({from, from + 2 * ghost_lenses[p].size()});
    ghosts.push_back(pieces_[p]->ghosts());
  }
  exchange_ = std::make_unique<BlockExchange>(ranks_, owned, ghosts);
  std::vector<std::size_t> begins;
  for (std::size_t p = 0; p <= pieces_.size(); ++p)
    begins.push_back(RankPiece::kWidth * exchange_->first_owned(p));
  krylov_ = std::make_unique<Krylov>(
      ranks_, begins, [this](const double* x, double* y) { multiply(x, y); },
      [this](const double* r, double* z) { precondition(r, z); });
  for (auto* v : {&rhs_, &owned_damping_, &step_}) v->assign(begins.back(), 0);
  for (auto* v : {&ghosts_, &shares_}) v->assign(RankPiece::kWidth * exchange_->ghosts(), 0);
  sums_.resize(pieces_.size());
  vectors_.resize(pieces_.size());
  for (auto& piece : pieces_)
    for (auto* v : {&damping_, &columns_, &out_}) v->push_back(piece->column_vector());
}

/// The frame of all images, piece by piece: scene_frame() of the scene but for the order of sums.
void DistributedSystem::place_charts() {
  const auto sum = [&](std::size_t width, const auto& add) {
    std::vector<double> mine(width * pieces_.size(), 0);
    for (std::size_t p = 0; p < pieces_.size(); ++p)
      for (std::size_t i = 0; i < pieces_[p]->scene_piece().owned_images; ++i)
        add(centre_of(pieces_[p]->points().state().held.cameras.poses[i]), &mine[width * p]);
    return ranks_.sum(width, mine);
  };
  SceneFrame frame;
  const auto count = static_cast<double>(images_);
  const std::vector<double> centres = sum(3, [](const auto& c, double* to) {
    for (std::size_t k = 0; k < 3; ++k) to[k] += c[k];
  });
  for (std::size_t k = 0; k < 3; ++k) frame.origin[k] = centres[k] / count;
  const double length = sum(1, [&](const auto& c, double* to) {
    *to += std::hypot(c[0] - frame.origin[0], c[1] - frame.origin[1], c[2] - frame.origin[2]);
  })[0];
  frame.unit = towards_one(length / count);
  for (auto& piece : pieces_) piece->points().place_charts(frame);
}

}  // namespace sheaf
