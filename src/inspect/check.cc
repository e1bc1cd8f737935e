// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/check.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>

#include "geometry/camera_model.h"
#include "inspect/clean.h"
#include "inspect/statistics.h"
#include "scene/point_errors.h"

namespace sheaf {
namespace {

constexpr std::size_t kMostListed = 1000;
constexpr std::uint32_t kFewPoints = 10;  ///< of an image: 6 unknowns of its pose and some to spare
constexpr double kNarrow_deg = 0.5;
constexpr double kFarOff = 20;  ///< times the median residual

using Numbers = std::vector<std::uint64_t>;

std::string plural(std::uint64_t count, const char* one, const char* many) {
  return std::to_string(count) + " " + (count == 1 ? one : many);
}

/// Three digits.
std::string shown(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

struct Report {
  std::vector<Finding> findings;

  void add(const char* code, bool grave, const char* of, const Numbers& which,
           const std::string& words) {
    if (which.empty()) return;
    const std::size_t listed = std::min(which.size(), kMostListed);
    findings.push_back({code, grave, which.size(), of,
                        Numbers(which.begin(), which.begin() + static_cast<std::ptrdiff_t>(listed)),
                        words});
  }
};

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

void check_parts(const Problem& problem, Report& report) {
  const std::size_t images = problem.num_images();
  Parts parts(images + problem.num_points());
  std::vector<bool> sees(images, false);
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
  report.add("parts", true, "images", outside,
             "the scene falls into " + std::to_string(sizes.size()) +
                 " parts that share no point; " + plural(outside.size(), "image is", "images are") +
                 " outside the largest (" + std::to_string(largest->second) +
                 "): solve the parts by themselves, their places and sizes against each other mean "
                 "nothing");
}

void check_images(const Problem& problem, Report& report) {
  std::vector<std::uint32_t> seen(problem.num_images(), 0);
  for (const std::uint32_t j : problem.observation_image) ++seen[j];
  Numbers blind, weak;
  for (std::size_t j = 0; j < seen.size(); ++j) {
    if (seen[j] == 0) blind.push_back(j);
    if (seen[j] > 0 && seen[j] < kFewPoints) weak.push_back(j);
  }
  report.add("blind-images", true, "images", blind,
             plural(blind.size(), "image observes", "images observe") +
                 " nothing: nothing determines their poses, they stay as they are");
  report.add("weak-images", true, "images", weak,
             plural(weak.size(), "image observes", "images observe") + " fewer than " +
                 std::to_string(kFewPoints) +
                 " points: their poses are weak or not determined (3 points are the least); find "
                 "more matches, or leave them out");
}

void check_points(const Problem& problem, Report& report) {
  std::vector<std::uint32_t> tracks(problem.num_points(), 0);
  for (const std::uint32_t p : problem.observation_point) ++tracks[p];
  const std::vector<double> angles =
      ray_angles_deg(problem, std::vector<bool>(problem.num_observations(), true));
  Numbers lone, narrow;
  for (std::size_t p = 0; p < tracks.size(); ++p) {
    if (tracks[p] < 2) lone.push_back(p);
    if (tracks[p] >= 2 && angles[p] < kNarrow_deg) narrow.push_back(p);
  }
  report.add("lone-points", true, "points", lone,
             plural(lone.size(), "point has", "points have") +
                 " fewer than two observations: their distance is not determined; leave them out "
                 "(convert --min-track 2)");
  report.add(
      "narrow-points", false, "points", narrow,
      plural(narrow.size(), "point's", "points'") + " rays meet at less than " +
          shown(kNarrow_deg) +
          " degrees: their depth is hardly determined; leave them out (convert --min-angle)");
}

/// More unknowns than measurements, whatever their arrangement; the 7 of the gauge are free.
void check_rank(const Problem& problem, Report& report) {
  std::uint64_t lenses = 0;
  std::vector<bool> used(problem.cameras.size(), false);
  for (const std::uint32_t c : problem.image_camera) used[c] = true;
  for (std::size_t c = 0; c < used.size(); ++c) {
    const ParameterRoles roles = roles_of(problem.cameras[c].model);
    if (used[c]) lenses += 1u + (roles.fy != roles.fx) + (roles.k1 >= 0) + (roles.k2 >= 0);
  }
  const std::uint64_t unknowns = 6 * problem.num_images() + 3 * problem.num_points() + lenses;
  const std::uint64_t measured = 2 * problem.num_observations();
  if (measured + 7 >= unknowns) return;
  report.findings.push_back(
      {"rank",
       true,
       unknowns - 7 - measured,
       "unknowns",
       {},
       std::to_string(measured) + " measured coordinates for " + std::to_string(unknowns) +
           " unknowns: many states fit equally well; hold some of them (--fix intrinsics, --fix "
           "poses) or find more matches"});
}

void check_duplicates(const Problem& problem, Report& report) {
  const auto [same, again] = repetitions_in(problem);
  report.add("repeated-observations", true, "observations", same,
             plural(same.size(), "observation occurs", "observations occur") +
                 " twice, pixel and all: they count double; leave them out (convert "
                 "--drop-repeated)");
  report.add("two-pixels", false, "observations", again,
             plural(again.size(), "observation sees", "observations see") +
                 " a point in an image that has it at another pixel too: one of the two matches is "
                 "wrong; a robust loss (--loss cauchy:auto) bears it");
}

void check_residuals(const Problem& problem, Report& report) {
  const Evaluation evaluation = evaluate(problem);
  report.add(
      "behind-camera", true, "observations", evaluation.behind,
      plural(evaluation.behind.size(), "observation's", "observations'") +
          " point lies behind its camera, or beyond what its lens can see: wrong matches or "
          "a bad start; leave them out (convert --drop-behind, solve --cheirality hold-out)");
  report.add("not-finite", true, "observations", evaluation.not_finite,
             plural(evaluation.not_finite.size(), "observation has", "observations have") +
                 " a residual that is not finite: a point in the plane of its camera, or absurd "
                 "parameters; leave them out (convert --max-error)");
  std::vector<double> lengths = residual_lengths(problem);
  const std::vector<double> all = lengths;
  std::erase_if(lengths, [](double x) { return !std::isfinite(x); });
  const double median = range_of(std::move(lengths)).median;
  if (!(median > 0)) return;
  Numbers far;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (all[i] > kFarOff * median) far.push_back(i);
  report.add("far-off", false, "observations", far,
             plural(far.size(), "observation is", "observations are") + " off by more than " +
                 shown(kFarOff * median) + " px, " + shown(kFarOff) +
                 " times the median: probably wrong matches; take a robust loss (--loss "
                 "cauchy:auto) or leave them out (convert --max-error)");
}

/// Against the size of the images where it is known, else against how far measurements reach.
void check_focals(const Problem& problem, Report& report) {
  std::vector<double> size(problem.cameras.size(), 0);
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::uint32_t c = problem.image_camera[problem.observation_image[i]];
    const bool centred = problem.cameras[c].model == CameraModel::bal;
    for (std::size_t k = 0; k < 2; ++k)
      size[c] = std::max(size[c], (centred ? 2 : 1) * std::abs(problem.observation_xy[2 * i + k]));
  }
  Numbers absurd;
  for (std::size_t c = 0; c < size.size(); ++c) {
    const Camera& camera = problem.cameras[c];
    const auto stated = static_cast<double>(std::max(camera.width_px, camera.height_px));
    const double width = stated > 0 ? stated : size[c];
    const ParameterRoles roles = roles_of(camera.model);
    for (const int which : {roles.fx, roles.fy}) {
      const double f = camera.parameters[static_cast<std::size_t>(which)];
      if (f > 0 && (width == 0 || (f > 0.05 * width && f < 50 * width))) continue;
      absurd.push_back(c);
      break;
    }
  }
  report.add("absurd-focal", true, "lenses", absurd,
             plural(absurd.size(), "lens has a focal length", "lenses have focal lengths") +
                 " below 0, or far from the size of the images: not what a camera has; set it to "
                 "about the width of the image, or hold a good one (--fix f)");
}

}  // namespace

std::vector<Finding> check(const Problem& problem) {
  Report report;
  check_parts(problem, report);
  check_images(problem, report);
  check_points(problem, report);
  check_rank(problem, report);
  check_duplicates(problem, report);
  check_residuals(problem, report);
  check_focals(problem, report);
  std::stable_sort(report.findings.begin(), report.findings.end(),
                   [](const Finding& a, const Finding& b) { return a.grave > b.grave; });
  return std::move(report.findings);
}

}  // namespace sheaf
