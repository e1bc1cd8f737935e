// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "report/photometric_pictures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "chart/number_text.h"
#include "geometry/rotation.h"
#include "image/interpolation.h"
#include "image/png.h"
#include "report/palette.h"
#include "report/patch_sheet.h"
#include "report/residual_map.h"
#include "sheaf/sheaf.h"

namespace sheaf {
namespace {

Color at(const Raster& raster, int x, int y) {
  const std::size_t place = 3 * (std::size_t(y) * std::size_t(raster.width) + std::size_t(x));
  const auto byte = [&](std::size_t c) { return std::uint8_t(raster.samples[place + c]); };
  return {byte(0), byte(1), byte(2)};
}

/// As a file has it.
Raster decoded(const Image& image) {
  return decode_png(encode_png(image).value(), "picture").value();
}

class PhotometricPictures : public testing::Test {
 protected:
  PhotometricPictures() {
    PhotometricSceneOptions o;
    o.images = 5, o.points = 80, o.width = 160, o.height = 120;
    o.relief = 0.02, o.brightness = 0.1, o.start_px = 1.5, o.noise_grey = 1;
    start_ = generate(o).value().start;
    refined_ = start_;
    refine_photometric(refined_, options_).value();
    after_ = examine_photometric(refined_, options_).value();
    comparison_ =
        compare_patches(refined_, options_,
                        stage_of(start_, options_, examine_photometric(start_, options_).value()),
                        stage_of(refined_, options_, after_))
            .value();
  }

  Vector3<double> camera_point(const PhotometricProblem& p, std::size_t image,
                               const Vector3<double>& X) const {
    Vector3<double> P = multiply(matrix_from_quaternion(p.poses[image].rotation), X);
    for (std::size_t k = 0; k < 3; ++k) P[k] += p.poses[image].translation[k];
    return P;
  }

  /// What an image shows of a point's pixel (dx, dy), by way of the world, in its host's greys.
  double shown(const PhotometricProblem& p, std::size_t point, std::size_t image, int dx,
               int dy) const {
    const std::size_t host = p.host[point];
    const Pinhole& k = p.camera;
    const double depth = camera_point(
        p, host, {p.points[3 * point], p.points[3 * point + 1], p.points[3 * point + 2]})[2];
    const Vector3<double> H = {(p.host_xy[2 * point] + dx - k.cx) / k.fx * depth,
                               (p.host_xy[2 * point + 1] + dy - k.cy) / k.fy * depth, depth};
    const auto& q = p.poses[host].rotation;
    Vector3<double> X;
    for (std::size_t d = 0; d < 3; ++d) X[d] = H[d] - p.poses[host].translation[d];
    X = multiply(matrix_from_quaternion<double>({q[0], -q[1], -q[2], -q[3]}), X);
    const Vector3<double> P = camera_point(p, image, X);
    const GreyImage& grey = p.images[image];
    const GreyPlane plane(grey.width, grey.height, grey.pixels.data());
    const double level =
        sample(plane, Taps::catmull_rom, k.fx * P[0] / P[2] + k.cx, k.fy * P[1] / P[2] + k.cy)
            .value;
    const Brightness &target = p.brightness[image], &own = p.brightness[host];
    return (level - target.b) / target.a * own.a + own.b;
  }

