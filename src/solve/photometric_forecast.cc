// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/photometric_forecast.h"

#include <algorithm>
#include <bit>
#include <map>
#include <set>
#include <vector>

#include "lists/chunks.h"
#include "platform/pages.h"
#include "solve/patch_anchor.h"
#include "solve/patch_level.h"
#include "systems/forecast.h"
#include "systems/photometric_system.h"

namespace sheaf {
namespace {

constexpr std::size_t kSampledPoints = 2000;

/// Images of which nothing but their sizes is known: enough to tell what is seen.
PatchScene bare_scene(const PhotometricProblem& problem, const PhotometricOptions& options,
                      const Pattern& pattern) {
  PatchScene scene;
  scene.camera = problem.camera;
  for (const GreyImage& image : problem.images)
    scene.planes.push_back(GreyPlane::frame(image.width, image.height));
  scene.grid = make_grid(pattern);
  if (!uses_rays(problem, options)) return scene;
  scene.host = problem.host;
  scene.rays = rays_of(problem);
  scene.warped = options.warp != Warp::translation;
  return scene;
}

struct Counts {
  std::uint64_t sights = 0;   ///< patches that are seen
  std::uint64_t checked = 0;  ///< patches that could be
  std::uint64_t image_tiles = 0;
  WorkCounts work;
};

/// Of the points that were looked at: how many are seen how often, and what their images couple.
struct Sample {
  std::map<std::uint32_t, std::uint64_t> tracks;
  std::set<std::pair<std::uint32_t, std::uint32_t>> blocks;
  std::set<std::pair<std::uint64_t, std::uint64_t>> tiles, image_tiles;
  std::uint64_t points = 0;
  std::uint64_t checked = 0;  ///< patches of all points

