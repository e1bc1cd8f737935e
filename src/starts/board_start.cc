// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// A view of a plane in bearings d of its corners (X, Y): d x (H (X, Y, 1)) = 0 with H = (r1 r2 t),
// up to a factor (Zhang 2000, section 3, with bearings in the place of pixels, so that any lens
// will do).
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "geometry/camera_model.h"
#include "geometry/loss.h"
#include "scene/portable_rotation.h"
#include "sheaf/board.h"
#include "starts/bearing.h"
#include "starts/sights.h"

namespace sheaf {
namespace {

constexpr std::size_t kFewest = 6;
using Corner = std::array<double, 2>;

Corner place_of(const Board& board, std::uint32_t corner) {
  return {board.spacing * (corner % board.columns), board.spacing * (corner / board.columns)};
}

/// The middle of a view's corners and their mean distance from it.
struct Frame {
  Corner middle{};
  double size = 0;
};
Frame frame_of(const Board& board, const BoardView& view) {
  Frame out;
  const double count = static_cast<double>(view.corners.size());
  for (const std::uint32_t k : view.corners)
    for (std::size_t c = 0; c < 2; ++c) out.middle[c] += place_of(board, k)[c] / count;
  for (const std::uint32_t k : view.corners) {
    const Corner at = place_of(board, k);
    out.size += std::hypot(at[0] - out.middle[0], at[1] - out.middle[1]) / count;
  }
  return out;
}

/// Whether a line goes through all corners of a view.
bool in_a_line(const Board& board, const BoardView& view) {
  const Frame frame = frame_of(board, view);
  double xx = 0, xy = 0, yy = 0;
  for (const std::uint32_t k : view.corners) {
    const Corner at = place_of(board, k);
    const double x = at[0] - frame.middle[0], y = at[1] - frame.middle[1];
    xx += x * x, xy += x * y, yy += y * y;
  }
  return xx * yy - xy * xy < 1e-9 * (xx + yy) * (xx + yy);
}

/// cam_from_board through a lens; nothing where too few corners have a bearing.
std::optional<Pose> pose_of_view(const Board& board, const BoardView& view, const Camera& lens) {
  const Frame frame = frame_of(board, view);
  Eigen::Matrix<double, 9, 9> sum = Eigen::Matrix<double, 9, 9>::Zero();
  std::vector<std::array<Eigen::Vector3d, 2>> seen;  // bearing, place
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    const auto d = bearing(lens, view.xy[i].data());
    if (!d) continue;
    const Corner at = place_of(board, view.corners[i]);
    const Eigen::Vector3d X((at[0] - frame.middle[0]) / frame.size,
                            (at[1] - frame.middle[1]) / frame.size, 1);
    const Eigen::Vector3d ray((*d)[0], (*d)[1], (*d)[2]);
    seen.push_back({ray, X});
    Eigen::Matrix3d across;
    across << 0, -ray[2], ray[1], ray[2], 0, -ray[0], -ray[1], ray[0], 0;
    Eigen::Matrix<double, 3, 9> rows;
    for (int c = 0; c < 3; ++c) rows.block<3, 3>(0, 3 * c) = across * X[c];
    sum += rows.transpose() * rows;
  }
  if (seen.size() < kFewest) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(sum);
  const Eigen::Matrix<double, 9, 1> h = solver.eigenvectors().col(0);
  Eigen::Matrix3d H = Eigen::Map<const Eigen::Matrix3d>(h.data());  // columns r1, r2, t
  double before = 0;
  for (const auto& [ray, X] : seen) before += ray.dot(H * X) > 0 ? 1 : -1;
  const double length = std::sqrt(H.col(0).norm() * H.col(1).norm());
  if (!(length > 0) || !std::isfinite(length)) return std::nullopt;
  H *= (before < 0 ? -1 : 1) / length;
  Eigen::Matrix3d R;
  R << H.col(0), H.col(1), H.col(0).cross(H.col(1));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(R, Eigen::ComputeFullU | Eigen::ComputeFullV);
  R = svd.matrixU() * svd.matrixV().transpose();
  if (R.determinant() < 0) R.col(2) *= -1;
  // From the view's own place and size to the board's.
  const Eigen::Vector3d t =
      frame.size * H.col(2) - R * Eigen::Vector3d(frame.middle[0], frame.middle[1], 0);
  Matrix3<double> rotation;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) rotation[static_cast<std::size_t>(3 * r + c)] = R(r, c);
  return Pose{portable_quaternion(rotation), {t[0], t[1], t[2]}};
}

/// 1/2 sum of |r|^2 over a view, px^2; infinite where the lens does not see a corner.
double cost_of_view(const Board& board, const BoardView& view, const Camera& lens,
                    const Pose& pose) {
  const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
  Fit fit;
  for (std::size_t i = 0; i < view.corners.size(); ++i) {
    const Corner at = place_of(board, view.corners[i]);
    const double X[] = {at[0], at[1], 0};
    fit += fit_of(lens, in_camera(R, pose, X), view.xy[i].data(), {LossKind::none, 1, 1});
  }
  return fit.behind > 0 ? std::numeric_limits<double>::infinity() : fit.cost;
}

