// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "geometry/rotation.h"
#include "image/grey.h"
#include "image/png.h"
#include "io/folder_files.h"
#include "report/errors.h"
#include "sheaf/sheaf.h"

namespace sheaf {
namespace {

Problem shell_of(const std::vector<Pose>& poses) {
  Problem out;
  for (const Pose& pose : poses) out.add_image(pose, Camera{});
  return out;
}

StateErrors distance_of(const std::vector<Pose>& poses, const std::vector<Pose>& others) {
  return compare_states(shell_of(poses), shell_of(others), true).value();
}

/// By how much points miss the depth maps of the images that they are not from, relatively, in the
/// median. Refinement never looks at these.
double depth_gap(const PhotometricFolder& folder, double depth_scale) {
  const PhotometricProblem& p = folder.problem;
  std::vector<Raster> maps;
  for (const auto& file : folder.depth_files)
    maps.push_back(decode_png(bytes_of(file).value(), "depth").value());
  std::vector<double> gaps;
  for (std::size_t k = 0; k < p.sight_point.size(); ++k) {
    const double* X = &p.points[3 * std::size_t(p.sight_point[k])];
    const Pose& pose = p.poses[p.sight_image[k]];
    const Raster& map = maps[p.sight_image[k]];
    Vector3<double> P =
        multiply(matrix_from_quaternion(pose.rotation), Vector3<double>{X[0], X[1], X[2]});
    for (int d = 0; d < 3; ++d) P[d] += pose.translation[d];
    const long x = std::lround(p.camera.fx * P[0] / P[2] + p.camera.cx);
    const long y = std::lround(p.camera.fy * P[1] / P[2] + p.camera.cy);
    if (x < 0 || y < 0 || x >= map.width || y >= map.height) continue;
    const double depth =
        map.samples[std::size_t(y) * std::size_t(map.width) + std::size_t(x)] / depth_scale;
    if (depth > 0) gaps.push_back(std::abs(depth - P[2]) / P[2]);
  }
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  return *middle;
}

/// The sights that `keep(host, image)` takes.
template <class Keep>
PhotometricProblem only(const PhotometricProblem& problem, const Keep& keep) {
  PhotometricProblem out = problem;
  out.sight_point.clear();
  out.sight_image.clear();
  for (std::size_t k = 0; k < problem.sight_point.size(); ++k)
    if (keep(problem.host[problem.sight_point[k]], problem.sight_image[k])) {
      out.sight_point.push_back(problem.sight_point[k]);
      out.sight_image.push_back(problem.sight_image[k]);
    }
  return out;
}

/// At half the size so many times over, with the patches that hosts show there.
PhotometricProblem smaller(PhotometricProblem p, int times) {
  const auto half = [](double x) { return (x - 0.5) / 2; };
  for (int k = 0; k < times; ++k) {
    for (GreyImage& image : p.images) {
      image.pixels = halve(image.width, image.height, image.pixels.data());
      image.width /= 2, image.height /= 2;
    }
    p.camera = {p.camera.fx / 2, p.camera.fy / 2, half(p.camera.cx), half(p.camera.cy)};
    for (double& x : p.host_xy) x = std::max(0.0, half(x));
  }
  p.patch = make_pattern("cross").value();
  for (std::size_t i = 0; i < p.num_points(); ++i)
    for (std::size_t k = 0; k < p.patch.size(); ++k) {
      const GreyImage& image = p.images[p.host[i]];
      const double x = std::clamp(p.host_xy[2 * i] + p.patch.dx[k], 0.0, image.width - 1.001);
      const double y = std::clamp(p.host_xy[2 * i + 1] + p.patch.dy[k], 0.0, image.height - 1.001);
      const std::size_t stride = std::size_t(image.width);
      const float* at = &image.pixels[std::size_t(y) * stride + std::size_t(x)];
      const double a = x - std::floor(x), b = y - std::floor(y);
      p.patches.push_back(static_cast<float>((1 - b) * ((1 - a) * at[0] + a * at[1]) +
                                             b * ((1 - a) * at[stride] + a * at[stride + 1])));
    }
  return p;
}

/// How well the other images foretell a held-out one, whose own pose alone is free: points in the
/// world are held, so that no other pose plays a part. Free of gauge.
PhotometricSummary foretold(const PhotometricProblem& problem, std::uint32_t held_out) {
  PhotometricProblem p = only(problem, [&](std::uint32_t host, std::uint32_t image) {
    return host != held_out && image == held_out;
  });
  PhotometricSummary summary;
  for (int level = 4; level >= 0; --level) {
    PhotometricProblem small = smaller(p, level);
    PhotometricOptions options;
    options.parametrisation = Parametrisation::xyz;
    options.fix_points = true;
    summary = refine_photometric(small, options).value();
    p.poses[held_out] = small.poses[held_out];
    p.brightness = small.brightness;
  }
  return summary;
}

/// Five rendered RGB-D frames of a room, far apart: pairs share a third of what they see, turned by
/// up to 20 degrees and at up to twice the size.
class RgbdFrames : public testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("SHEAF_DATA");
    folder_ = std::filesystem::path(data ? data : "data") / "direct/slambook2-dense-rgbd5";
    if (!std::filesystem::exists(folder_)) GTEST_SKIP() << folder_ << " is not there";
    reading_.camera = Pinhole{481.2, -480, 319.5, 239.5};  // y of the poses points up
    refining_.fix_points = true;
    refining_.levels = 4;
  }
  PhotometricFolder read(const PoseNoise& noise) {
    reading_.noise = noise;
    return read_photometric(folder_, reading_).value();
  }
  static PoseNoise two_centimetres_one_degree(std::uint64_t seed) {
    return {0.0174532925, 0.02, seed};
  }
  std::filesystem::path folder_;
  PhotometricReadOptions reading_;
  PhotometricOptions refining_;
};

