// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace sheaf {

/// What an image may be, told before its pixels are decoded: a file of a few kilobytes can state
/// more pixels than a machine has memory for.
struct ImageBounds {
  std::uint64_t width_px = 0, height_px = 0;  ///< what it must be; 0: any
  std::string of;                             ///< whose size that is, for messages: "its camera's"

  static constexpr std::uint64_t kMostPixels = 200'000'000;
  /// Up to here a file may be as small as it likes; above it has a byte for so many pixels. Of
  /// cameras' images none has come near that.
  static constexpr std::uint64_t kFreePixels = 16'000'000, kPixelsPerByte = 100;

  /// "" where the image is within bounds, else what was found and expected.
  std::string refusal(std::uint64_t width, std::uint64_t height, std::size_t file_bytes) const {
    const std::string found = std::to_string(width) + " x " + std::to_string(height) + " pixels";
    if (width_px > 0 && (width != width_px || height != height_px))
      return "found " + found + ", expected " + of + " " + std::to_string(width_px) + " x " +
             std::to_string(height_px);
    if (width > kMostPixels || height > kMostPixels || width * height > kMostPixels)
      return "found " + found + ", expected at most " + std::to_string(kMostPixels);
    if (width * height > kFreePixels && width * height > kPixelsPerByte * file_bytes)
      return "found " + found + " in " + std::to_string(file_bytes) +
             " bytes, expected a byte for at most " + std::to_string(kPixelsPerByte) + " pixels";
    return "";
  }
};

}  // namespace sheaf
