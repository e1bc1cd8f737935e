// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "sheaf/covariance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>

#include "covariance/inverse_normal.h"
#include "covariance/noise.h"
#include "covariance/weak_directions.h"
#include "platform/clock.h"
#include "platform/real_text.h"

namespace sheaf {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Fills a Covariance from the inverse, part by part.
class Telling {
 public:
  Telling(const Problem& problem, const CovarianceOptions& options, NormalEquations& equations,
          const InverseNormal& inverse, Threads& threads, Covariance& out)
      : problem_(problem),
        options_(options),
        equations_(equations),
        inverse_(inverse),
        threads_(threads),
        blocks_(equations.blocks()),
        variance_(out.sigma * out.sigma * out.loss_factor),
        out_(out) {}

  void run() {
    tell_poses();
    tell_lenses();
    if (options_.points && !equations_.points_held()) tell_points();
    if (options_.observations) tell_observations();
  }

 private:
  std::vector<double> identity(std::size_t n) const {
    std::vector<double> out(n * n, 0);
    for (std::size_t k = 0; k < n; ++k) out[(n + 1) * k] = 1;
    return out;
  }
  /// Of parts whose columns are all determined; else infinite on the diagonal and 0 beside it.
  std::vector<double> scaled(const std::vector<LinearPart>& parts, std::size_t rows) const {
    std::vector<double> C = inverse_.of(parts, rows);
    for (double& x : C) x *= variance_;
    // What the gauge makes exact comes out as 0 to rounding, on either side of it.
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t j = 0; C[(rows + 1) * i] <= 0 && j < rows; ++j)
        C[rows * i + j] = C[rows * j + i] = 0;
    for (const LinearPart& part : parts)
      for (std::size_t k = 0; k < blocks_.width(part.block); ++k) {
        if (inverse_.determined(blocks_.first[part.block] + static_cast<std::int32_t>(k))) continue;
        for (std::size_t i = 0; i < rows; ++i)
          if (part.by[blocks_.width(part.block) * i + k] != 0)
            for (std::size_t j = 0; j < rows; ++j)
              C[rows * i + j] = C[rows * j + i] = i == j ? kInfinite : 0;
      }
    return C;
  }
  Covariance6 of_pose(const std::vector<LinearPart>& parts) const {
    Covariance6 out{};
    if (parts.empty()) return out;
    const std::vector<double> C = scaled(parts, 6);
    std::copy(C.begin(), C.end(), out.begin());
    return out;
  }
  Covariance6 of_block(std::uint32_t block) const {
    if (block == ParameterBlocks::kNone) return {};
    return of_pose({{block, identity(6)}});
  }

