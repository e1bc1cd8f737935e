// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "geometry/camera_model.h"
#include "geometry/rotation.h"

namespace sheaf {
namespace {

using Colour = std::array<std::uint8_t, 3>;

constexpr Colour kGreyPoint{150, 150, 150};
constexpr Colour kGreyFrustum{110, 110, 110};
constexpr Colour kFrustum{240, 90, 30};
constexpr std::size_t kFrustumVertices = 5;
constexpr std::array<std::array<std::uint32_t, 2>, 8> kFrustumEdges{
    {{0, 1}, {0, 2}, {0, 3}, {0, 4}, {1, 2}, {2, 3}, {3, 4}, {4, 1}}};
constexpr std::size_t kSample = 512;  // cameras or points that a scale is estimated from

/// Little-endian bytes, handed on in large pieces.
class BinaryBuffer {
 public:
  explicit BinaryBuffer(OutputFile& out) : out_(out) {}
  ~BinaryBuffer() { flush(); }

  void put(std::uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) bytes_.push_back(static_cast<char>(word >> shift));
  }
  void put(const Colour& colour) {
    for (std::uint8_t c : colour) bytes_.push_back(static_cast<char>(c));
    if (bytes_.size() > 1 << 18) flush();
  }
  void put(const Vector3<double>& position) {
    constexpr double kMost = std::numeric_limits<float>::max();
    for (double x : position)
      put(std::bit_cast<std::uint32_t>(static_cast<float>(std::clamp(x, -kMost, kMost))));
  }

 private:
  void flush() {
    out_.write(bytes_.data(), bytes_.size());
    bytes_.clear();
  }
  OutputFile& out_;
  std::vector<char> bytes_;
};

/// R^T v for the pose's R.
Vector3<double> world_from_cam_direction(const Pose& pose, const Vector3<double>& v) {
  const auto& q = pose.rotation;
  return multiply(matrix_from_quaternion<double>({q[0], -q[1], -q[2], -q[3]}), v);
}

Vector3<double> centre_of(const Pose& pose) {
  const auto& t = pose.translation;
  return world_from_cam_direction(pose, {-t[0], -t[1], -t[2]});
}

Vector3<double> point_at(const Problem& problem, std::size_t i) {
  return {problem.points[3 * i], problem.points[3 * i + 1], problem.points[3 * i + 2]};
}

double distance(const Vector3<double>& a, const Vector3<double>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/// The value below which the given part of the finite ones lies; 0 of none.
double quantile(std::vector<double> values, double part) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return 0;
  const auto nth =
      values.begin() + static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// Indices spread evenly over [0, count), at most kSample.
std::vector<std::size_t> spread(std::size_t count) {
  std::vector<std::size_t> indices;
  const std::size_t step = count / kSample + 1;
  for (std::size_t i = 0; i < count; i += step) indices.push_back(i);
  return indices;
}

/// Median distance from a camera to the one nearest to it, among those that do not coincide.
double camera_spacing(const std::vector<Vector3<double>>& centres) {
  std::vector<double> nearest;
  for (std::size_t i : spread(centres.size())) {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& other : centres)
      if (const double d = distance(centres[i], other); d > 0) least = std::min(least, d);
    if (std::isfinite(least)) nearest.push_back(least);
  }
  return quantile(std::move(nearest), 0.5);
}

/// Median distance of the points from their componentwise median.
double scene_radius(const Problem& problem) {
  const std::vector<std::size_t> sample = spread(problem.num_points());
  Vector3<double> middle{};
  for (std::size_t k = 0; k < 3; ++k) {
    std::vector<double> values;
    for (std::size_t i : sample) values.push_back(problem.points[3 * i + k]);
    middle[k] = quantile(std::move(values), 0.5);
  }
  std::vector<double> distances;
  for (std::size_t i : sample) distances.push_back(distance(point_at(problem, i), middle));
  return quantile(std::move(distances), 0.5);
}

/// Distance from a frustum's centre to its image plane: half the spacing of the cameras, held
/// between 1% and 10% of the scene so that neither photo bursts nor lone cameras spoil the view.
double frustum_depth(const Problem& problem, const std::vector<Vector3<double>>& centres) {
  const double spacing = camera_spacing(centres), radius = scene_radius(problem);
  const double depth =
      radius > 0 ? std::clamp(spacing / 2, 0.01 * radius, 0.1 * radius) : spacing / 2;
  return depth > 0 && std::isfinite(depth) ? depth : 1;
}

/// Half width and half height of each image in pixels: as the lens states them, or as far as its
/// observations reach from the principal point.
std::vector<std::array<double, 2>> half_sizes(const Problem& problem) {
  std::vector<std::array<double, 2>> half(problem.num_images(), {0, 0});
  for (std::size_t i = 0; i < problem.num_observations(); ++i) {
    const std::uint32_t image = problem.observation_image[i];
    const Camera& camera = problem.cameras[problem.image_camera[image]];
    const ParameterRoles roles = roles_of(camera.model);
    for (std::size_t k = 0; k < 2; ++k) {
      const int c = k == 0 ? roles.cx : roles.cy;
      const double middle = c < 0 ? 0 : camera.parameters[static_cast<std::size_t>(c)];
      half[image][k] =
          std::max(half[image][k], std::abs(problem.observation_xy[2 * i + k] - middle));
    }
  }
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    const Camera& camera = problem.cameras[problem.image_camera[j]];
    if (camera.width_px > 0 && camera.height_px > 0)
      half[j] = {static_cast<double>(camera.width_px) / 2,
                 static_cast<double>(camera.height_px) / 2};
  }
  return half;
}

