// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "io/bal_sink.h"

namespace sheaf {

void BalSink::counts(std::uint64_t images, std::uint64_t points, std::uint64_t observations) {
  text_.put(images, ' ');
  text_.put(points, ' ');
  text_.put(observations, '\n');
}

void BalSink::observation(std::uint32_t image, std::uint32_t point, double x_px, double y_px) {
  text_.put(image, ' ');
  text_.put(point, ' ');
  text_.put(x_px, ' ');
  text_.put(y_px, '\n');
}

void BalSink::image(const std::array<double, 3>& angle_axis,
                    const std::array<double, 3>& translation,
                    const std::array<double, 3>& intrinsics) {
  for (const auto& numbers : {angle_axis, translation, intrinsics})
    for (const double number : numbers) text_.put(number, '\n');
}

void BalSink::point(const std::array<double, 3>& xyz) {
  for (const double number : xyz) text_.put(number, '\n');
}

Result<void> BalSink::commit() {
  text_.flush();
  return out_.commit();
}

}  // namespace sheaf
