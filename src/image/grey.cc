// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "image/grey.h"

#include <algorithm>

namespace sheaf {

std::vector<float> grey_of(const Raster& raster) {
  const std::size_t count = std::size_t(raster.width) * std::size_t(raster.height);
  std::vector<float> grey(count);
  const double scale = raster.bits == 16 ? 255.0 / 65535.0 : 1.0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint16_t* s = &raster.samples[i * std::size_t(raster.channels)];
    const double level = raster.channels == 1 ? s[0] : 0.299 * s[0] + 0.587 * s[1] + 0.114 * s[2];
    grey[i] = static_cast<float>(scale * level);
  }
  return grey;
}

namespace {

std::ptrdiff_t stride_of(int width) {
  return (GreyPlane::kBorder + width + GreyPlane::kRightBorder + 15) / 16 * 16;
}

}  // namespace

GreyPlane GreyPlane::frame(int width, int height) {
  GreyPlane plane;
  plane.width_ = width, plane.height_ = height;
  return plane;
}

std::size_t GreyPlane::bytes(int width, int height) {
  return resident_bytes_of(sizeof(float) * static_cast<std::size_t>(stride_of(width)) *
                           std::size_t(height + 2 * kBorder));
}

GreyPlane::GreyPlane(int width, int height, const float* pixels)
    : width_(width), height_(height), stride_(stride_of(width)) {
  const auto all = std::make_shared<Buffer<float>>(static_cast<std::size_t>(stride_) *
                                                   std::size_t(height + 2 * kBorder));
  for (int y = -kBorder; y < height + kBorder; ++y) {
    const float* from = pixels + std::size_t(std::clamp(y, 0, height - 1)) * std::size_t(width);
    float* row = all->data() + (y + kBorder) * stride_;
    for (int x = -kBorder; x < width + kRightBorder; ++x)
      row[x + kBorder] = from[std::clamp(x, 0, width - 1)];
  }
  pixels_ = all;
}

std::vector<float> halve(int width, int height, const float* pixels) {
  const int w = width / 2, h = height / 2;
  std::vector<float> out(std::size_t(w) * std::size_t(h));
  for (int y = 0; y < h; ++y) {
    const float* top = pixels + std::size_t(2 * y) * std::size_t(width);
    const float* bottom = top + width;
    for (int x = 0; x < w; ++x)
      out[std::size_t(y) * std::size_t(w) + std::size_t(x)] =
          0.25f * ((top[2 * x] + top[2 * x + 1]) + (bottom[2 * x] + bottom[2 * x + 1]));
  }
  return out;
}

}  // namespace sheaf