/// BAL's cameras look along -z with y up, all others along +z with y down.
double forward(const Problem& problem, std::size_t image) {
  return problem.cameras[problem.image_camera[image]].model == CameraModel::bal ? -1 : 1;
}

/// From the mean of the cameras' upward (y) axes: heights show more than any axis of the file.
std::vector<double> heights(const Problem& problem) {
  Vector3<double> up{};
  for (std::size_t j = 0; j < problem.num_images(); ++j) {
    const Vector3<double> y =
        world_from_cam_direction(problem.poses[j], {0, -forward(problem, j), 0});
    for (std::size_t k = 0; k < 3; ++k) up[k] += y[k];
  }
  std::vector<double> height(problem.num_points());
  for (std::size_t i = 0; i < height.size(); ++i) {
    const Vector3<double> p = point_at(problem, i);
    height[i] = up[0] * p[0] + up[1] * p[1] + up[2] * p[2];
  }
  return height;
}

/// From deep blue over green to yellow; s in [0, 1].
Colour ramp(double s) {
  constexpr std::array<std::array<double, 3>, 5> kStops{
      {{70, 50, 130}, {50, 100, 142}, {33, 145, 140}, {95, 201, 98}, {250, 230, 60}}};
  const double x = 4 * std::clamp(std::isnan(s) ? 0.5 : s, 0.0, 1.0);
  const std::size_t i = std::min<std::size_t>(3, static_cast<std::size_t>(x));
  Colour colour;
  for (std::size_t k = 0; k < 3; ++k)
    colour[k] = static_cast<std::uint8_t>(std::lround(
        kStops[i][k] + (x - static_cast<double>(i)) * (kStops[i + 1][k] - kStops[i][k])));
  return colour;
}

std::vector<Vector3<double>> centres_of(const Problem& problem) {
  std::vector<Vector3<double>> centres;
  centres.reserve(problem.num_images());
  for (const Pose& pose : problem.poses) centres.push_back(centre_of(pose));
  return centres;
}

