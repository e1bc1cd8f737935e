// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "inspect/statistics.h"
#include "io/bal_sink.h"
#include "json_document.h"
#include "sheaf/scene.h"

namespace sheaf {

/// Counts what a scene holds on its way to a file.
class CountingSink : public SceneSink {
 public:
  explicit CountingSink(OutputFile out) : file_(std::move(out)) {}

  void counts(std::uint64_t images, std::uint64_t points, std::uint64_t observations) override;
  void observation(std::uint32_t image, std::uint32_t point, double x_px, double y_px) override;
  void image(const std::array<double, 3>& angle_axis, const std::array<double, 3>& translation,
             const std::array<double, 3>& intrinsics) override;
  void point(const std::array<double, 3>& xyz) override { file_.point(xyz); }
  bool more() const override { return file_.more(); }

  Result<void> commit() { return file_.commit(); }

  /// Of all that passed, as `statistics_of` has it for a problem.
  Statistics statistics() const;
  /// As `counts_json` has it.
  Json totals_json() const;
  std::string totals_text() const;

 private:
  BalSink file_;
  std::uint64_t images_ = 0, points_ = 0, observations_ = 0;
  std::vector<std::uint32_t> track_;  ///< by point
  std::vector<double> per_image_, focal_px_;
};

}  // namespace sheaf