  void tell_poses() {
    for (std::size_t i = 0; i < problem_.num_images(); ++i) {
      std::vector<LinearPart> parts;
      for (const auto& pose : equations_.rows().pose_parts(i))
        parts.push_back({pose.block, {pose.by_image.begin(), pose.by_image.end()}});
      out_.poses.push_back(of_pose(parts));
      // The centre moves by -R^T rho.
      const Matrix3<double> R = matrix_from_quaternion(problem_.poses[i].rotation);
      std::array<double, 9> C{};
      for (std::size_t a = 0; a < 3; ++a)
        for (std::size_t b = 0; b < 3; ++b)
          for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t l = 0; l < 3; ++l)
              C[3 * a + b] += R[3 * k + a] * out_.poses[i][6 * k + l] * R[3 * l + b];
      out_.centres.push_back(C);
    }
    for (const std::uint32_t block : blocks_.frame) out_.frames.push_back(of_block(block));
    for (const std::uint32_t block : blocks_.sensor) out_.sensors.push_back(of_block(block));
  }

  void tell_lenses() {
    for (std::size_t c = 0; c < problem_.cameras.size(); ++c) {
      const ParameterBlocks::Lens& lens = blocks_.lenses[c];
      const std::size_t n = parameter_count(problem_.cameras[c].model);
      const std::size_t free = lens.of_column.size();
      std::vector<double>& C = out_.lenses.emplace_back(n * n, 0);
      if (free == 0) continue;
      std::vector<LinearPart> parts;
      for (std::size_t at = 0; at < free; at += 9) {
        const std::uint32_t block = lens.block + static_cast<std::uint32_t>(at / 9);
        const std::size_t width = blocks_.width(block);
        std::vector<double> by(free * width, 0);
        for (std::size_t k = 0; k < width; ++k) by[width * (at + k) + k] = 1;
        parts.push_back({block, std::move(by)});
      }
      const std::vector<double> of = scaled(parts, free);
      for (std::size_t i = 0; i < free; ++i)
        for (std::size_t j = 0; j < free; ++j)
          C[n * static_cast<std::size_t>(lens.of_column[i]) +
            static_cast<std::size_t>(lens.of_column[j])] = of[free * i + j];
    }
  }

  void tell_points() {
    const bool all = options_.point_ids.empty();
    const std::size_t count = all ? problem_.num_points() : options_.point_ids.size();
    out_.points.resize(count);
    std::vector<std::uint8_t> lost(count, 0);
    threads_.for_ranges(count, 256, [&](std::size_t k, std::size_t end) {
      NormalEquations::Point point;
      for (; k < end; ++k) {
        const std::size_t p = all ? k : options_.point_ids[k];
        const auto kept = std::lower_bound(blocks_.kept.begin(), blocks_.kept.end(), p);
        if (kept != blocks_.kept.end() && *kept == p) {
          const std::uint32_t block =
              blocks_.kept_block[static_cast<std::size_t>(kept - blocks_.kept.begin())];
          const std::vector<double> C = scaled({{block, identity(3)}}, 3);
          std::copy(C.begin(), C.end(), out_.points[k].begin());
          continue;
        }
        equations_.point(p, point);
        if (!point.determined) {
          out_.points[k].fill(kInfinite);
          lost[k] = 1;
          continue;
        }
        out_.points[k] =
            options_.conditional ? point.inverse : inverse_.of(point, &problem_.points[3 * p]);
        for (double& x : out_.points[k]) x *= variance_;
      }
    });
    out_.undetermined_points =
        static_cast<std::uint64_t>(std::count(lost.begin(), lost.end(), std::uint8_t(1)));
  }

  void tell_observations() {
    out_.observations.resize(problem_.num_observations());
    threads_.for_ranges(problem_.num_points(), 256, [&](std::size_t p, std::size_t end) {
      NormalEquations::Point point;
      ObservationRows::Row row;
      for (; p < end; ++p) {
        if (equations_.begin_of(p) == equations_.end_of(p)) continue;
        equations_.point(p, point);
        for (const std::uint64_t* i = equations_.begin_of(p); i != equations_.end_of(p); ++i) {
          equations_.rows().evaluate(*i, row);
          out_.observations[*i] = reliability(point, row);
        }
      }
    });
  }
  ObservationReliability reliability(const NormalEquations::Point& point,
                                     const ObservationRows::Row& row) const {
    const double w = equations_.weight_of(row);
    const std::array<double, 4> fit = inverse_.of_fit(point, row, equations_.points_held());
    ObservationReliability out;
    for (std::size_t r = 0; r < 2; ++r) {
      out.redundancy[r] = std::clamp(1 - w * fit[3 * r], 0.0, 1.0);
      const double root = std::sqrt(out.redundancy[r] * w);
      out.standardised[r] = root > 0 ? w * row.r[r] / (out_.sigma * root) : 0;
    }
    return out;
  }

  const Problem& problem_;
  const CovarianceOptions& options_;
  NormalEquations& equations_;
  const InverseNormal& inverse_;
  Threads& threads_;
  const ParameterBlocks& blocks_;
  const double variance_;
  Covariance& out_;
};

Result<void> check(const Problem& problem, const CovarianceOptions& options) {
  if (Result<void> valid = validate(problem); !valid.ok()) return valid;
  const auto usage = [](const std::string& text) { return Error(ErrorCode::usage, text); };
  if (problem.num_observations() == 0) return usage("the problem has no observations");
  if (!(options.sigma >= 0) || !std::isfinite(options.sigma))
    return usage("the sigma must be finite and not below 0");
  for (const std::uint32_t p : options.point_ids)
    if (p >= problem.num_points())
      return usage("point " + std::to_string(p) + " is not one of the " +
                   std::to_string(problem.num_points()) + " points");
  if (options.loss.kind != LossKind::none && !(options.loss.scale_px > 0))
    return usage("a covariance needs the loss's scale as the solve ended with it");
  return {};
}

