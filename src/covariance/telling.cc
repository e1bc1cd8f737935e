// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "covariance/telling.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "platform/cancel.h"
#include "starts/sights.h"

namespace sheaf {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Fills a Covariance from the inverse, part by part.
class Telling {
 public:
  Telling(const Problem& problem, const CovarianceOptions& options, NormalEquations& equations,
          const Inverse& inverse, const InverseNormal* factored, const JointFunctions& joint,
          Threads& threads, Covariance& out)
      : problem_(problem),
        options_(options),
        equations_(equations),
        inverse_(inverse),
        factored_(factored),
        joint_(joint),
        threads_(threads),
        blocks_(equations.blocks()),
        variance_(out.sigma * out.sigma * out.loss_factor),
        out_(out) {}

  void run() {
    tell_poses();
    tell_lenses();
    tell_lens_motions();
    tell_pairs();
    if (options_.points && !equations_.points_held()) tell_points();
    if (options_.observations && factored_ != nullptr) tell_observations();
  }

 private:
  /// Of functions whose columns are all determined; else infinite on the diagonal and 0 beside it.
  std::vector<double> scaled(const LinearFunction& function, std::vector<double> C) const {
    const std::size_t rows = function.rows;
    for (double& x : C) x *= variance_;
    // What the gauge makes exact comes out as 0 to rounding, on either side of it.
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t j = 0; C[(rows + 1) * i] <= 0 && j < rows; ++j)
        C[rows * i + j] = C[rows * j + i] = 0;
    for (const LinearPart& part : function.parts)
      for (std::size_t k = 0; k < blocks_.width(part.block); ++k) {
        if (inverse_.determined(blocks_.first[part.block] + static_cast<std::int32_t>(k))) continue;
        for (std::size_t i = 0; i < rows; ++i)
          if (part.by[blocks_.width(part.block) * i + k] != 0)
            for (std::size_t j = 0; j < rows; ++j)
              C[rows * i + j] = C[rows * j + i] = i == j ? kInfinite : 0;
      }
    return C;
  }
  std::vector<double> scaled(const LinearFunction& function) const {
    return scaled(function, inverse_.of(function));
  }
  Covariance6 of_pose(const LinearFunction& function) const {
    Covariance6 out{};
    if (function.parts.empty()) return out;
    const std::vector<double> C = scaled(function);
    std::copy(C.begin(), C.end(), out.begin());
    return out;
  }
  /// The first `rows` columns of one block.
  LinearFunction function_of_block(std::uint32_t block, std::size_t rows) const {
    LinearFunction out;
    out.rows = rows;
    if (block == ParameterBlocks::kNone) return out;
    std::vector<double> by(rows * rows, 0);
    for (std::size_t k = 0; k < rows; ++k) by[(rows + 1) * k] = 1;
    out.parts.push_back({block, std::move(by)});
    return out;
  }

  /// Points of long tracks take their time, on every thread.
  bool is_cancelled() const { return cancelled_ != nullptr && (*cancelled_)(); }

  void tell_poses() {
    const bool all = options_.image_ids.empty();
    const std::size_t count = all ? problem_.num_images() : options_.image_ids.size();
    for (std::size_t k = 0; k < count; ++k) tell_pose(all ? k : std::size_t(options_.image_ids[k]));
    const Rigs& rigs = problem_.rigs;
    const std::vector<std::uint8_t> frames = asked(blocks_.frame.size(), rigs.image_frame),
                                    sensors = asked(blocks_.sensor.size(), rigs.image_sensor);
    for (std::size_t f = 0; f < frames.size(); ++f)
      out_.frames.push_back(of_moving(blocks_.frame[f], frames[f] != 0));
    for (std::size_t s = 0; s < sensors.size(); ++s)
      out_.sensors.push_back(of_moving(blocks_.sensor[s], sensors[s] != 0));
  }
  /// All, or with single solves what the named images have.
  std::vector<std::uint8_t> asked(std::size_t count,
                                  const std::vector<std::uint32_t>& of_image) const {
    std::vector<std::uint8_t> out(count, factored_ != nullptr ? 1 : 0);
    if (factored_ == nullptr && !of_image.empty())
      for (const std::uint32_t image : options_.image_ids)
        if (of_image[image] < count) out[of_image[image]] = 1;
    return out;
  }
  Covariance6 of_moving(std::uint32_t block, bool is_asked) const {
    if (is_asked) return of_pose(function_of_block(block, 6));
    Covariance6 out;
    out.fill(std::numeric_limits<double>::quiet_NaN());
    return out;
  }
  void tell_pose(std::size_t image) {
    poll_cancelled();
    const Covariance6& pose =
        out_.poses.emplace_back(of_pose(function_of_image(equations_, image)));
    // The centre moves by -R^T rho.
    const Matrix3<double> R = matrix_from_quaternion(problem_.poses[image].rotation);
    std::array<double, 9> C{};
    for (std::size_t a = 0; a < 3; ++a)
      for (std::size_t b = 0; b < 3; ++b)
        for (std::size_t k = 0; k < 3; ++k)
          for (std::size_t l = 0; l < 3; ++l)
            C[3 * a + b] += R[3 * k + a] * pose[6 * k + l] * R[3 * l + b];
    out_.centres.push_back(C);
  }

