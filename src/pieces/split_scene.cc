// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "pieces/split_scene.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "pieces/piece_fields.h"
#include "scene/rigs.h"
#include "solve/checkpoint_file.h"

namespace sheaf {
namespace {

constexpr std::uint32_t kNowhere = std::numeric_limits<std::uint32_t>::max();

Result<void> can_split(const Problem& problem) {
  if (has_rigid_frames(problem.rigs))
    return Error(ErrorCode::usage,
                 "the scene has rigs, whose images may lie in several pieces: "
                 "scenes with rigs are not split yet");
  if (!problem.terms.empty())
    return Error(ErrorCode::usage,
                 "the scene has priors or other terms beside its observations: "
                 "such scenes are not split yet");
  return {};
}

/// Who owns what, and the numbers of what is owned within its owner.
struct Owners {
  std::vector<std::uint32_t> of_image, of_camera, of_point;
  std::vector<std::uint32_t> image_index, camera_index;
  std::vector<std::vector<std::uint32_t>> images, cameras, points;  ///< of each piece
  std::vector<std::vector<std::uint64_t>> observations;
  std::vector<std::uint32_t> camera_uses;
  std::vector<std::vector<std::uint32_t>> users;  ///< two images of each lens at most
};

/// A point belongs where most of the images that see it do; of several such pieces, to the one that
/// has the fewest observations so far.
void deal_points(const Problem& problem, std::uint32_t pieces, Owners& to) {
  std::vector<std::uint64_t> first(problem.num_points() + 1, 0);
  for (const std::uint32_t p : problem.observation_point) ++first[p + 1];
  for (std::size_t p = 0; p < problem.num_points(); ++p) first[p + 1] += first[p];
  std::vector<std::uint32_t> seen(problem.num_observations());
  std::vector<std::uint64_t> next(first.begin(), first.end() - 1);
  for (std::size_t i = 0; i < seen.size(); ++i)
    seen[next[problem.observation_point[i]]++] = to.of_image[problem.observation_image[i]];
  std::vector<std::uint32_t> count(pieces, 0);
  std::vector<std::uint64_t> load(pieces, 0);
  to.of_point.assign(problem.num_points(), 0);
  for (std::uint32_t p = 0; p < problem.num_points(); ++p) {
    std::uint32_t best = p % pieces, most = 0;  // one that nobody sees goes anywhere
    for (std::uint64_t k = first[p]; k < first[p + 1]; ++k) most = std::max(most, ++count[seen[k]]);
    for (std::uint64_t k = first[p], found = 0; k < first[p + 1]; ++k) {
      const std::uint32_t piece = seen[k];
      if (std::exchange(count[piece], 0) != most) continue;
      if (found++ == 0 || load[piece] < load[best]) best = piece;
    }
    load[best] += first[p + 1] - first[p];
    to.of_point[p] = best;
    to.points[best].push_back(p);
  }
  for (std::uint64_t i = 0; i < problem.num_observations(); ++i)
    to.observations[to.of_point[problem.observation_point[i]]].push_back(i);
}

Owners owners_of(const Problem& problem, const std::vector<std::uint32_t>& piece_of_image,
                 std::uint32_t pieces) {
  Owners out;
  out.of_image = piece_of_image;
  out.images.resize(pieces);
  out.cameras.resize(pieces);
  out.points.resize(pieces);
  out.observations.resize(pieces);
  out.of_camera.assign(problem.cameras.size(), kNowhere);
  out.camera_uses.assign(problem.cameras.size(), 0);
  out.users.resize(problem.cameras.size());
  for (std::uint32_t i = 0; i < problem.num_images(); ++i) {
    out.image_index.push_back(static_cast<std::uint32_t>(out.images[piece_of_image[i]].size()));
    out.images[piece_of_image[i]].push_back(i);
    const std::uint32_t camera = problem.image_camera[i];
    out.of_camera[camera] = std::min(out.of_camera[camera], piece_of_image[i]);
    ++out.camera_uses[camera];
    if (out.users[camera].size() < 2) out.users[camera].push_back(i);
  }
  for (std::uint32_t c = 0; c < problem.cameras.size(); ++c) {
    if (out.of_camera[c] == kNowhere) out.of_camera[c] = 0;  // no image has it
    out.camera_index.push_back(static_cast<std::uint32_t>(out.cameras[out.of_camera[c]].size()));
    out.cameras[out.of_camera[c]].push_back(c);
  }
  deal_points(problem, pieces, out);
  return out;
}

/// Makes one piece after the other; `local_` is cleared by what was set.
class Cutter {
 public:
  Cutter(const Problem& problem, const Owners& owners, std::uint32_t pieces, std::string scene)
      : problem_(problem),
        owners_(owners),
        pieces_(pieces),
        scene_(std::move(scene)),
        local_image_(problem.num_images(), kNowhere),
        local_camera_(problem.cameras.size(), kNowhere),
        local_point_(problem.num_points(), kNowhere) {}

  ScenePiece cut(std::uint32_t number) {
    ScenePiece out;
    out.number = number;
    out.pieces = pieces_;
    out.scene = scene_;
    out.scene_images = problem_.num_images();
    out.scene_points = problem_.num_points();
    out.scene_observations = problem_.num_observations();
    number_images(out);
    number_cameras(out);
    fill(out);
    for (const std::uint32_t i : out.image) local_image_[i] = kNowhere;
    for (const std::uint32_t c : out.camera) local_camera_[c] = kNowhere;
    for (const std::uint32_t p : out.point) local_point_[p] = kNowhere;
    return out;
  }

