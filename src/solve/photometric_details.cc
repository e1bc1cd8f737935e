// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <new>

#include "platform/parallel.h"
#include "sheaf/solve.h"
#include "solve/patch_level.h"
#include "solve/photometric_rules.h"
#include "solve/point_sigma.h"

namespace sheaf {
namespace {

constexpr std::size_t kPointsPerTask = 256;

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class Examination {
 public:
  Examination(const PhotometricProblem& problem, const PhotometricOptions& options,
              const Pattern& pattern)
      : problem_(problem),
        options_(options),
        pattern_(pattern),
        rays_(uses_rays(problem, options)),
        scene_(scene_of_level(problem, options, pattern, 0)),
        state_(state_of(problem, rays_)),
        threads_(options.threads) {}

  PhotometricDetails run() {
    find_patches();
    PhotometricDetails out;
    for (const Part& part : parts_)
      out.seen.insert(out.seen.end(), part.seen.begin(), part.seen.end());
    const double of_residuals = kSigmaPerMedian * median_of(gather(&Part::sizes));
    out.sigma_grey = kSigmaPerMedian * median_of(gather(&Part::noise));
    out.of_inverse_depth = rays_;
    find_sigmas(scaled_for(options_, pattern_, std::max(kLeastSigma, of_residuals)), out);
    return out;
  }

 private:
  struct Part {  ///< of some consecutive points
    std::vector<PatchSight> seen;
    std::vector<double> sizes, noise;  ///< |r| of every pixel, and by its own noise
  };

  /// One list of all parts', which are emptied: there may be a number for every pixel seen.
  std::vector<double> gather(std::vector<double> Part::*list) {
    std::size_t count = 0;
    for (const Part& part : parts_) count += (part.*list).size();
    std::vector<double> out;
    out.reserve(count);
    for (Part& part : parts_) {
      out.insert(out.end(), (part.*list).begin(), (part.*list).end());
      std::vector<double>().swap(part.*list);
    }
    return out;
  }

  template <class Task>
  void for_parts(const Task& task) {
    threads_.for_ranges(problem_.num_points(), kPointsPerTask,
                        [&](std::size_t first, std::size_t end) {
                          task(parts_[first / kPointsPerTask], first, end);
                        });
  }

  bool counts(const Sight& sight) const {
    if (!is_seen(scene_, state_, sight)) return false;
    return options_.min_zncc <= -1 || options_.leaving == Leaving::free ||
           correlation(scene_, state_, sight) >= options_.min_zncc;
  }

  void find_patches() {
    parts_.resize((problem_.num_points() + kPointsPerTask - 1) / kPointsPerTask);
    const std::vector<Sight> all = all_sights(problem_, rays_);
    const auto begin_of = [&](std::size_t point) {
      return std::partition_point(all.begin(), all.end(),
                                  [&](const Sight& sight) { return sight.point < point; });
    };
    for_parts([&](Part& part, std::size_t first, std::size_t end) {
      PointSigma sigma(scene_, 1);
      std::vector<double> residuals, variances;
      const auto last = begin_of(end);
      const auto most = static_cast<std::size_t>(last - begin_of(first)) * pattern_.size();
      part.sizes.reserve(most), part.noise.reserve(most);
      for (auto sight = begin_of(first); sight != last; ++sight) {
        if (!counts(*sight) || !patch_residuals(scene_, state_, *sight, residuals)) continue;
        sigma.variances(state_, *sight, variances);
        double sum = 0;
        for (std::size_t k = 0; k < residuals.size(); ++k) {
          const double size = std::abs(residuals[k]);
          sum += size * size;
          part.sizes.push_back(size);
          part.noise.push_back(size / std::sqrt(variances[k]));
        }
        const PatchPlace at = place_patch(scene_, state_, *sight);
        part.seen.push_back({sight->point, sight->image, at.x, at.y,
                             std::sqrt(sum / static_cast<double>(residuals.size()))});
      }
    });
  }

  void find_sigmas(const ScaledLoss& loss, PhotometricDetails& out) {
    const std::size_t each = rays_ ? 1 : 3;
    out.sigma.resize(each * problem_.num_points());
    for_parts([&](Part& part, std::size_t first, std::size_t end) {
      PointSigma sigma(scene_, out.sigma_grey);
      std::vector<double> residuals;
      auto sight = part.seen.begin();
      for (std::size_t i = first; i < end; ++i) {
        sigma.clear();
        for (; sight != part.seen.end() && sight->point == i; ++sight) {
          const Sight of{sight->point, sight->image};
          if (patch_residuals(scene_, state_, of, residuals))
            sigma.add(state_, of, loss, options_.loss_per_patch, residuals);
        }
        sigma.sigmas(static_cast<std::uint32_t>(i), &out.sigma[each * i]);
      }
    });
  }

  const PhotometricProblem& problem_;
  const PhotometricOptions& options_;
  const Pattern pattern_;
  const bool rays_;
  const PatchScene scene_;
  const PatchState state_;
  Threads threads_;
  std::vector<Part> parts_;
};

}  // namespace

Result<PhotometricDetails> examine_photometric(const PhotometricProblem& problem,
                                               const PhotometricOptions& options) {
  const Result<Pattern> pattern = check_photometric(problem, options);
  if (!pattern.ok()) return pattern.error();
  try {
    return Examination(problem, options, pattern.value()).run();
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, "the machine has no memory left for these images");
  }
}

}  // namespace sheaf