  void tell_lenses() {
    const std::vector<std::uint8_t> wanted = asked(problem_.cameras.size(), problem_.image_camera);
    for (std::size_t c = 0; c < problem_.cameras.size(); ++c) {
      poll_cancelled();
      std::vector<double>& C = out_.lenses.emplace_back();
      if (wanted[c] == 0) continue;
      const LinearFunction function = function_of_lens(blocks_, c);
      spread_lens(c, 0, function.rows == 0 ? std::vector<double>{} : scaled(function), C);
    }
  }
  /// Free columns of a lens, and `more` rows behind them, among all its parameters.
  void spread_lens(std::size_t camera, std::size_t more, const std::vector<double>& of,
                   std::vector<double>& C) const {
    const std::size_t n = parameter_count(problem_.cameras[camera].model), all = n + more;
    std::vector<std::size_t> place;
    for (const std::int8_t p : blocks_.lenses[camera].of_column)
      place.push_back(static_cast<std::size_t>(p));
    for (std::size_t k = 0; k < more; ++k) place.push_back(n + k);
    C.assign(all * all, 0);
    for (std::size_t i = 0; !of.empty() && i < place.size(); ++i)
      for (std::size_t j = 0; j < place.size(); ++j)
        C[all * place[i] + place[j]] = of[place.size() * i + j];
  }
  void tell_lens_motions() {
    for (std::size_t c = 0; c < joint_.of_lens.size(); ++c) {
      std::vector<double>& C = out_.lens_motions.emplace_back();
      const std::size_t f = joint_.of_lens[c];
      if (f != JointFunctions::kNone)
        spread_lens(c, 6, scaled(joint_.functions[f], inverse_.across(f, f)), C);
    }
  }
  void tell_pairs() {
    for (std::size_t k = 0; k < joint_.of_pair.size(); ++k) {
      poll_cancelled();
      const auto [a, b] = joint_.of_pair[k];
      const Covariance6 common = unscaled(a, b);
      Covariance6& C = out_.pairs.emplace_back(common);
      for (double& x : C) x *= variance_;
      out_.distances.push_back(
          distance_of(options_.image_pairs[k], unscaled(a, a), common, unscaled(b, b)));
      if (is_determined(joint_.functions[a]) && is_determined(joint_.functions[b])) continue;
      C.fill(std::numeric_limits<double>::quiet_NaN());
      out_.distances.back().sigma = kInfinite;
    }
  }
  bool is_determined(const LinearFunction& function) const {
    for (const LinearPart& part : function.parts)
      for (std::int32_t c = blocks_.first[part.block]; c < blocks_.first[part.block + 1]; ++c)
        if (!inverse_.determined(c)) return false;
    return true;
  }
  Covariance6 unscaled(std::size_t a, std::size_t b) const {
    Covariance6 out;
    const std::vector<double> C = inverse_.across(a, b);
    std::copy(C.begin(), C.end(), out.begin());
    return out;
  }
  /// Centres move by -R^T rho: along the unit vector u from one to the other by -(R u) . rho.
  Distance distance_of(const std::array<std::uint32_t, 2>& pair, const Covariance6& of_first,
                       const Covariance6& common, const Covariance6& of_second) const {
    std::array<Matrix3<double>, 2> R;
    std::array<Vector3<double>, 2> centre;
    for (std::size_t k = 0; k < 2; ++k) {
      R[k] = matrix_from_quaternion(problem_.poses[pair[k]].rotation);
      centre[k] = camera_centre(R[k], problem_.poses[pair[k]]);
    }
    Distance out;
    Vector3<double> u{};
    for (std::size_t k = 0; k < 3; ++k) u[k] = centre[1][k] - centre[0][k];
    out.value = std::hypot(u[0], u[1], u[2]);
    if (!(out.value > 0)) return out;
    std::array<Vector3<double>, 2> a{};  // the distance changes by a[0] . rho_0 + a[1] . rho_1
    for (std::size_t k = 0; k < 2; ++k)
      for (std::size_t r = 0; r < 3; ++r)
        for (std::size_t c = 0; c < 3; ++c)
          a[k][r] += (k == 0 ? 1 : -1) * R[k][3 * r + c] * u[c] / out.value;
    double variance = 0;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        variance += a[0][r] * of_first[6 * r + c] * a[0][c] +
                    2 * a[0][r] * common[6 * r + c] * a[1][c] +
                    a[1][r] * of_second[6 * r + c] * a[1][c];
    out.sigma = std::sqrt(std::max(0.0, variance_ * variance));
    return out;
  }

