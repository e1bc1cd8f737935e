// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "inspect/lens_findings.h"

#include <algorithm>
#include <cstdint>

#include "inspect/lens_course.h"

namespace sheaf {
namespace {

/// Whether `is_so` of the lens and the farthest pixel of one sector or another.
template <class Test>
bool anywhere(const LensReach& reach, const Test& is_so) {
  return std::any_of(reach.offsets.begin(), reach.offsets.end(), is_so);
}

struct LensNumbers {
  std::vector<std::uint64_t> focal, distortion, folding, corners;
};

void sort_lens(const Problem& problem, std::size_t c, const LensReach& reach, LensNumbers& out) {
  const Camera& camera = problem.cameras[c];
  const auto stated = static_cast<double>(std::max(camera.width_px, camera.height_px));
  if (absurd_focal(camera, stated > 0 ? stated / 2 : reach.farthest())) {
    out.focal.push_back(c);
    return;
  }
  const auto is_absurd = [&](const auto& edge) { return absurd_distortion(camera, edge); };
  const auto folds = [&](const auto& edge) { return course_of(camera, edge) == LensCourse::folds; };
  if (outside_model(camera) || anywhere(reach, is_absurd))
    out.distortion.push_back(c);
  else if (anywhere(reach, folds))
    out.folding.push_back(c);
  else if (anywhere(reach_of_corners(camera), folds))
    out.corners.push_back(c);
}

}  // namespace

void check_lenses(const Problem& problem, const std::vector<LensReach>& reaches,
                  FindingList& list) {
  LensNumbers found;
  for (std::size_t c = 0; c < problem.cameras.size(); ++c) sort_lens(problem, c, reaches[c], found);
  list.add("absurd-focal", true, "lenses", found.focal,
           plural(found.focal.size(), "lens has a focal length", "lenses have focal lengths") +
               " of 0 or less, or far from the size of the images: not what a camera has; set it "
               "to about the width of the image, or hold a good one (--fix f)");
  list.add(
      "absurd-distortion", true, "lenses", found.distortion,
      plural(found.distortion.size(), "lens has distortion", "lenses have distortion") +
          " that moves the edge of the lens's own observations to less than a tenth of its "
          "distance "
          "from the principal point or to more than ten times it, or that the model is not meant "
          "for: start from a calibration's coefficients or from 0 (and from a good focal length), "
          "and hold them where the images do not determine them (--fix k)");
  list.add(
      "folding-lens", true, "lenses", found.folding,
      plural(found.folding.size(), "lens folds", "lenses fold") +
          " back within reach of the lens's own observations, so that two directions have one "
          "pixel there: start from a calibration's coefficients or from 0, and hold them where "
          "the images do not determine them (--fix k)");
  list.add("folding-corners", false, "lenses", found.corners,
           plural(found.corners.size(), "lens folds", "lenses fold") +
               " back between observations and the corners of the image: a solve does not mind, "
               "what undistorts whole images does; match points nearer to the corners, or hold a "
               "calibration's coefficients (--fix k)");
}

}  // namespace sheaf
