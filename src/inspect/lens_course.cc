// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/lens_course.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "geometry/camera_model.h"

namespace sheaf {
namespace {

constexpr double kRadians = std::numbers::pi / 180;
constexpr double kLeastHalf_rad = 0.25 * kRadians, kMostHalf_rad = 87.5 * kRadians;
constexpr double kMostFactor = 10;
constexpr double kLookedAt = 0.9;  ///< of the edge's distance
constexpr int kSteps = 64;  ///< of a course whose edge is where it would be without distortion

/// A ray that has the distance m from the axis is at the angle atan(m) in `plane`, m in `angle`.
/// Polynomials of m are `polynomial`; their distortion is absent where coefficients are 0.
struct Family {
  bool plane = true, polynomial = true;
};

Family family_of(CameraModel model) {
  switch (model) {
    case CameraModel::bal:
    case CameraModel::simple_pinhole:
    case CameraModel::pinhole:
    case CameraModel::simple_radial:
    case CameraModel::radial:
    case CameraModel::opencv:
    case CameraModel::full_opencv:
    case CameraModel::radial_k3:
      return {true, true};
    case CameraModel::opencv_fisheye:
    case CameraModel::simple_radial_fisheye:
    case CameraModel::radial_fisheye:
    case CameraModel::thin_prism_fisheye:
    case CameraModel::rad_tan_thin_prism_fisheye:
    case CameraModel::simple_fisheye:
    case CameraModel::fisheye:
      return {false, true};
    case CameraModel::fov:
    case CameraModel::eucm:
    case CameraModel::simple_division:
    case CameraModel::division:
    case CameraModel::double_sphere:
    case CameraModel::ucm:
    case CameraModel::equirectangular:
      break;
  }
  return {false, false};
}

/// Rays of one half plane by their distance m from the axis, and how far out their pixels are.
class HalfPlane {
 public:
  HalfPlane(const Camera& camera, const std::array<double, 2>& edge)
      : camera_(camera), family_(family_of(camera.model)) {
    const ParameterRoles roles = roles_of(camera.model);
    const auto parameter = [&](int i) {
      return i < 0 ? 0.0 : camera.parameters[static_cast<std::size_t>(i)];
    };
    centre_ = {parameter(roles.cx), parameter(roles.cy)};
    const double x = edge[0] / parameter(roles.fx), y = edge[1] / parameter(roles.fy);
    edge_ = std::hypot(x, y);
    edge_px_ = std::hypot(edge[0], edge[1]);
    ray_ = {x / edge_, y / edge_};
    outward_ = {edge[0] / edge_px_, edge[1] / edge_px_};
  }

  double edge() const { return edge_; }        ///< m that meets the offset without distortion
  double edge_px() const { return edge_px_; }  ///< its pixel's distance
  const Family& family() const { return family_; }

  /// Distance of the pixel at m from the principal point, and whether the camera sees there.
  struct Pixel {
    double out_px;
    bool seen;
  };
  Pixel at(double m) const {
    std::array<double, 3> P = {m * ray_[0], m * ray_[1], 1};
    if (!family_.plane) P = {std::sin(m) * ray_[0], std::sin(m) * ray_[1], std::cos(m)};
    if (camera_.model == CameraModel::bal) P[2] = -P[2];
    const Projected u = project(camera_, P);
    return {(u.pixel[0] - centre_[0]) * outward_[0] + (u.pixel[1] - centre_[1]) * outward_[1],
            u.before};
  }
  /// What distortion multiplies the distance of the pixel at m by.
  double factor(double m) const { return at(m).out_px / (m * edge_px_ / edge_); }

 private:
  const Camera& camera_;
  Family family_;
  std::array<double, 2> centre_{}, ray_{}, outward_{};
  double edge_ = 0, edge_px_ = 0;
};

struct Walk {
  LensCourse course;
  double m;  ///< of the last ray that was met
};

/// Whether all directions are alike to a model, which has neither a focal length nor an edge.
bool has_no_axis(const Camera& camera) { return roles_of(camera.model).fx < 0; }

/// Steps outward until the pixels reach the distance, turn back, or rays end.
Walk walk(const HalfPlane& rays, double distance_px) {
  const double last_ray = rays.family().plane
                              ? kMostFactor * rays.edge()
                              : std::min(kMostFactor * rays.edge(), 0.999 * std::numbers::pi);
  double step = std::min(rays.edge(), last_ray) / kSteps;
  const double least_step = 1e-6 * step;
  double m = 0, out_px = 0;
  while (step > least_step) {
    const HalfPlane::Pixel next = rays.at(m + step);
    if (m + step > last_ray || !next.seen) {  // the end of the view lies within this step
      step /= 2;
      continue;
    }
    if (!(next.out_px > out_px)) return {LensCourse::folds, m + step};
    m += step;
    out_px = next.out_px;
    if (out_px >= distance_px) return {LensCourse::sound, m};
  }
  return {LensCourse::ends, m};
}

}  // namespace

bool absurd_focal(const Camera& camera, double half_size_px) {
  const Family family = family_of(camera.model);
  const ParameterRoles roles = roles_of(camera.model);
  for (const int which : {roles.fx, roles.fy}) {
    if (which < 0) return false;
    const double f = camera.parameters[static_cast<std::size_t>(which)];
    if (!(f > 0)) return true;
    if (half_size_px == 0) continue;
    const double edge = half_size_px / f;
    const double least = std::tan(kLeastHalf_rad);
    const double most =
        family.polynomial && !family.plane ? std::numbers::pi : std::tan(kMostHalf_rad);
    if (!(edge >= least && edge <= most)) return true;
  }
  return false;
}

bool outside_model(const Camera& camera) {
  const auto& k = camera.parameters;
  const auto share = [](double alpha) { return alpha >= 0 && alpha <= 1; };
  switch (camera.model) {
    case CameraModel::fov:
      return !(std::abs(k[4]) < std::numbers::pi);
    case CameraModel::eucm:
      return !(share(k[4]) && k[5] > 0);
    case CameraModel::ucm:
      return !share(k[4]);
    case CameraModel::double_sphere:
      return !(std::abs(k[4]) < 1 && share(k[5]));
    case CameraModel::equirectangular:
      return !(k[0] > 0 && k[1] > 0);
    default:
      return false;
  }
}

bool absurd_distortion(const Camera& camera, const std::array<double, 2>& edge) {
  if ((edge[0] == 0 && edge[1] == 0) || has_no_axis(camera)) return false;
  const HalfPlane rays(camera, edge);
  double m = rays.edge();
  if (!rays.family().polynomial) {
    const Walk to_edge = walk(rays, rays.edge_px());
    m = to_edge.m;
    if (to_edge.course == LensCourse::ends && rays.at(m).out_px < rays.edge_px() / kMostFactor)
      return true;
  }
  const double factor = rays.factor(m);
  return !(factor >= 1 / kMostFactor && factor <= kMostFactor);
}

LensCourse course_of(const Camera& camera, const std::array<double, 2>& edge) {
  if ((edge[0] == 0 && edge[1] == 0) || has_no_axis(camera)) return LensCourse::sound;
  const HalfPlane rays(camera, edge);
  return walk(rays, kLookedAt * rays.edge_px()).course;
}

}  // namespace sheaf