  void add(const std::vector<std::uint32_t>& images, std::uint32_t host, bool rays) {
    ++points;
    if (images.empty()) return;
    ++tracks[static_cast<std::uint32_t>(images.size())];
    const auto block = [&](std::uint32_t image) {
      return std::uint64_t(image) << 32 | (rays ? host : 0);
    };
    for (std::size_t a = 0; a < images.size(); ++a) {
      blocks.insert({images[a], rays ? host : 0});
      if (rays) image_tiles.insert(std::minmax<std::uint64_t>(images[a], host));
      for (std::size_t b = 0; b < a; ++b) {
        tiles.insert({block(images[a]), block(images[b])});
        image_tiles.insert(std::minmax<std::uint64_t>(images[a], images[b]));
      }
    }
  }
};

Sample sample_of(const PhotometricProblem& problem, const PhotometricOptions& options,
                 const Pattern& pattern) {
  const bool rays = uses_rays(problem, options);
  const PatchScene scene = bare_scene(problem, options, pattern);
  const PatchState state = state_of(problem, rays);
  Sample sample;
  const std::vector<Sight> all = all_sights(problem, rays);
  std::vector<std::uint32_t> images;
  for (std::size_t i = 0; i < problem.num_points();
       i += problem.num_points() / kSampledPoints + 1) {
    images.clear();
    const auto first =
        std::partition_point(all.begin(), all.end(), [&](const Sight& s) { return s.point < i; });
    for (auto sight = first; sight != all.end() && sight->point == i; ++sight)
      if (options.leaving == Leaving::free || is_seen(scene, state, *sight))
        images.push_back(sight->image);
    sample.add(images, rays ? problem.host[i] : 0, rays);
  }
  sample.checked = all.size();
  return sample;
}

Counts count(const PhotometricProblem& problem, const PhotometricOptions& options,
             const Pattern& pattern) {
  const Sample sample = sample_of(problem, options, pattern);
  const bool rays = uses_rays(problem, options);
  const std::uint64_t images = problem.images.size(), points = problem.num_points();
  const double each = static_cast<double>(points) / static_cast<double>(sample.points);
  Counts c;
  c.checked = sample.checked;
  WorkCounts& w = c.work;
  for (const auto& [track, sampled] : sample.tracks) {
    const auto seen = static_cast<std::uint64_t>(static_cast<double>(sampled) * each + 0.5);
    const std::uint64_t groups = (seen + 7) / 8;
    w.groups += groups;
    w.batches += groups * track;
    w.observations += seen * track;
    w.pairs += seen * track * (track - 1) / 2;
    w.longest_track = track;
  }
  c.sights = w.observations;
  w.images = rays ? sample.blocks.size() : images;
  w.columns = images * ((options.fix_poses ? 0u : 6u) + (options.affine_brightness ? 2u : 0u));
  w.tiles = std::min<std::uint64_t>(w.pairs, sample.tiles.size());
  w.pair_runs = std::min(w.pairs, w.tiles * (1 + w.batches / PixelRows::kBatchesPerChunk));
  w.sparse_doubles = w.columns * (w.columns + 1) / 2;
  c.image_tiles = rays ? sample.image_tiles.size() : 0;
  return c;
}

/// What one level reads: images, and what is kept of the points.
struct SceneBytes {
  std::uint64_t planes = 0, points = 0;
  std::uint64_t all() const { return planes + points; }
};

SceneBytes scene_bytes(const PhotometricProblem& problem, const PhotometricOptions& options,
                       const Pattern& pattern) {
  const std::uint64_t points = problem.num_points();
  SceneBytes bytes;
  bytes.points = points * 4 * make_grid(pattern).cells();
  if (uses_rays(problem, options)) bytes.points += 28 * points;
  for (const GreyImage& image : problem.images)
    bytes.planes += GreyPlane::bytes(image.width, image.height);
  return bytes;
}

/// stored: some points' rows are not those of one patch for each observation.
std::uint64_t system_bytes(const Counts& c, const PhotometricOptions& options, bool stored,
                           int threads) {
  const SolverKind kind =
      PhotometricSystem::kind_of(options.solver, static_cast<std::int32_t>(c.work.columns));
  std::uint64_t bytes = forecast_bytes(c.work, {kind, ""}, threads);
  const auto add = [&](std::uint64_t doubles, std::uint64_t copies = 1) {
    bytes += copies * resident_bytes_of(8 * doubles);
  };
  add((stored ? kRowBatch : patch_factors(options.affine_brightness)) * c.work.batches, 2);
  if (options.affine_brightness) add(kBrightnessBatch * c.work.batches, 2);
  add(16 * c.work.batches, 2);                                     // where patches are
  add(16 * c.work.batches, 2);                                     // what patches cost
  if (options.leaving != Leaving::free) add(16 * c.work.batches);  // what leaving costs
  add(kPointGroup * c.work.groups);                                // rays
  add(8 * c.work.groups);                                          // points' own damping
  add(16 * c.work.batches);                                        // what batches hold
  add(4 * c.work.batches);
  add(kTileDoubles * c.image_tiles);
  return bytes + 24 * c.sights;  // the list that these are arranged from
}

}  // namespace

std::uint64_t forecast_photometric(const PhotometricProblem& problem,
                                   const PhotometricOptions& options, const Pattern& pattern,
                                   int threads) {
  const Counts c = count(problem, options, pattern);
  const SceneBytes scene = scene_bytes(problem, options, pattern);
  const bool stored =
      options.rows == PatchRows::exact || !measurements_of(problem, options).empty();
  const std::uint64_t pixels = pattern.size() * c.sights, residuals = 8 * pixels;
  const std::uint64_t list = 8 * c.sights;
  // The finest level as it is refined and as it is judged, of the same images, and a coarser one.
  const std::uint64_t scenes =
      scene.all() + scene.points + (options.levels > 1 ? scene.all() / 2 : 0);
  std::uint64_t system = system_bytes(c, options, stored, threads);
  if (options.loss.kind != LossKind::none && options.loss.scale_px == kAutomaticScale) {
    // With poses and points held, beside a list of all residuals that doubles as it grows.
    Counts held = c;
    held.work.pairs = held.work.tiles = held.work.pair_runs = 0;
    system =
        std::max(system, system_bytes(held, options, stored, threads) + 8 * std::bit_ceil(pixels));
  }
  const std::uint64_t refining = scenes + residuals + 8 * c.checked + 3 * list + system;
  // The heap keeps the room of one list while another is made.
  const std::uint64_t looking = scene.all() + 4 * residuals + 5 * list;
  return std::max(refining, looking);
}

}  // namespace sheaf
