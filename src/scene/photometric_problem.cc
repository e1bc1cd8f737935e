// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include "sheaf/photometric.h"

namespace sheaf {
namespace {

struct Square {
  const char* name;
  int first, last;
};
constexpr Square kSquares[] = {{"4x4", -2, 1}, {"3x3", -1, 1}, {"5x5", -2, 2}, {"6x6", -3, 2},
                               {"7x7", -3, 3}, {"8x8", -4, 3}, {"9x9", -4, 4}};

Error wrong(const std::string& what) { return Error(ErrorCode::usage, what); }

std::string entry(const char* what, std::size_t i) { return what + (" " + std::to_string(i)); }

bool all_finite(const double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    if (!std::isfinite(values[i])) return false;
  return true;
}

Result<void> check_images(const PhotometricProblem& p) {
  const Pinhole& k = p.camera;
  const double intrinsics[4] = {k.fx, k.fy, k.cx, k.cy};
  if (!all_finite(intrinsics, 4) || k.fx == 0 || k.fy == 0)
    return wrong("the intrinsics fx, fy, cx, cy are not finite, or a focal length is 0");
  if (p.images.empty()) return wrong("the problem has no images");
  if (p.images.size() != p.poses.size())
    return wrong(std::to_string(p.images.size()) + " images, but " +
                 std::to_string(p.poses.size()) + " poses");
  for (std::size_t i = 0; i < p.images.size(); ++i) {
    const GreyImage& image = p.images[i];
    if (image.width < 16 || image.height < 16 ||
        image.pixels.size() != std::size_t(image.width) * std::size_t(image.height))
      return wrong(entry("image", i) + " has fewer than 16 x 16 pixels, or not width x height");
    const Pose& pose = p.poses[i];
    double norm2 = 0;
    for (double q : pose.rotation) norm2 += q * q;
    if (!(std::abs(norm2 - 1) < 1e-6)) return wrong(entry("pose", i) + ": not a unit quaternion");
    if (!all_finite(pose.translation.data(), 3)) return wrong(entry("pose", i) + " is not finite");
  }
  if (!p.brightness.empty() && p.brightness.size() != p.images.size())
    return wrong("brightness of " + std::to_string(p.brightness.size()) + " images, not of all");
  for (std::size_t i = 0; i < p.brightness.size(); ++i)
    if (!(p.brightness[i].a > 0) || !std::isfinite(p.brightness[i].a + p.brightness[i].b))
      return wrong(entry("brightness", i) + ": a is not above 0, or not finite");
  return {};
}

Result<void> check_sights(const PhotometricProblem& p) {
  if (p.sight_point.size() != p.sight_image.size())
    return wrong("sights are not one point and one image each");
  for (std::size_t i = 0; i < p.sight_point.size(); ++i) {
    const std::uint32_t point = p.sight_point[i], image = p.sight_image[i];
    if (point >= p.num_points() || image >= p.images.size())
      return wrong(entry("sight", i) + ": no such point or image");
    if (i > 0 && (point < p.sight_point[i - 1] ||
                  (point == p.sight_point[i - 1] && image <= p.sight_image[i - 1])))
      return wrong(entry("sight", i) + " is not in the order of points and their images");
  }
  return {};
}

Result<void> check_references(const PhotometricProblem& p) {
  const std::size_t points = p.num_points();
  if (p.points.size() != 3 * points || points == 0)
    return wrong("the problem has no points, or not three numbers for each");
  for (std::size_t i = 0; i < points; ++i)
    if (!all_finite(&p.points[3 * i], 3)) return wrong(entry("point", i) + " is not finite");
  if (!p.has_hosts() && p.patches.empty())
    return wrong("points need stored patches, or host images to take them from");
  if (!p.patches.empty()) {
    if (p.patch.size() == 0 || p.patch.dx.size() != p.patch.dy.size() ||
        p.patches.size() != points * p.patch.size())
      return wrong("the stored patches are not patch.size() grey levels for each point");
    for (std::size_t i = 0; i < p.patches.size(); ++i)
      if (!std::isfinite(p.patches[i]))
        return wrong(entry("the patch of point", i / p.patch.size()) + " is not finite");
  }
  if (Result<void> sights = check_sights(p); !sights.ok()) return sights;
  if (!p.has_hosts()) return {};
  if (p.host.size() != points || p.host_xy.size() != 2 * points)
    return wrong("hosts are not one image and one pixel for each point");
  for (std::size_t i = 0; i < points; ++i) {
    const double x = p.host_xy[2 * i], y = p.host_xy[2 * i + 1];
    if (p.host[i] >= p.images.size() || !(x >= 0 && x <= p.images[p.host[i]].width - 1) ||
        !(y >= 0 && y <= p.images[p.host[i]].height - 1))
      return wrong(entry("the host of point", i) + ": no such image, or a pixel outside of it");
  }
  return {};
}

Result<void> check_measurements(const PhotometricProblem& p) {
  const std::size_t count = p.num_measurements();
  if (p.measured_image.size() != count || p.measured_xy.size() != 2 * count)
    return wrong("measured positions are not one point, one image and one pixel each");
  for (std::size_t i = 0; i < count; ++i)
    if (p.measured_point[i] >= p.num_points() || p.measured_image[i] >= p.images.size() ||
        !all_finite(&p.measured_xy[2 * i], 2))
      return wrong(entry("measured position", i) +
                   ": no such point, no such image, or a pixel that is not finite");
  return {};
}

}  // namespace

std::vector<std::string> pattern_names() {
  std::vector<std::string> names;
  for (const Square& square : kSquares) names.push_back(square.name);
  names.insert(names.end(), {"8", "cross"});
  return names;
}

Result<Pattern> make_pattern(const std::string& name) {
  Pattern out;
  out.name = name;
  // The eight of DSO: a diamond around the middle with one corner left out.
  if (name == "8") {
    out.dx = {-2, -1, -1, 0, 0, 0, 1, 2};
    out.dy = {0, -1, 1, -2, 0, 2, -1, 0};
    return out;
  }
  if (name == "cross") {
    out.dx = {-1, 0, 0, 0, 1};
    out.dy = {0, -1, 0, 1, 0};
    return out;
  }
  std::string known;
  for (const std::string& other : pattern_names()) known += (known.empty() ? "" : ", ") + other;
  for (const Square& square : kSquares) {
    if (name != square.name) continue;
    for (int dx = square.first; dx <= square.last; ++dx)
      for (int dy = square.first; dy <= square.last; ++dy) {
        out.dx.push_back(static_cast<std::int8_t>(dx));
        out.dy.push_back(static_cast<std::int8_t>(dy));
      }
    return out;
  }
  return wrong("no patch pattern is called " + name + "; there are " + known);
}

Result<void> validate(const PhotometricProblem& problem) {
  if (Result<void> images = check_images(problem); !images.ok()) return images;
  if (Result<void> points = check_references(problem); !points.ok()) return points;
  return check_measurements(problem);
}

}  // namespace sheaf