 private:
  void number_images(ScenePiece& out) {
    out.image = owners_.images[out.number];
    out.owned_images = static_cast<std::uint32_t>(out.image.size());
    std::vector<std::uint32_t> ghosts;
    for (std::uint32_t i = 0; i < out.owned_images; ++i) local_image_[out.image[i]] = i;
    const auto add = [&](std::uint32_t image) {
      if (local_image_[image] != kNowhere) return;
      local_image_[image] = 0;
      ghosts.push_back(image);
    };
    for (const std::uint64_t i : owners_.observations[out.number])
      add(problem_.observation_image[i]);
    // A lens that several images share must look so in each piece that has it.
    std::vector<std::uint32_t> lenses;
    for (const auto* images : {&out.image, &ghosts})
      for (const std::uint32_t i : *images) lenses.push_back(problem_.image_camera[i]);
    for (const std::uint32_t c : owners_.cameras[out.number]) lenses.push_back(c);
    for (const std::uint32_t c : lenses)
      for (const std::uint32_t user : owners_.users[c]) add(user);
    std::sort(ghosts.begin(), ghosts.end());
    for (const std::uint32_t i : ghosts) {
      local_image_[i] = static_cast<std::uint32_t>(out.image.size());
      out.image.push_back(i);
      out.ghost_images.push_back({owners_.of_image[i], owners_.image_index[i]});
    }
  }

  void number_cameras(ScenePiece& out) {
    out.camera = owners_.cameras[out.number];
    out.owned_cameras = static_cast<std::uint32_t>(out.camera.size());
    for (std::uint32_t c = 0; c < out.owned_cameras; ++c) local_camera_[out.camera[c]] = c;
    for (const std::uint32_t i : out.image) {
      const std::uint32_t c = problem_.image_camera[i];
      if (local_camera_[c] != kNowhere) continue;
      local_camera_[c] = static_cast<std::uint32_t>(out.camera.size());
      out.camera.push_back(c);
      out.ghost_cameras.push_back({owners_.of_camera[c], owners_.camera_index[c]});
    }
  }

  void fill(ScenePiece& out) {
    Problem& to = out.problem;
    for (const std::uint32_t c : out.camera) to.cameras.push_back(problem_.cameras[c]);
    for (const std::uint32_t i : out.image) {
      to.poses.push_back(problem_.poses[i]);
      to.image_camera.push_back(local_camera_[problem_.image_camera[i]]);
    }
    out.point = owners_.points[out.number];
    for (std::uint32_t p = 0; p < out.point.size(); ++p) {
      local_point_[out.point[p]] = p;
      const double* X = &problem_.points[3 * std::size_t(out.point[p])];
      to.points.insert(to.points.end(), X, X + 3);
    }
    for (const std::uint64_t i : owners_.observations[out.number]) {
      const double* xy = &problem_.observation_xy[2 * i];
      to.add_observation(local_image_[problem_.observation_image[i]],
                         local_point_[problem_.observation_point[i]], xy[0], xy[1]);
      if (!problem_.observation_sigma.empty())
        to.observation_sigma.push_back(problem_.observation_sigma[i]);
    }
  }

  const Problem& problem_;
  const Owners& owners_;
  const std::uint32_t pieces_;
  const std::string scene_;
  std::vector<std::uint32_t> local_image_, local_camera_, local_point_;
};

}  // namespace

std::string digest_of_scene(const Problem& problem) {
  ArchiveWriter a;
  std::uint64_t images = problem.num_images(), points = problem.num_points();
  a(images, points, problem.image_camera, problem.observation_image, problem.observation_point,
    problem.observation_xy, problem.observation_sigma);
  return digest_of(a.bytes());
}

Result<SplitSummary> split_scene(const Problem& problem,
                                 const std::vector<std::uint32_t>& piece_of_image,
                                 std::uint32_t pieces,
                                 const std::function<Result<void>(ScenePiece)>& take) {
  if (const Result<void> can = can_split(problem); !can.ok()) return can.error();
  const Owners owners = owners_of(problem, piece_of_image, pieces);
  Cutter cutter(problem, owners, pieces, digest_of_scene(problem));
  SplitSummary out;
  std::uint64_t most = 0;
  for (std::uint32_t k = 0; k < pieces; ++k) {
    ScenePiece piece = cutter.cut(k);
    const std::uint64_t observations = piece.problem.num_observations();
    out.pieces.push_back(
        {piece.owned_images, piece.ghost_images.size(), piece.point.size(), observations});
    most = std::max(most, observations);
    if (const Result<void> taken = take(std::move(piece)); !taken.ok()) return taken.error();
  }
  if (problem.num_observations() > 0)
    out.imbalance = static_cast<double>(most) * pieces / double(problem.num_observations());
  return out;
}

Result<void> join_piece(const ScenePiece& piece, Problem& scene) {
  if (piece.scene_images != scene.num_images() || piece.scene_points != scene.num_points() ||
      piece.scene_observations != scene.num_observations())
    return Error(ErrorCode::usage, "piece " + std::to_string(piece.number) + " is of a scene of " +
                                       std::to_string(piece.scene_images) + " images, " +
                                       std::to_string(piece.scene_points) + " points and " +
                                       std::to_string(piece.scene_observations) +
                                       " observations, not of this one");
  for (std::uint32_t i = 0; i < piece.owned_images; ++i)
    scene.poses[piece.image[i]] = piece.problem.poses[i];
  for (std::uint32_t c = 0; c < piece.owned_cameras; ++c)
    scene.cameras[piece.camera[c]].parameters = piece.problem.cameras[c].parameters;
  for (std::size_t p = 0; p < piece.point.size(); ++p)
    std::copy_n(&piece.problem.points[3 * p], 3, &scene.points[3 * std::size_t(piece.point[p])]);
  return {};
}

}  // namespace sheaf
