// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "solve/endings.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/rotation.h"
#include "scene/camera_plane.h"
#include "starts/resection.h"
#include "starts/sights.h"

namespace sheaf {
namespace {

/// Below this mean cost of an observation none of them can drown the others.
constexpr double kSuspicious_px2 = 1e6;
/// Above this one no observation can be an image's: the largest cost is named in any case.
constexpr double kAbsurd_px2 = 1e16;
constexpr const char* kRemedy =
    "; --cheirality hold-out leaves it out, and so does 'sheaf convert --drop-behind'";

/// "observation 17, of point 5 in image 3 (IMG_4.jpg),"
std::string name_of(const Problem& problem, std::uint64_t i) {
  const std::uint32_t image = problem.observation_image[i];
  std::string name = "observation " + std::to_string(i) + ", of point " +
                     std::to_string(problem.observation_point[i]) + " in image " +
                     std::to_string(image);
  const SceneMetadata* metadata = problem.metadata.get();
  if (metadata != nullptr && image < metadata->image_names.size())
    name += " (" + metadata->image_names[image] + ")";
  return name + ",";
}

/// The cost of each observation by code apart from the solver's, 0 for those that are left out.
std::vector<double> costs_of(const Problem& problem, const std::vector<std::uint8_t>& skip,
                             const ScaledLoss& loss, Threads& threads) {
  constexpr std::size_t kObservations = 65536;
  std::vector<Matrix3<double>> rotations;
  for (const Pose& pose : problem.poses) rotations.push_back(matrix_from_quaternion(pose.rotation));
  std::vector<double> costs(problem.num_observations(), 0);
  threads.for_ranges(costs.size(), kObservations, [&](std::size_t i, std::size_t end) {
    for (; i < end; ++i) {
      if (!skip.empty() && skip[i] != 0) continue;
      const std::uint32_t image = problem.observation_image[i];
      const double* X = &problem.points[3 * std::size_t(problem.observation_point[i])];
      costs[i] = fit_of(problem.cameras[problem.image_camera[image]],
                        in_camera(rotations[image], problem.poses[image], X),
                        &problem.observation_xy[2 * i], loss)
                     .cost;
    }
  });
  return costs;
}

bool has_free_columns(const Problem& problem, const Fixed& fixed) {
  if (!fixed.points) return true;
  const FreeImages free = free_images(problem, fixed);
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    const std::uint32_t camera = problem.image_camera[i];
    const ParameterSet all =
        static_cast<ParameterSet>((1u << parameter_count(problem.cameras[camera].model)) - 1);
    if (free.pose[i] != 0 || (all & ~free.lens_held[camera]) != 0) return true;
  }
  return false;
}

/// Why the start is not finite: the first observation whose point has no pixel.
std::string not_finite_words(const Problem& problem, const std::vector<std::uint8_t>& skip) {
  const auto first = [&](const std::vector<std::uint64_t>& list) {
    return std::find_if(list.begin(), list.end(),
                        [&](std::uint64_t i) { return skip.empty() || skip[i] == 0; });
  };
  const PlaneSights sights = plane_sights(problem);
  const std::string start = "the cost of the start is not finite: ";
  if (const auto i = first(sights.at_centre); i != sights.at_centre.end())
    return start + name_of(problem, *i) + " has its point at the camera's centre" + kRemedy;
  if (const auto i = first(sights.in_plane); i != sights.in_plane.end())
    return start + name_of(problem, *i) +
           " has its point in the plane of the camera's centre (Z = 0)" + kRemedy;
  return "no step led to a finite cost, however short: the numbers overflow";
}

bool all_weights_zero(const Problem& problem, const std::vector<std::uint8_t>& skip,
                      const ScaledLoss& loss, Threads& threads) {
  if (loss.kind != LossKind::tukey) return false;
  const double most = loss.scale_px * loss.scale_px / 6;  // 1/2 rho at its largest
  const std::vector<double> costs = costs_of(problem, skip, loss, threads);
  for (std::size_t i = 0; i < costs.size(); ++i)
    if ((skip.empty() || skip[i] == 0) && costs[i] < most) return false;
  return true;
}

}  // namespace

std::optional<std::uint64_t> drowning_observation(const Problem& problem,
                                                  const std::vector<std::uint8_t>& skip,
                                                  const ScaledLoss& loss, Threads& threads) {
  constexpr double kHidden = 1e-3;
  const std::vector<double> costs = costs_of(problem, skip, loss, threads);
  const auto largest = std::max_element(costs.begin(), costs.end());
  if (largest == costs.end()) return std::nullopt;
  double others = 0;
  for (auto it = costs.begin(); it != costs.end(); ++it)
    if (it != largest) others += *it;
  if (!(*largest * std::numeric_limits<double>::epsilon() > kHidden * others) || others == 0)
    return std::nullopt;
  return static_cast<std::uint64_t>(largest - costs.begin());
}

std::optional<Ending> ending_of(const Problem& problem, const std::vector<std::uint8_t>& skip,
                                const SolveOptions& options, const Summary& summary,
                                Threads& threads) {
  // Rounding may put a point beside the plane in one code and into it in another.
  if (!std::isfinite(summary.initial_cost) || summary.termination == Termination::no_usable_step)
    return Ending{Termination::no_usable_step, not_finite_words(problem, skip)};
  if (!has_free_columns(problem, options.fixed))
    return Ending{Termination::nothing_free, "nothing was free to move: the state is as it was"};
  const bool converged = summary.termination == Termination::cost_converged ||
                         summary.termination == Termination::gradient_converged ||
                         summary.termination == Termination::step_converged;
  if (!converged) return std::nullopt;
  const ScaledLoss loss{summary.loss, summary.rounds.back().scale_px};
  if (summary.iterations.size() == 1 && all_weights_zero(problem, skip, loss, threads))
    return Ending{Termination::zero_weights,
                  "every observation has the weight 0: no residual is below the loss's scale of " +
                      std::to_string(loss.scale_px) + " px; a larger one, or huber first"};
  const double mean = summary.final_cost / static_cast<double>(problem.num_observations());
  if (mean < kSuspicious_px2) return std::nullopt;
  std::optional<std::uint64_t> i = drowning_observation(problem, skip, loss, threads);
  if (!i && mean > kAbsurd_px2) {
    const std::vector<double> costs = costs_of(problem, skip, loss, threads);
    i = static_cast<std::uint64_t>(std::max_element(costs.begin(), costs.end()) - costs.begin());
  }
  if (i)
    return Ending{Termination::drowned,
                  "stopped: " + name_of(problem, *i) +
                      " alone costs so much that its rounding hides what all others could gain; it "
                      "is wrong, or its point is" +
                      kRemedy};
  return std::nullopt;
}

}  // namespace sheaf