  PhotometricOptions options_;
  PhotometricProblem start_, refined_;
  PhotometricDetails after_;
  PatchComparison comparison_;
};

TEST_F(PhotometricPictures, SheetsShowTheGreysOfPatches) {
  std::vector<PatchFit> rows = rank_patches(comparison_);
  for (std::size_t i = 1; i < rows.size(); ++i) EXPECT_LE(rows[i].after, rows[i - 1].after);
  rows.resize(6);
  const PatchSheet sheet = draw_patch_sheet(comparison_, rows, "a < title").value();
  const Raster picture = decoded(sheet.image);
  EXPECT_EQ(picture.width, sheet.image.width);
  EXPECT_EQ(picture.height, sheet.image.height);
  const Pattern pattern = make_pattern("4x4").value();
  int counts[3] = {0, 0, 0};
  for (const SheetCell& cell : sheet.cells) {
    ++counts[static_cast<int>(cell.kind)];
    EXPECT_EQ(cell.zoom, 12);
    for (std::size_t k = 0; k < pattern.size(); ++k) {
      const int dx = pattern.dx[k], dy = pattern.dy[k];
      double grey = 0;
      if (cell.kind == SheetCell::Kind::reference) {
        const GreyImage& host = refined_.images[refined_.host[cell.point]];
        const auto x = static_cast<std::size_t>(refined_.host_xy[2 * cell.point] + dx);
        const auto y = static_cast<std::size_t>(refined_.host_xy[2 * cell.point + 1] + dy);
        grey = host.pixels[y * std::size_t(host.width) + x];
      } else {
        grey = shown(cell.kind == SheetCell::Kind::before ? start_ : refined_, cell.point,
                     cell.image, dx, dy);
      }
      const double level = 255 * (grey - cell.low) / (cell.high - cell.low);
      const int x = cell.x + cell.zoom * (dx + 2), y = cell.y + cell.zoom * (dy + 2);
      for (const auto& [a, b] : {std::pair{x, y}, {x + cell.zoom - 1, y + cell.zoom - 1}}) {
        const Color color = at(picture, a, b);
        EXPECT_NEAR(color.red, std::clamp(level, 0.0, 255.0), 0.51);
        EXPECT_EQ(color.green, color.red);
        EXPECT_EQ(color.blue, color.red);
      }
    }
  }
  for (const char* text :
       {"<title>a &lt; title</title>", "residual, grey levels", "data:image/png;base64,"})
    EXPECT_NE(sheet.svg.find(text), std::string::npos) << text;
  for (const PatchFit& row : rows)
    EXPECT_NE(sheet.svg.find(">point " + std::to_string(row.point) + "</text>"), std::string::npos);
  EXPECT_EQ(counts[0], 6);
  EXPECT_GT(counts[1], 6);
  EXPECT_GT(counts[2], 6);
}

TEST_F(PhotometricPictures, MapsShowEachPatchAtItsPlace) {
  const double scale = rms_scale(comparison_);
  for (std::uint32_t j = 0; j < 2; ++j) {
    const GreyImage& grey = refined_.images[j];
    const ResidualMap map = draw_residual_map(comparison_, grey, j, scale).value();
    EXPECT_EQ(map.zoom, 4);
    const Raster picture = decoded(map.image);
    EXPECT_EQ(picture.width, 4 * grey.width);
    EXPECT_EQ(picture.height, 4 * grey.height);
    EXPECT_EQ(at(picture, 0, 0), grey_shade(64 + 0.7 * double(grey.pixels[0])));
    // Every patch has a dot, in its colour and at its place; the worst are drawn last.
    std::size_t seen = 0;
    const PatchSight* worst = nullptr;
    for (const PatchSight& sight : after_.seen)
      if (sight.image == j) {
        ++seen;
        if (!worst || sight.rms_grey >= worst->rms_grey) worst = &sight;
      }
    for (const PatchSight& sight : comparison_.before.seen) seen += sight.image == j;
    ASSERT_NE(worst, nullptr);
    std::size_t dots = 0;
    for (std::size_t k = map.svg.find("<circle"); k != std::string::npos;
         k = map.svg.find("<circle", k + 1))
      ++dots;
    EXPECT_EQ(dots, seen);
    const Color c = size_shade(worst->rms_grey / scale);
    char fill[8];
    std::snprintf(fill, sizeof fill, "#%02x%02x%02x", unsigned(c.red), unsigned(c.green),
                  unsigned(c.blue));
    const std::string dot = "<circle cx=\"" + coordinate(map.left_after + 4 * (worst->x + 0.5)) +
                            "\" cy=\"" + coordinate(map.top + 4 * (worst->y + 0.5)) +
                            "\" r=\"3\" fill=\"" + fill + "\"/>";
    EXPECT_EQ(map.svg.rfind("<circle"), map.svg.rfind(dot)) << dot;
  }
}

TEST_F(PhotometricPictures, LargeImagesAreReduced) {
  const GreyImage grey{3000, 20, std::vector<float>(60000, 100.0f)};
  const ResidualMap map = draw_residual_map(comparison_, grey, 0, 1).value();
  EXPECT_EQ(map.shrink, 3);
  EXPECT_EQ(map.left_after - map.left_before, 1000 + 24);
  EXPECT_DOUBLE_EQ(map.placed(1), 0);
}

TEST_F(PhotometricPictures, AreTheSameEveryTime) {
  const std::vector<PatchFit> rows = rank_patches(comparison_);
  const auto bytes = [&] {
    return draw_patch_sheet(comparison_, rows, "a").value().svg +
           draw_residual_map(comparison_, refined_.images[0], 0, 9).value().svg;
  };
  EXPECT_EQ(bytes(), bytes());
}

TEST_F(PhotometricPictures, ABrokenFolderIsAnError) {
  const auto written = write_pictures(comparison_, refined_.images, "/nowhere/at/all");
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.error().code(), ErrorCode::unwritable_output);
}

}  // namespace
}  // namespace sheaf
