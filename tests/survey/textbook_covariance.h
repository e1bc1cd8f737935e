// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

// The covariance of a survey's adjustment by the textbook: derivatives by differences, a dense
// normal matrix, its inverse. It shares nothing with the engine.
namespace sheaf::test {

/// What was measured of a scene and how well, in one Cartesian frame. All images have one lens.
struct TextbookSurvey {
  struct Image {
    Eigen::Matrix3d rotation;  ///< camera from frame
    Eigen::Vector3d centre;
  };
  struct Sight {
    std::size_t image = 0, point = 0;
    double sigma_px = 1;
  };
  struct Position {
    std::size_t image = 0;
    Eigen::Vector3d lever_arm = Eigen::Vector3d::Zero();  ///< in the camera's frame
    double sigma = 1;
  };
  struct Coordinates {
    std::size_t point = 0;
    double sigma = 1;
  };
  struct Distance {
    std::size_t first = 0, second = 0;
    double sigma = 1;
  };
  std::vector<Image> images;
  Eigen::Vector4d lens;  ///< f, cx, cy, k of SIMPLE_RADIAL, all adjusted
  std::vector<Eigen::Vector3d> points;
  std::size_t eliminated = 0;  ///< points before this one have nothing but sights
  std::vector<Sight> sights;
  std::vector<Position> positions;
  std::vector<Coordinates> coordinates;
  std::vector<Distance> distances;
};

/// Where an image sees a point.
Eigen::Vector2d pixel_of(const TextbookSurvey::Image& image, const Eigen::Vector4d& lens,
                         const Eigen::Vector3d& X);

class TextbookCovariance {
 public:
  explicit TextbookCovariance(const TextbookSurvey& survey);

  Eigen::Matrix3d of_centre(std::size_t image) const;
  /// Of a point that sights with the adjusted images and lens see, which took no part in the
  /// adjustment: the least sum of squares in pixels, all sights alike. Errors of images and lens
  /// and errors of the sights go through its linear propagation.
  Eigen::Matrix3d of_triangulated(const Eigen::Vector3d& X,
                                  const std::vector<TextbookSurvey::Sight>& sights) const;

 private:
  const TextbookSurvey& survey_;
  Eigen::MatrixXd covariance_;  ///< of images (turn, centre), lens and points that are kept
};

}  // namespace sheaf::test
