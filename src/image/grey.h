// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "platform/buffer.h"

namespace sheaf {

/// Samples of a decoded image, row by row from the top left.
struct Raster {
  int width = 0, height = 0;
  int channels = 1;                    ///< 1: grey; 3: red, green, blue
  int bits = 8;                        ///< 8 or 16: what the samples reach up to
  std::vector<std::uint16_t> samples;  ///< width x height x channels
};

/// Grey levels, 0 to 255 for 8 bits; colours by ITU-R BT.601: 0.299 R + 0.587 G + 0.114 B.
std::vector<float> grey_of(const Raster& raster);

/// A grey image whose border pixels are repeated outwards, so that what reads a few pixels beyond
/// the border reads memory that is there. Pixel (0, 0) has its centre at (0, 0).
class GreyPlane {
 public:
  static constexpr int kBorder = 8, kRightBorder = 24;

  GreyPlane() = default;
  GreyPlane(int width, int height, const float* pixels);
  /// The size alone, no pixel.
  static GreyPlane frame(int width, int height);
  /// What a plane of this size holds.
  static std::size_t bytes(int width, int height);

  int width() const { return width_; }
  int height() const { return height_; }
  std::ptrdiff_t stride() const { return stride_; }
  /// Valid for -kBorder <= x < width + kRightBorder, -kBorder <= y < height + kBorder.
  const float* at(int x, int y) const { return origin() + y * stride_ + x; }

 private:
  const float* origin() const { return pixels_->data() + kBorder * stride_ + kBorder; }

  int width_ = 0, height_ = 0;
  std::ptrdiff_t stride_ = 0;
  /// Shared by copies. On large pages: each row of a patch would be on a small page of its own.
  std::shared_ptr<const Buffer<float>> pixels_;
};

/// Half the size: every pixel is the mean of four, so that its centre (x, y) is at
/// (2 x + 1/2, 2 y + 1/2) of the larger image. An odd last row or column is left out.
std::vector<float> halve(int width, int height, const float* pixels);

}  // namespace sheaf
