// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// A problem made from numbers in memory, no files: five cameras in a row see a wavy wall. The
// start is wrong on purpose; a callback watches each step and may end the run; errors are values.

#include <sheaf/sheaf.h>

#include <cmath>
#include <cstdio>

namespace {

constexpr double kFocal_px = 800;

/// Pixel of the point in a camera at (center_x, 0, 0) that looks along -z: p = -X.xy / X.z.
std::array<double, 2> see(double center_x, const std::array<double, 3>& X) {
  return {-kFocal_px * (X[0] - center_x) / X[2], -kFocal_px * X[1] / X[2]};
}

sheaf::Problem make_problem() {
  sheaf::Problem problem;
  for (int i = 0; i < 5; ++i) {
    sheaf::Pose pose;                                    // cam_from_world: X_cam = R X_world + t
    pose.translation = {-0.5 * i, 0.02 * (i % 2), 0.0};  // the 0.02 is an error to be found
    problem.add_image(pose, sheaf::Camera{.parameters = {1.02 * kFocal_px, 0, 0}});
  }
  for (int i = 0; i < 200; ++i) {
    const double x = 0.2 * (i % 20) - 1, y = 0.3 * (i / 20) - 1.5;
    const std::array<double, 3> X{x, y, -5 + std::sin(3 * x) * std::cos(2 * y)};
    const std::uint32_t point = problem.add_point(X[0], X[1], X[2] + 0.1 * std::sin(7.0 * i));
    for (std::uint32_t image = 0; image < 5; ++image) {
      const auto [u, v] = see(0.5 * image, X);
      problem.add_observation(image, point, u, v);
    }
  }
  return problem;
}

}  // namespace

int main() {
  sheaf::Problem problem = make_problem();

  sheaf::SolveOptions options;
  options.max_iterations = 20;
  options.on_iteration = [](const sheaf::Iteration& step) {
    std::printf("%2d  cost %.6e%s\n", step.index, step.cost, step.accepted ? "" : "  (rejected)");
    return step.cost > 1e-6;  // false ends the run: this is good enough
  };

  const sheaf::Result<sheaf::Summary> result = sheaf::try_solve(problem, options);
  if (!result.ok()) {
    std::fprintf(stderr, "%s\n", result.error().what());
    return static_cast<int>(result.error().code());
  }
  const sheaf::Summary& summary = result.value();
  std::printf("%s\nrms %.3f px -> %.6f px\n", summary.words.c_str(), summary.initial_rms_px,
              summary.final_rms_px);

  problem.observation_point[0] = 4000000000u;  // a mistake: there is no such point
  std::printf("and a mistake: %s\n", sheaf::try_solve(problem).error().what());
  return summary.final_rms_px < 1e-2 ? 0 : 1;
}