/// The lens with a focal length and no distortion, and what a start by it costs: of each view no
/// more than its corners' spread over the image.
struct Trial {
  Camera lens;
  std::vector<std::optional<Pose>> poses;
  double cost = 0;
};
Trial try_focal(const Board& board, const std::vector<BoardView>& views, const Camera& model,
                double focal) {
  Trial out{model, {}, 0};
  const ParameterRoles roles = roles_of(model.model);
  for (const int k : {roles.fx, roles.fy})
    if (k >= 0) out.lens.parameters[static_cast<std::size_t>(k)] = focal;
  const double worst = static_cast<double>(model.width_px) * static_cast<double>(model.width_px);
  for (const BoardView& view : views) {
    out.poses.push_back(pose_of_view(board, view, out.lens));
    const double most = worst * static_cast<double>(view.corners.size());
    out.cost += out.poses.back()
                    ? std::min(most, cost_of_view(board, view, out.lens, *out.poses.back()))
                    : most;
  }
  return out;
}

Error usage(const std::string& text) { return Error(ErrorCode::usage, text); }

Result<void> check(const Board& board, const std::vector<BoardView>& views, const Camera& lens) {
  if (board.columns < 2 || board.rows < 2 || std::uint64_t(board.columns) * board.rows > 1000000)
    return usage("a board has two to a million corners in rows and columns of at least two");
  if (!(board.spacing > 0) || !std::isfinite(board.spacing))
    return usage("the spacing of a board must be finite and above 0");
  if (lens.width_px == 0 || lens.height_px == 0)
    return usage("a calibration needs the size of the images");
  if (lens.model == CameraModel::bal)
    return usage("a calibration needs a lens with a principal point, which BAL has not");
  if (image_size(lens.model) != 0)
    return usage("a calibration needs a lens, and EQUIRECTANGULAR has no parameter of one");
  for (const BoardView& view : views) {
    if (view.xy.size() != view.corners.size() || view.sigma.size() != view.corners.size())
      return usage("view " + view.image + ": as many corners, pixels and sigmas are needed");
    for (const std::uint32_t k : view.corners)
      if (k >= board.columns * board.rows)
        return usage("view " + view.image + ": found corner " + std::to_string(k) +
                     ", expected one below " + std::to_string(board.columns * board.rows));
  }
  return {};
}

Problem problem_of(const Board& board, const std::vector<BoardView>& views, const Trial& start,
                   std::vector<std::string>* left_out) {
  Problem out;
  out.cameras.push_back(start.lens);
  for (std::uint32_t k = 0; k < board.columns * board.rows; ++k)
    out.add_point(place_of(board, k)[0], place_of(board, k)[1], 0);
  auto metadata = std::make_shared<SceneMetadata>();
  bool weighted = false;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!start.poses[v]) {
      if (left_out != nullptr) left_out->push_back(views[v].image);
      continue;
    }
    const std::uint32_t image = out.add_image(*start.poses[v], std::uint32_t(0));
    metadata->image_names.push_back(views[v].image);
    for (std::size_t i = 0; i < views[v].corners.size(); ++i) {
      out.add_observation(image, views[v].corners[i], views[v].xy[i][0], views[v].xy[i][1]);
      out.observation_sigma.push_back(views[v].sigma[i]);
      weighted |= views[v].sigma[i] != 1;
    }
  }
  if (!weighted) out.observation_sigma.clear();
  out.metadata = metadata;
  return out;
}

}  // namespace

Result<Problem> calibration_of(const Board& board, const std::vector<BoardView>& views,
                               const Camera& lens, std::vector<std::string>* left_out) {
  if (const Result<void> good = check(board, views, lens); !good.ok()) return good.error();
  std::vector<BoardView> usable;
  for (const BoardView& view : views)
    if (view.corners.size() >= kFewest && !in_a_line(board, view))
      usable.push_back(view);
    else if (left_out != nullptr)
      left_out->push_back(view.image);
  Camera model = without_distortion(lens);
  const ParameterRoles roles = roles_of(lens.model);
  const double width = static_cast<double>(lens.width_px);
  model.parameters[static_cast<std::size_t>(roles.cx)] = 0.5 * width;
  model.parameters[static_cast<std::size_t>(roles.cy)] = 0.5 * static_cast<double>(lens.height_px);
  const double stated = lens.parameters[static_cast<std::size_t>(roles.fx)];
  std::optional<Trial> best;
  if (stated > 0) {
    best = try_focal(board, usable, model, stated);
  } else {
    constexpr double kShortest = 0.15, kLongest = 8, kStep = 1.12;
    for (double f = kShortest; f < kLongest; f *= kStep) {
      Trial trial = try_focal(board, usable, model, f * width);
      if (!best || trial.cost < best->cost) best = std::move(trial);
    }
  }
  Problem out = problem_of(board, usable, *best, left_out);
  if (out.poses.empty())
    return usage(
        "no view shows the board well enough for a start: six corners or more, not in a "
        "line");
  return out;
}

}  // namespace sheaf
