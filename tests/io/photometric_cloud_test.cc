// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "image/png.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

using Colour = std::array<std::uint8_t, 3>;

class PhotometricCloud : public testing::Test {
 protected:
  PhotometricCloud() {
    path_ = std::filesystem::temp_directory_path() /
            ("sheaf-cloud-" + std::to_string(::getpid()) + "-" +
             testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::create_directories(path_);
    PhotometricSceneOptions o;
    o.images = 3, o.points = 40, o.width = 96, o.height = 64, o.eight_bit = true;
    folder_.problem = generate(o).value().truth;
  }
  ~PhotometricCloud() override { std::filesystem::remove_all(path_); }

  /// Files whose red is the image's grey, green its inverse and blue its column.
  void write_colours(int bits) {
    for (std::size_t j = 0; j < folder_.problem.images.size(); ++j) {
      const GreyImage& grey = folder_.problem.images[j];
      Raster raster{grey.width, grey.height, 3, bits, {}};
      const int unit = bits == 16 ? 257 : 1;
      for (std::size_t p = 0; p < grey.pixels.size(); ++p) {
        const int level = static_cast<int>(grey.pixels[p]);
        for (int c : {level, 255 - level, static_cast<int>(p % std::size_t(grey.width))})
          raster.samples.push_back(static_cast<std::uint16_t>(unit * c));
      }
      folder_.files.push_back(path_ / (std::to_string(j) + ".png"));
      std::ofstream(folder_.files.back(), std::ios::binary) << encode_png(raster).value();
    }
  }
  int grey_at_host(std::size_t point) const {
    const PhotometricProblem& p = folder_.problem;
    const GreyImage& image = p.images[p.host[point]];
    return static_cast<int>(image.pixels[std::size_t(p.host_xy[2 * point + 1]) * 96 +
                                         std::size_t(p.host_xy[2 * point])]);
  }

  std::filesystem::path path_;
  PhotometricFolder folder_;
};

TEST_F(PhotometricCloud, PointsHaveTheColourOfTheirHostsPixel) {
  for (int bits : {8, 16}) {
    folder_.files.clear();
    write_colours(bits);
    const Problem cloud = coloured_cloud_of(folder_, {}).value();
    ASSERT_TRUE(validate(cloud).ok());
    for (std::size_t i = 0; i < cloud.num_points(); ++i) {
      const int grey = grey_at_host(i), column = static_cast<int>(folder_.problem.host_xy[2 * i]);
      EXPECT_EQ(cloud.metadata->point_colours[i],
                (Colour{std::uint8_t(grey), std::uint8_t(255 - grey), std::uint8_t(column)}));
    }
  }
}

TEST_F(PhotometricCloud, GreyImagesGiveGrey) {
  const Problem cloud = coloured_cloud_of(folder_, {}).value();
  for (std::size_t i = 0; i < cloud.num_points(); ++i) {
    const auto grey = static_cast<std::uint8_t>(grey_at_host(i));
    EXPECT_EQ(cloud.metadata->point_colours[i], (Colour{grey, grey, grey}));
  }
  EXPECT_EQ(cloud.cameras[1].parameters[2], folder_.problem.camera.cx + 0.5);
  EXPECT_EQ(cloud.cameras[1].width_px, 96u);
}

TEST_F(PhotometricCloud, WithoutHostsTheBestFitIsLookedAt) {
  folder_.problem.host.clear();
  GreyImage& image = folder_.problem.images[2];
  image.pixels[5 * 96 + 10] = 40, image.pixels[5 * 96 + 11] = 60;
  const Problem cloud =
      coloured_cloud_of(folder_, {{3, 0, 20, 20, 9}, {3, 2, 10.5, 5, 1}, {3, 1, 20, 20, 5}})
          .value();
  EXPECT_EQ(cloud.metadata->point_colours[3], (Colour{50, 50, 50}));
  EXPECT_EQ(cloud.metadata->point_colours[4], (Colour{150, 150, 150})) << "seen by nobody";
}

TEST_F(PhotometricCloud, AFileThatIsGoneIsAnError) {
  write_colours(8);
  std::filesystem::remove(folder_.files[1]);
  EXPECT_FALSE(coloured_cloud_of(folder_, {}).ok());
}

TEST_F(PhotometricCloud, DetailsAreALineForEachPoint) {
  PhotometricDetails details;
  details.seen = {{0, 1, 0, 0, 0}, {0, 2, 0, 0, 0}, {2, 0, 0, 0, 0}};
  details.of_inverse_depth = true;
  details.sigma = {0.25, std::numeric_limits<double>::infinity(), 1e-3, 2};
  ASSERT_TRUE(write_photometric_details(details, 4, path_).ok());
  const auto text = [&](const char* name) {
    std::ostringstream out;
    out << std::ifstream(path_ / name).rdbuf();
    return out.str();
  };
  EXPECT_EQ(text("visibility.txt"), "1 2\n\n0\n\n");
  EXPECT_EQ(text("sigma.txt"), "0.25\ninf\n0.001\n2\n");
  details.of_inverse_depth = false;
  details.sigma = {1, 2, 3, 4, 5, 6};
  ASSERT_TRUE(write_photometric_details(details, 2, path_).ok());
  EXPECT_EQ(text("sigma.txt"), "1 2 3\n4 5 6\n");
  EXPECT_FALSE(write_photometric_details(details, 2, path_ / "no").ok());
}

}  // namespace
}  // namespace sheaf
