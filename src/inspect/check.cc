// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/check.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "geometry/camera_model.h"
#include "inspect/clean.h"
#include "inspect/lens_findings.h"
#include "inspect/lens_reach.h"
#include "inspect/rig_findings.h"
#include "inspect/statistics.h"
#include "io/rotation_norms.h"
#include "platform/parallel.h"
#include "scene/camera_plane.h"
#include "scene/point_errors.h"
#include "scene/rigs.h"

namespace sheaf {
namespace {

constexpr std::uint32_t kFewPoints = 10;  ///< of an image: 6 unknowns of its pose and some to spare
constexpr double kNarrow_deg = 0.5;
constexpr double kFarOff = 20;  ///< times the median residual

using Numbers = std::vector<std::uint64_t>;

/// Disjoint sets of images and points; a root is its own parent.
class Parts {
 public:
  explicit Parts(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::size_t a, std::size_t b) { parent_[root(a)] = root(b); }

 private:
  std::vector<std::size_t> parent_;
};

void check_parts(const Problem& problem, FindingList& list) {
  const std::size_t images = problem.num_images(), frames = images + problem.num_points();
  Parts parts(frames + problem.rigs.num_frames());
  std::vector<bool> sees(images, false);
  for (std::size_t j = 0; j < images; ++j)
    if (in_rig(problem.rigs, j)) parts.join(j, frames + problem.rigs.image_frame[j]);
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    parts.join(problem.observation_image[i], images + problem.observation_point[i]);
    sees[problem.observation_image[i]] = true;
  }
  std::map<std::size_t, std::uint64_t> sizes;
  for (std::size_t j = 0; j < images; ++j)
    if (sees[j]) ++sizes[parts.root(j)];
  if (sizes.size() < 2) return;
  const auto largest = std::max_element(sizes.begin(), sizes.end(),
                                        [](auto& a, auto& b) { return a.second < b.second; });
  Numbers outside;
  for (std::size_t j = 0; j < images; ++j)
    if (sees[j] && parts.root(j) != largest->first) outside.push_back(j);
  list.add("parts", true, "images", outside,
           "the scene falls into " + std::to_string(sizes.size()) + " parts that share no point; " +
               plural(outside.size(), "image is", "images are") + " outside the largest (" +
               std::to_string(largest->second) +
               "): solve the parts by themselves, their places and sizes against each other mean "
               "nothing");
}

void check_images(const Problem& problem, FindingList& list) {
  std::vector<std::uint32_t> seen(problem.num_images(), 0);
  for (const std::uint32_t j : problem.observation_image) ++seen[j];
  Numbers blind, weak;
  const std::vector<std::uint32_t> frames = rigid_frames_of(problem);
  for (std::size_t j = 0; j < seen.size(); ++j) {
    if (frames[j] != Rigs::kNone) continue;  // what counts is what the frame's images see together
    if (seen[j] == 0) blind.push_back(j);
    if (seen[j] > 0 && seen[j] < kFewPoints) weak.push_back(j);
  }
  list.add("blind-images", true, "images", blind,
           plural(blind.size(), "image observes", "images observe") +
               " nothing: nothing determines their poses, they stay as they are");
  list.add("weak-images", true, "images", weak,
           plural(weak.size(), "image observes", "images observe") + " fewer than " +
               std::to_string(kFewPoints) +
               " points: their poses are weak or not determined (3 points are the least); find "
               "more matches, or leave them out");
}

void check_points(const Problem& problem, int threads, FindingList& list) {
  std::vector<std::uint32_t> tracks(problem.num_points(), 0);
  for (const std::uint32_t p : problem.observation_point) ++tracks[p];
  const std::vector<double> angles =
      ray_angles_deg(problem, std::vector<bool>(problem.num_observations(), true), threads);
  Numbers lone, narrow;
  for (std::size_t p = 0; p < tracks.size(); ++p) {
    if (tracks[p] < 2) lone.push_back(p);
    if (tracks[p] >= 2 && angles[p] < kNarrow_deg) narrow.push_back(p);
  }
  list.add("lone-points", true, "points", lone,
           plural(lone.size(), "point has", "points have") +
               " fewer than two observations: their distance is not determined; leave them out "
               "(convert --min-track 2)");
  list.add("narrow-points", false, "points", narrow,
           plural(narrow.size(), "point's", "points'") + " rays meet at less than " +
               shown(kNarrow_deg) +
               " degrees: their depth is hardly determined; leave them out (convert --min-angle)");
}

/// Of images, of frames that move several, and of sensors.
std::uint64_t moving_poses(const Problem& problem) {
  const std::vector<std::uint32_t> frames = rigid_frames_of(problem);
  std::vector<bool> counted(problem.rigs.num_frames(), false),
      sensors(problem.rigs.num_sensors(), false);
  std::uint64_t poses = 0;
  for (std::size_t j = 0; j < frames.size(); ++j) {
    if (frames[j] == Rigs::kNone) {
      ++poses;
      continue;
    }
    const std::uint32_t sensor = problem.rigs.image_sensor[j];
    if (!counted[frames[j]]) ++poses;
    if (!sensors[sensor] && problem.rigs.is_reference[sensor] == 0) ++poses;
    counted[frames[j]] = sensors[sensor] = true;
  }
  return poses;
}

/// Poses that a file states twice, and differently.
void check_stale_poses(const Problem& problem, FindingList& list) {
  if (problem.metadata == nullptr) return;
  const auto& stale = problem.metadata->stale_poses;
  list.add("stale-poses", false, "images", Numbers(stale.begin(), stale.end()),
           plural(stale.size(), "image has", "images have") +
               " another pose in the file of images than its frame and its rig's sensor give, "
               "which hold, as in COLMAP; what reads the images alone sees old poses: write the "
               "model anew (convert to the other form, or solve)");
}

void check_norms(const Problem& problem, FindingList& list) {
  const OffNorms off = off_norms(problem);
  list.add("rotation-norms", false, "images", off.images,
           plural(off.images.size(), "image has a rotation", "images have rotations") +
               " whose stated numbers are off the length 1 by up to " + shown(off.largest) +
               "; they are normalised here, and programs that take them as they are, as COLMAP "
               "does, find other residuals: write the model anew (solve, or convert to another "
               "format)");
}

/// More unknowns than measurements, whatever their arrangement; the 7 of the gauge are free.
void check_rank(const Problem& problem, FindingList& list) {
  std::uint64_t lenses = 0;
  std::vector<bool> used(problem.cameras.size(), false);
  for (const std::uint32_t c : problem.image_camera) used[c] = true;
  for (std::size_t c = 0; c < used.size(); ++c) {
    const ParameterRoles roles = roles_of(problem.cameras[c].model);
    if (!used[c] || roles.fx < 0) continue;
    lenses += 1u + (roles.fy != roles.fx) + (roles.k1 >= 0) + (roles.k2 >= 0);
  }
  const std::uint64_t unknowns = 6 * moving_poses(problem) + 3 * problem.num_points() + lenses;
  const std::uint64_t measured = 2 * problem.num_observations();
  if (measured + 7 >= unknowns) return;
  list.findings.push_back(
      {"rank",
       true,
       unknowns - 7 - measured,
       "unknowns",
       {},
       std::to_string(measured) + " measured coordinates for " + std::to_string(unknowns) +
           " unknowns: many states fit equally well; hold some of them (--fix intrinsics, --fix "
           "poses) or find more matches"});
}

void check_duplicates(const Repetitions& repetitions, FindingList& list) {
  const auto& [same, again] = repetitions;
  list.add("repeated-observations", true, "observations", same,
           plural(same.size(), "observation occurs", "observations occur") +
               " twice, pixel and all: they count double; leave them out (convert "
               "--drop-repeated)");
  list.add("two-pixels", false, "observations", again,
           plural(again.size(), "observation sees", "observations see") +
               " a point in an image that has it at another pixel too: one of the two matches is "
               "wrong; a robust loss (--loss cauchy:auto) bears it");
}

/// Observations that a finding names already.
using Named = std::vector<bool>;

void name(const Numbers& which, Named& named) {
  for (const std::uint64_t i : which) named[i] = true;
}

void check_measurements(const Numbers& absurd, FindingList& list, Named& named) {
  list.add("absurd-measurements", true, "observations", absurd,
           plural(absurd.size(), "observation is", "observations are") +
               " where no image can hold it: outside by more than the image's size, or, where that "
               "is not known, farther from the principal point than 100 times the median; a "
               "damaged file or another unit; leave them out (convert --max-error)");
  name(absurd, named);
}

void check_planes(const PlaneSights& sights, FindingList& list, Named& named) {
  const char* const remedy =
      ": wrong matches or a bad start; leave them out (solve --cheirality hold-out, convert "
      "--drop-behind)";
  list.add("camera-plane", true, "observations", sights.in_plane,
           plural(sights.in_plane.size(), "observation's", "observations'") +
               " point lies in the plane of its camera (Z = 0), where it has no pixel" + remedy);
  list.add("camera-centre", true, "observations", sights.at_centre,
           plural(sights.at_centre.size(), "observation's", "observations'") +
               " point lies at the centre of its camera up to rounding, where any pixel is as "
               "good as any other" +
               remedy);
  name(sights.in_plane, named);
  name(sights.at_centre, named);
}

void check_residuals(Evaluation evaluation, const std::vector<double>& all, FindingList& list,
                     const Named& named) {
  for (Numbers* which : {&evaluation.behind, &evaluation.not_finite})
    std::erase_if(*which, [&](std::uint64_t i) { return named[i]; });
  list.add("behind-camera", true, "observations", evaluation.behind,
           plural(evaluation.behind.size(), "observation's", "observations'") +
               " point lies behind its camera, or beyond what its lens can see: wrong matches or "
               "a bad start; leave them out (convert --drop-behind, solve --cheirality hold-out)");
  list.add("not-finite", true, "observations", evaluation.not_finite,
           plural(evaluation.not_finite.size(), "observation has", "observations have") +
               " a residual that is not finite: numbers so large that they overflow; leave them "
               "out (convert --max-error)");
  std::vector<double> lengths = all;
  std::erase_if(lengths, [](double x) { return !std::isfinite(x); });
  const double median = range_of(std::move(lengths)).median;
  if (!(median > 0)) return;
  Numbers far;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (all[i] > kFarOff * median && !named[i]) far.push_back(i);
  list.add("far-off", false, "observations", far,
           plural(far.size(), "observation is", "observations are") + " off by more than " +
               shown(kFarOff * median) + " px, " + shown(kFarOff) +
               " times the median: probably wrong matches; take a robust loss (--loss "
               "cauchy:auto) or leave them out (convert --max-error)");
}

/// What takes time: each a task of its own.
struct Evidence {
  FindingList joined, points;
  Repetitions repetitions;
  MeasuredReaches measured;
  PlaneSights planes;
  Evaluation evaluation;
  std::vector<double> lengths;
};

Evidence gathered(const Problem& problem, int threads) {
  Evidence out;
  constexpr std::size_t kTasks = 7;
  // The longest first.
  Threads(threads).for_each(kTasks, [&](std::size_t task) {
    if (task == 0) check_points(problem, threads, out.points);
    if (task == 1) out.evaluation = evaluate(problem);
    if (task == 2) out.measured = measured_reaches(problem);
    if (task == 3) out.repetitions = repetitions_in(problem);
    if (task == 4) out.lengths = residual_lengths(problem, threads);
    if (task == 5) check_parts(problem, out.joined);
    if (task == 6) out.planes = plane_sights(problem);
  });
  return out;
}

void append(FindingList from, FindingList& to) {
  for (Finding& finding : from.findings) to.findings.push_back(std::move(finding));
}

}  // namespace

std::vector<Finding> check(const Problem& problem, int threads) {
  Evidence found = gathered(problem, threads);
  FindingList list = std::move(found.joined);
  check_images(problem, list);
  check_rigs(problem, list);
  append(std::move(found.points), list);
  check_rank(problem, list);
  check_stale_poses(problem, list);
  check_norms(problem, list);
  check_duplicates(found.repetitions, list);
  Named named(problem.num_observations(), false);
  check_measurements(found.measured.absurd, list, named);
  check_planes(found.planes, list, named);
  check_residuals(std::move(found.evaluation), found.lengths, list, named);
  check_lenses(problem, found.measured.reaches, list);
  std::stable_sort(list.findings.begin(), list.findings.end(),
                   [](const Finding& a, const Finding& b) { return a.grave > b.grave; });
  return std::move(list.findings);
}

}  // namespace sheaf