/// In the scene's own colours where it has them, else by height; or all grey.
void put_points(const Problem& problem, bool grey, BinaryBuffer& out) {
  const auto* own = !grey && problem.metadata && !problem.metadata->point_colours.empty()
                        ? &problem.metadata->point_colours
                        : nullptr;
  const std::vector<double> height =
      grey || own != nullptr ? std::vector<double>() : heights(problem);
  const double low = quantile(height, 0.05), high = quantile(height, 0.95);
  for (std::size_t i = 0; i < problem.num_points(); ++i) {
    out.put(point_at(problem, i));
    if (own != nullptr) {
      out.put((*own)[i]);
    } else {
      out.put(grey ? kGreyPoint : ramp((height[i] - low) / (high - low)));
    }
  }
}

void put_frusta(const Problem& problem, double depth, const Colour& colour, BinaryBuffer& out) {
  const auto half = half_sizes(problem);
  for (std::size_t i = 0; i < problem.num_images(); ++i) {
    const Vector3<double> centre = centre_of(problem.poses[i]);
    const double f = std::abs(pixels_per_radian(problem.cameras[problem.image_camera[i]]));
    // Undefined where f or the observations are missing or absurd: then an ordinary lens.
    auto slope = [&](double half_px, double ordinary) {
      const double s = half_px / f;
      return s > 0.05 && s < 2 ? s : ordinary;
    };
    const double x = depth * slope(half[i][0], 0.4), y = depth * slope(half[i][1], 0.3);
    out.put(centre);
    out.put(colour);
    for (const auto& [sx, sy] : {std::array{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
      Vector3<double> corner =
          world_from_cam_direction(problem.poses[i], {sx * x, sy * y, forward(problem, i) * depth});
      for (std::size_t k = 0; k < 3; ++k) corner[k] += centre[k];
      out.put(corner);
      out.put(colour);
    }
  }
}

void put_edges(std::size_t images, std::size_t first_vertex, const Colour& colour,
               BinaryBuffer& out) {
  for (std::size_t i = 0; i < images; ++i)
    for (const auto& edge : kFrustumEdges) {
      for (std::uint32_t vertex : edge)
        out.put(static_cast<std::uint32_t>(first_vertex + kFrustumVertices * i) + vertex);
      out.put(colour);
    }
}

std::string header(std::size_t vertices, std::size_t edges) {
  const std::string colour = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  return "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(vertices) +
         "\nproperty float x\nproperty float y\nproperty float z\n" + colour + "element edge " +
         std::to_string(edges) + "\nproperty int vertex1\nproperty int vertex2\n" + colour +
         "end_header\n";
}

/// `before` may be null.
Result<void> write_scene(const Problem* before, const Problem& after, OutputFile& out) {
  const std::size_t points = after.num_points() + (before ? before->num_points() : 0);
  const std::size_t grey_images = before ? before->num_images() : 0;
  const std::size_t images = after.num_images() + grey_images;
  const std::size_t vertices = points + kFrustumVertices * images;
  if (vertices > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
    return Error(ErrorCode::usage,
                 "a PLY file holds at most 2^31 - 1 vertices, not " + std::to_string(vertices));
  const double depth = frustum_depth(after, centres_of(after));
  out.write(header(vertices, kFrustumEdges.size() * images));
  {
    BinaryBuffer body(out);
    if (before) put_points(*before, true, body);
    put_points(after, false, body);
    if (before) put_frusta(*before, depth, kGreyFrustum, body);
    put_frusta(after, depth, kFrustum, body);
    put_edges(grey_images, points, kGreyFrustum, body);
    put_edges(after.num_images(), points + kFrustumVertices * grey_images, kFrustum, body);
  }
  return out.commit();
}

}  // namespace

Result<void> write_ply(const Problem& problem, OutputFile& out) {
  return write_scene(nullptr, problem, out);
}

Result<void> write_ply(const Problem& before, const Problem& after, OutputFile& out) {
  return write_scene(&before, after, out);
}

}  // namespace sheaf