  void tell_points() {
    const bool all = options_.point_ids.empty();
    const std::size_t count = all ? problem_.num_points() : options_.point_ids.size();
    out_.points.resize(count);
    std::vector<std::uint8_t> lost(count, 0);
    // Single solves take all threads by themselves.
    const std::size_t grain = factored_ != nullptr ? 256 : count + 1;
    threads_.for_ranges(count, grain, [&](std::size_t k, std::size_t end) {
      NormalEquations::Point point;
      for (; k < end && !is_cancelled(); ++k) {
        const std::size_t p = all ? k : options_.point_ids[k];
        const auto kept = std::lower_bound(blocks_.kept.begin(), blocks_.kept.end(), p);
        if (kept != blocks_.kept.end() && *kept == p) {
          const std::uint32_t block =
              blocks_.kept_block[static_cast<std::size_t>(kept - blocks_.kept.begin())];
          const std::vector<double> C = scaled(function_of_block(block, 3));
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
    poll_cancelled();
    out_.undetermined_points =
        static_cast<std::uint64_t>(std::count(lost.begin(), lost.end(), std::uint8_t(1)));
  }

  void tell_observations() {
    out_.observations.resize(problem_.num_observations());
    threads_.for_ranges(problem_.num_points(), 256, [&](std::size_t p, std::size_t end) {
      NormalEquations::Point point;
      ObservationRows::Row row;
      for (; p < end && !is_cancelled(); ++p) {
        if (equations_.begin_of(p) == equations_.end_of(p)) continue;
        equations_.point(p, point);
        for (const std::uint64_t* i = equations_.begin_of(p); i != equations_.end_of(p); ++i) {
          equations_.rows().evaluate(*i, row);
          out_.observations[*i] = reliability(point, row);
        }
      }
    });
    poll_cancelled();
  }
  ObservationReliability reliability(const NormalEquations::Point& point,
                                     const ObservationRows::Row& row) const {
    const double w = equations_.weight_of(row);
    const std::array<double, 4> fit = factored_->of_fit(point, row, equations_.points_held());
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
  const Inverse& inverse_;
  const InverseNormal* factored_;  ///< null: by single solves, for what is named
  const JointFunctions& joint_;
  Threads& threads_;
  const ParameterBlocks& blocks_;
  const double variance_;
  Covariance& out_;
  const std::function<bool()>* const cancelled_ = cancel_question();
};

}  // namespace

void tell(const Problem& problem, const CovarianceOptions& options, NormalEquations& equations,
          const Inverse& inverse, const InverseNormal* factored, const JointFunctions& joint,
          Threads& threads, Covariance& out) {
  Telling(problem, options, equations, inverse, factored, joint, threads, out).run();
}

}  // namespace sheaf
