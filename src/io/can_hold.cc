// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include <memory>
#include <string>
#include <utility>

#include "io/colmap.h"
#include "io/format.h"
#include "scene/camera_frame.h"
#include "sheaf/io.h"

namespace sheaf {
namespace {

/// What formats refuse stands in lenses and names: the problem without its points is written in no
/// time.
Problem without_points(const Problem& problem) {
  Problem out;
  out.poses = problem.poses;
  out.image_camera = problem.image_camera;
  out.cameras = problem.cameras;
  if (problem.metadata == nullptr) return out;
  SceneMetadata metadata;
  metadata.camera_ids = problem.metadata->camera_ids;
  metadata.image_ids = problem.metadata->image_ids;
  metadata.image_names = problem.metadata->image_names;
  out.metadata = std::make_shared<const SceneMetadata>(std::move(metadata));
  return out;
}

template <class Written>
Result<void> as(const std::string& format, const Result<Written>& written) {
  if (written.ok()) return {};
  return Error(ErrorCode::usage, format + " cannot hold this problem: " + written.error().what());
}

}  // namespace

Result<void> can_hold(const std::string& format, const Problem& problem) {
  const Problem given = without_points(problem);
  const FileFormat* known = format_named(format);
  if (known != nullptr && known->format != nullptr) return as(format, known->format(given));
  if (format.starts_with("colmap"))
    return as(format, format_colmap(given, format == "colmap-text"));
  if (format != "bal") return {};
  Problem turned;
  return as(format, with_bal_cameras(given, turned));
}

}  // namespace sheaf
