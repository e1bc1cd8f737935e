// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>

#include "geometry/rigid_motion.h"
#include "platform/random.h"
#include "scene/portable_rotation.h"
#include "scene/wave_surface.h"
#include "sheaf/photometric.h"

namespace sheaf {
namespace {

constexpr double kDepth = WaveSurface::kDepth;
constexpr double kSpread = 0.4;  ///< radius of the circle that the cameras stand on
constexpr double kRoll_rad = 0.05;
constexpr int kMargin_px = 12;  ///< hosts' pixels keep away from the border
/// Streams of the seed.
enum Stream : std::uint64_t {
  kWaves,
  kPoses,
  kPlaces,
  kNoise,
  kBrightness,
  kStart,
  kOutliers,
  kMeasured
};

Vector3<double> unit(const Vector3<double>& v) {
  const double n = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  return {v[0] / n, v[1] / n, v[2] / n};
}

Vector3<double> turn_back(const Matrix3<double>& R, const Vector3<double>& v) {
  return {R[0] * v[0] + R[3] * v[1] + R[6] * v[2], R[1] * v[0] + R[4] * v[1] + R[7] * v[2],
          R[2] * v[0] + R[5] * v[1] + R[8] * v[2]};
}

Pose pose_at(const Quaternion<double>& rotation, const Vector3<double>& centre) {
  const Vector3<double> t = multiply(portable_matrix(rotation), centre);
  return {rotation, {-t[0], -t[1], -t[2]}};
}

Vector3<double> centre_of(const Pose& pose) {
  const Vector3<double> c = turn_back(portable_matrix(pose.rotation), pose.translation);
  return {-c[0], -c[1], -c[2]};
}

/// Around a circle above the surface, looking at its middle.
std::vector<Pose> make_poses(const PhotometricSceneOptions& options) {
  Random random(options.seed, kPoses);
  std::vector<Pose> poses;
  for (std::uint32_t i = 0; i < options.images; ++i) {
    const SineCosine at = portable_sine_cosine(6.283185307179586 * i / options.images);
    const Vector3<double> centre{kSpread * at.cosine, kSpread * at.sine,
                                 -kDepth * random.uniform(0.96, 1.04)};
    const Vector3<double> z = unit({-centre[0], -centre[1], -centre[2]});
    const Vector3<double> x = unit(cross(Vector3<double>{0, 1, 0}, z)), y = cross(z, x);
    const Quaternion<double> looking =
        portable_quaternion(Matrix3<double>{x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]});
    const Quaternion<double> roll =
        portable_quaternion(Vector3<double>{0, 0, random.uniform(-kRoll_rad, kRoll_rad)});
    poses.push_back(pose_at(normalized(multiply(roll, looking)), centre));
  }
  return poses;
}

struct Lens {
  Pinhole camera;
  Pose pose;
  Vector3<double> centre;
  Matrix3<double> R;