// The given poses are no truth: refined from where they are, poses move by 9 mrad and 3 mm, and the
// depth maps, which refinement does not look at, say that this is right. So what disturbed poses
// have to come back to is what the given ones are refined to.
TEST_F(RgbdFrames, DisturbedPosesComeBack) {
  PhotometricFolder given = read({});
  const std::vector<Pose> stated = given.problem.poses;
  const double gap_of_given = depth_gap(given, reading_.depth_scale);
  refine_photometric(given.problem, refining_).value();
  const StateErrors noise = distance_of(given.problem.poses, stated);
  EXPECT_LT(depth_gap(given, reading_.depth_scale), 0.2 * gap_of_given);
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    PhotometricFolder folder = read(two_centimetres_one_degree(seed));
    EXPECT_GT(distance_of(folder.problem.poses, stated).rotation_error_rad.mean, 0.02);
    refine_photometric(folder.problem, refining_).value();
    const StateErrors to_stated = distance_of(folder.problem.poses, stated);
    EXPECT_LT(to_stated.rotation_error_rad.mean, 1.1 * noise.rotation_error_rad.mean);
    EXPECT_LT(to_stated.center_error.mean, 1.2 * noise.center_error.mean);
    const StateErrors apart = distance_of(folder.problem.poses, given.problem.poses);
    EXPECT_LT(apart.rotation_error_rad.mean, 1.5e-3) << seed;
    EXPECT_LT(apart.center_error.mean, 1.5e-3) << seed;
    EXPECT_LT(depth_gap(folder, reading_.depth_scale), 0.2 * gap_of_given) << seed;
    std::printf(
        "[          ] seed %d: from given %.2e rad %.2e, apart %.2e rad %.2e, gap %.2e of %.2e\n",
        int(seed), to_stated.rotation_error_rad.mean, to_stated.center_error.mean,
        apart.rotation_error_rad.mean, apart.center_error.mean,
        depth_gap(folder, reading_.depth_scale), gap_of_given);
  }
}

TEST_F(RgbdFrames, FromFourTimesAsFarOneLevelIsNotEnough) {
  PhotometricFolder folder = read({4 * 0.0174532925, 0.08, 1});
  const std::vector<Pose> stated = folder.given_poses;
  refining_.levels = 1;
  refine_photometric(folder.problem, refining_).value();
  EXPECT_GT(distance_of(folder.problem.poses, stated).center_error.mean, 0.006);
}

// An image without which the others still hang together.
TEST_F(RgbdFrames, AHeldOutImageIsForetoldBetter) {
  const PhotometricProblem start = read(two_centimetres_one_degree(1)).problem;
  for (const std::uint32_t held_out : {3u, 4u}) {
    PhotometricProblem others = only(start, [&](std::uint32_t host, std::uint32_t image) {
      return host != held_out && image != held_out;
    });
    refine_photometric(others, refining_).value();
    EXPECT_EQ(others.poses[held_out].translation, start.poses[held_out].translation);
    PhotometricProblem refined = start;
    refined.poses = others.poses;
    refined.points = others.points;
    const PhotometricSummary before = foretold(start, held_out),
                             after = foretold(refined, held_out);
    EXPECT_LT(after.final_rms_grey, 0.9 * before.final_rms_grey) << held_out;
    EXPECT_LT(after.final_median_grey, 0.7 * before.final_median_grey) << held_out;
  }
}

}  // namespace
}  // namespace sheaf
