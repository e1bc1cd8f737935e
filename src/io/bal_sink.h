// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "io/output_file.h"
#include "io/text_buffer.h"
#include "sheaf/scene.h"

namespace sheaf {

/// A file that is compressed when its name ends in .gz or .bz2.
Result<OutputFile> create_output(const std::filesystem::path& path);

/// Writes a scene as BAL while it is made, without holding it. `commit` at the end.
class BalSink : public SceneSink {
 public:
  explicit BalSink(OutputFile out) : out_(std::move(out)), text_(out_) {}
  BalSink(BalSink&&) = delete;

  void counts(std::uint64_t images, std::uint64_t points, std::uint64_t observations) override;
  void observation(std::uint32_t image, std::uint32_t point, double x_px, double y_px) override;
  void image(const std::array<double, 3>& angle_axis, const std::array<double, 3>& translation,
             const std::array<double, 3>& intrinsics) override;
  void point(const std::array<double, 3>& xyz) override;
  bool more() const override { return !out_.failed(); }

  Result<void> commit();

 private:
  OutputFile out_;
  TextBuffer text_;
};

}  // namespace sheaf