  Lens(const Pinhole& camera, const Pose& pose)
      : camera(camera), pose(pose), centre(centre_of(pose)), R(portable_matrix(pose.rotation)) {}
  Vector3<double> ray(double x, double y) const {
    return turn_back(R, {(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, 1});
  }
};

GreyImage render(const PhotometricSceneOptions& options, const WaveSurface& surface,
                 const Lens& lens, const Brightness& look, Random& noise) {
  GreyImage image{options.width, options.height, {}};
  image.pixels.reserve(std::size_t(options.width) * std::size_t(options.height));
  const double corner2 = lens.camera.cx * lens.camera.cx + lens.camera.cy * lens.camera.cy;
  for (int y = 0; y < options.height; ++y)
    for (int x = 0; x < options.width; ++x) {
      const double dx = x - lens.camera.cx, dy = y - lens.camera.cy;
      const double fall = 1 - options.vignette * (dx * dx + dy * dy) / corner2;
      double grey = look.a * fall * surface.hit(lens.centre, lens.ray(x, y)).grey + look.b;
      if (options.noise_grey > 0) grey += options.noise_grey * noise.normal();
      if (options.eight_bit) grey = std::clamp(std::floor(grey + 0.5), 0.0, 255.0);
      image.pixels.push_back(static_cast<float>(grey));
    }
  return image;
}

/// Points on pixels of their hosts, in turn, that show the surface.
void place_points(const PhotometricSceneOptions& options, const WaveSurface& surface,
                  const std::vector<Lens>& lenses, PhotometricProblem& truth) {
  Random random(options.seed, kPlaces);
  while (truth.host.size() < options.points) {
    const auto host = static_cast<std::uint32_t>(truth.host.size() % options.images);
    const double x = kMargin_px + static_cast<double>(random.below(
                                      static_cast<std::uint64_t>(options.width - 2 * kMargin_px)));
    const double y = kMargin_px + static_cast<double>(random.below(
                                      static_cast<std::uint64_t>(options.height - 2 * kMargin_px)));
    const Vector3<double> ray = lenses[host].ray(x, y);
    const WaveSurface::Hit hit = surface.hit(lenses[host].centre, ray);
    if (hit.on_occluder) continue;
    for (int d = 0; d < 3; ++d) truth.points.push_back(lenses[host].centre[d] + hit.depth * ray[d]);
    truth.host.push_back(host);
    truth.host_xy.push_back(x);
    truth.host_xy.push_back(y);
  }
}

/// The course's sixteen pixels, as the hosts show them.
void store_patches(PhotometricProblem& truth) {
  truth.patch = make_pattern("4x4").value();
  for (std::size_t i = 0; i < truth.num_points(); ++i) {
    const GreyImage& image = truth.images[truth.host[i]];
    for (std::size_t k = 0; k < truth.patch.size(); ++k) {
      const auto x = static_cast<std::size_t>(truth.host_xy[2 * i] + truth.patch.dx[k]);
      const auto y = static_cast<std::size_t>(truth.host_xy[2 * i + 1] + truth.patch.dy[k]);
      truth.patches.push_back(image.pixels[y * std::size_t(image.width) + x]);
    }
  }
}

/// Where the truth sees points, hosts included, plus noise; inside the images only.
void measure_points(const PhotometricSceneOptions& options, const std::vector<Lens>& lenses,
                    PhotometricProblem& truth) {
  if (options.measured_px < 0) return;
  Random random(options.seed, kMeasured);
  const Pinhole& k = truth.camera;
  for (std::uint32_t i = 0; i < truth.num_points(); ++i)
    for (std::uint32_t j = 0; j < lenses.size(); ++j) {
      const double* X = &truth.points[3 * std::size_t(i)];
      const Vector3<double> P = multiply(lenses[j].R, Vector3<double>{X[0], X[1], X[2]});
      const Vector3<double>& t = lenses[j].pose.translation;
      const double z = P[2] + t[2];
      const double x = k.fx * (P[0] + t[0]) / z + k.cx, y = k.fy * (P[1] + t[1]) / z + k.cy;
      if (!(z > 0 && x >= 0 && y >= 0 && x <= options.width - 1 && y <= options.height - 1))
        continue;
      truth.measured_point.push_back(i);
      truth.measured_image.push_back(j);
      truth.measured_xy.push_back(x + options.measured_px * random.normal());
      truth.measured_xy.push_back(y + options.measured_px * random.normal());
    }
}

/// Poses and depths that are off by `size` times what moves a patch by about a pixel.
PhotometricProblem disturbed(const PhotometricSceneOptions& options,
                             const PhotometricProblem& truth, double size) {
  PhotometricProblem out = truth;
  out.images.clear();
  Random random(options.seed, kStart), wrong(options.seed, kOutliers);
  const double angle = size / truth.camera.fx, length = kDepth * angle;
  for (Pose& pose : out.poses) {
    Vector3<double> centre = centre_of(pose), turn;
    for (double& c : centre) c += length * random.normal();
    for (double& t : turn) t = angle * random.normal();
    pose = pose_at(normalized(multiply(portable_quaternion(turn), pose.rotation)), centre);
  }
  for (std::size_t i = 0; i < out.num_points(); ++i) {
    const Lens before(truth.camera, truth.poses[out.host[i]]);
    const Lens after(truth.camera, out.poses[out.host[i]]);
    const double* X = &truth.points[3 * i];
    double depth =
        before.R[6] * X[0] + before.R[7] * X[1] + before.R[8] * X[2] + before.pose.translation[2];
    depth *= 1 + length / kSpread * random.normal();
    if (wrong.uniform() < options.outliers) depth *= wrong.uniform() < 0.5 ? 0.67 : 1.5;
    const Vector3<double> ray = after.ray(out.host_xy[2 * i], out.host_xy[2 * i + 1]);
    for (int d = 0; d < 3; ++d) out.points[3 * i + d] = after.centre[d] + depth * ray[d];
  }
  return out;
}

/// How far patches are from where the truth sees them, in the median.
double median_offset(const PhotometricProblem& a, const PhotometricProblem& truth) {
  std::vector<double> offsets;
  for (std::size_t i = 0; i < a.num_points(); ++i)
    for (std::size_t j = 0; j < a.poses.size(); ++j) {
      if (a.host[i] == j) continue;
      double x[2][2];
      for (int k = 0; k < 2; ++k) {
        const PhotometricProblem& p = k == 0 ? a : truth;
        const Vector3<double> P =
            multiply(portable_matrix(p.poses[j].rotation),
                     Vector3<double>{p.points[3 * i], p.points[3 * i + 1], p.points[3 * i + 2]});
        const double z = P[2] + p.poses[j].translation[2];
        for (int d = 0; d < 2; ++d)
          x[k][d] = (d == 0 ? p.camera.fx : p.camera.fy) * (P[d] + p.poses[j].translation[d]) / z;
      }
      const double dx = x[0][0] - x[1][0], dy = x[0][1] - x[1][1];
      offsets.push_back(std::sqrt(dx * dx + dy * dy));
    }
  const auto middle = offsets.begin() + static_cast<std::ptrdiff_t>(offsets.size() / 2);
  std::nth_element(offsets.begin(), middle, offsets.end());
  return *middle;
}

Result<void> check(const PhotometricSceneOptions& o) {
  const auto usage = [](const std::string& text) { return Error(ErrorCode::usage, text); };
  if (o.images < 2) return usage("a photometric scene needs at least 2 images");
  if (o.points < 1) return usage("a photometric scene needs at least 1 point");
  if (o.width < 64 || o.height < 64 || o.width > 20000 || o.height > 20000)
    return usage("images of a photometric scene are 64 to 20000 pixels wide and high");
  if (!(o.wavelength_px >= 2)) return usage("waves shorter than 2 px cannot be seen");
  if (!(o.relief >= 0 && o.relief <= 0.2)) return usage("the relief is 0 to 0.2");
  if (!(o.vignette >= 0 && o.vignette < 1)) return usage("the vignette is 0 to below 1");
  if (!(o.outliers >= 0 && o.outliers <= 1)) return usage("outliers are 0 to 1 of the points");
  if (!(o.brightness >= 0 && o.brightness <= 0.5)) return usage("the brightness is 0 to 0.5");
  if (!(o.noise_grey >= 0 && std::isfinite(o.noise_grey)))
    return usage("the noise is negative or not finite");
  if (!std::isfinite(o.measured_px)) return usage("the noise of measured positions is not finite");
  if (!(o.start_px >= 0 && o.start_px <= 100)) return usage("the start is 0 to 100 pixels away");
  return {};
}

}  // namespace

Result<PhotometricScene> generate(const PhotometricSceneOptions& options) {
  if (Result<void> valid = check(options); !valid.ok()) return valid.error();
  PhotometricScene scene;
  PhotometricProblem& truth = scene.truth;
  const double focal = 0.9 * options.width;
  truth.camera = {focal, focal, (options.width - 1) / 2.0, (options.height - 1) / 2.0};
  truth.poses = make_poses(options);
  const WaveSurface surface(options, focal, Random(options.seed, kWaves));
  std::vector<Lens> lenses;
  for (const Pose& pose : truth.poses) lenses.emplace_back(truth.camera, pose);
  place_points(options, surface, lenses, truth);
  Random looks(options.seed, kBrightness), noise(options.seed, kNoise);
  for (std::uint32_t i = 0; i < options.images; ++i) {
    const double a = looks.uniform(-1, 1), b = looks.uniform(-1, 1), size = options.brightness;
    // The first image's is (1, 0): hosts and targets tell brightness between images only.
    truth.brightness.push_back(i == 0 ? Brightness{} : Brightness{1 + size * a, 40 * size * b});
    truth.images.push_back(render(options, surface, lenses[i], truth.brightness[i], noise));
  }
  store_patches(truth);
  measure_points(options, lenses, truth);
  const double unit_px = median_offset(disturbed(options, truth, 1e-3), truth);
  scene.start = disturbed(options, truth, options.start_px * 1e-3 / unit_px);
  scene.start.images = truth.images;
  scene.start.brightness.assign(options.images, {});
  return scene;
}

}  // namespace sheaf
