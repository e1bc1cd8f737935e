// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/rotation.h"
#include "io/line_cursor.h"
#include "io/rgbd_folder.h"
#include "scene/depth_points.h"

namespace sheaf {
namespace {

/// Copies go to the same place below another folder: a name must not lead out of it.
bool stays_inside(const std::string& name) {
  const std::filesystem::path path(name);
  return path.is_relative() && std::find(path.begin(), path.end(), "..") == path.end() &&
         path.has_filename() && name.find('\0') == std::string::npos;
}

/// X_cam = R^T (X_world - c), of world_from_camera R and c.
Pose inverse_of(const std::array<double, 4>& q, const double* centre) {
  Pose pose;
  pose.rotation = {q[0], -q[1], -q[2], -q[3]};
  const Vector3<double> t = multiply(matrix_from_quaternion(pose.rotation),
                                     Vector3<double>{centre[0], centre[1], centre[2]});
  pose.translation = {-t[0], -t[1], -t[2]};
  return pose;
}

}  // namespace

Result<std::vector<TimedFile>> parse_file_list(std::string_view text, const std::string& name) {
  std::vector<TimedFile> out;
  LineCursor in(text, name);
  while (in.next_record()) {
    TimedFile file;
    if (!in.read_real(file.time)) return in.refuse("a time in seconds, then a file's name");
    file.name = in.rest();
    if (!stays_inside(file.name))
      return in.refuse_as("found " + sheaf::quoted(file.name) +
                          ", expected the name of a file within the folder");
    out.push_back(std::move(file));
  }
  if (out.empty()) return in.refuse_as("found no file, expected lines of a time and a file's name");
  return out;
}

Result<std::vector<TimedPose>> parse_trajectory(std::string_view text, const std::string& name,
                                                bool timed) {
  std::vector<TimedPose> out;
  LineCursor in(text, name);
  while (in.next_record()) {
    TimedPose at;
    at.time = static_cast<double>(out.size());
    if (timed && !in.read_real(at.time)) return in.refuse("a time in seconds, then a pose");
    std::array<double, 7> v;
    for (double& x : v)
      if (!in.read_real(x)) return in.refuse("a finite number of tx ty tz qx qy qz qw");
    if (!in.line_ended()) return in.refuse_as("found more numbers, expected the end of a pose");
    const double norm = std::sqrt(v[3] * v[3] + v[4] * v[4] + v[5] * v[5] + v[6] * v[6]);
    if (!(std::abs(norm - 1) < 1e-3))
      return in.refuse_as("found a quaternion of length " + std::to_string(norm) +
                          ", expected a unit quaternion x y z w");
    at.pose = inverse_of({v[6] / norm, v[3] / norm, v[4] / norm, v[5] / norm}, v.data());
    out.push_back(at);
  }
  if (out.empty())
    return in.refuse_as(std::string("found no pose, expected lines of ") +
                        (timed ? "time tx ty tz qx qy qz qw" : "tx ty tz qx qy qz qw"));
  return out;
}

Result<void> parse_rgbd_hosts(std::string_view text, const std::string& name,
                              PhotometricFolder& folder) {
  PhotometricProblem& problem = folder.problem;
  const std::size_t images = problem.images.size();
  LineCursor in(text, name);
  while (in.next_record()) {
    std::uint32_t image = 0;
    if (!in.read_integer(image) || image >= images)
      return in.refuse("the host image of a point, 0 to " + std::to_string(images - 1));
    std::array<double, 3> v;
    for (double& x : v)
      if (!in.read_real(x)) return in.refuse("a finite number of x y and inverse depth");
    if (!(v[2] > 0) || !std::isfinite(1 / v[2])) return in.refuse("an inverse depth above 0");
    if (!in.line_ended()) return in.refuse_as("found more numbers, expected the end of a point");
    problem.host.push_back(image);
    problem.host_xy.insert(problem.host_xy.end(), {v[0], v[1]});
    problem.points.insert(problem.points.end(), {0, 0, 0});
    place_on_ray(problem, problem.host.size() - 1, 1 / v[2]);
  }
  if (problem.host.empty())
    return in.refuse_as("found no point, expected lines of image, x, y and inverse depth");
  return {};
}

}  // namespace sheaf