void add_words(const GaugeWeights& weights, const InverseNormal& inverse, Covariance& out) {
  if (out.deficit == 0) {
    out.words.push_back("the data fix the scene's place, turn and scale: no gauge is added");
  } else {
    std::string names;
    for (const std::string& name : out.freedoms) names += (names.empty() ? "" : ", ") + name;
    out.words.push_back(
        "the data leave " + std::to_string(out.deficit) + " of the scene's seven freedoms" +
        (out.deficit < 7 && !names.empty() ? " (" + names + ")" : "") + "; " + weights.words);
  }
  out.words.push_back("sigma of a residual " + few_digits(out.sigma, 6) +
                      (out.sigma_estimated ? ", from the residuals (redundancy " +
                                                 few_digits(out.redundancy, 6) + ")"
                                           : ", as stated"));
  if (inverse.ridged())
    out.words.push_back("the measurements leave more undetermined than the scene's freedoms");
  if (out.undetermined_points > 0)
    out.words.push_back(std::to_string(out.undetermined_points) +
                        " points are not determined by their observations");
  constexpr std::size_t kMostSaid = 10;
  for (std::size_t k = 0; k < std::min(kMostSaid, out.weak.size()); ++k)
    out.words.push_back(out.weak[k].words);
  if (out.weak.size() > kMostSaid)
    out.words.push_back("and " + std::to_string(out.weak.size() - kMostSaid) +
                        " more parameters or pairs are not determined");
}

}  // namespace

Result<Covariance> covariance(const Problem& given, const CovarianceOptions& options) {
  const Stopwatch clock;
  if (const Result<void> good = check(given, options); !good.ok()) return good.error();
  try {
    Problem placed;
    const Problem* problem = &given;
    if (!given.rigs.empty()) {
      placed = given;
      place_images(placed);
      problem = &placed;
    }
    Threads threads(options.threads);
    ScaledLoss loss{options.loss.kind, options.loss.scale_px, 1};
    if (loss.kind == LossKind::none) loss.scale_px = 1;
    NormalEquations equations(*problem, options.fixed, loss);
    const SceneGauge gauge(*problem, equations);
    const Gauge kind = options.gauge == Gauge::automatic && gauge.count() > 0 ? Gauge::free_centres
                                                                              : options.gauge;
    const Result<GaugeWeights> weights = gauge_weights(*problem, equations.blocks(), gauge, kind);
    if (!weights.ok()) return weights.error();
    Covariance out;
    out.gauge = gauge.count() == 0 ? Gauge::data : kind;
    out.deficit = static_cast<int>(gauge.count());
    out.freedoms = gauge.names();
    const auto seen = static_cast<std::uint64_t>(std::count_if(
        equations.squares().begin(), equations.squares().end(), [](double x) { return x > 0; }));
    out.unknowns = seen + 3 * equations.eliminated_points();
    out.rows = 2 * equations.moments().observations + equations.moments().terms;
    const Noise noise = noise_of(equations.moments(), loss, options.sigma,
                                 static_cast<double>(out.unknowns) - out.deficit);
    out.sigma = noise.sigma;
    out.sigma_estimated = noise.estimated;
    out.loss_factor = noise.factor;
    out.redundancy = noise.redundancy;
    const auto inverse = InverseNormal::make(*problem, equations, gauge, weights.value(),
                                             options.memory_limit_bytes, threads);
    if (!inverse.ok()) return inverse.error();
    Telling(*problem, options, equations, *inverse.value(), threads, out).run();
    out.weak = weak_directions(*problem, out.lenses);
    add_words(weights.value(), *inverse.value(), out);
    out.seconds = clock.seconds();
    return out;
  } catch (const std::bad_alloc&) {
    return Error(ErrorCode::memory_limit, "the machine has no memory left for the covariance");
  }
}

}  // namespace sheaf
