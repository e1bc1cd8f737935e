// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// A window that is refined again and again in the memory of the first time, with observations
// switched off, and from which the oldest image then leaves: what it and its points say of the
// others stays as a Gaussian.
#include <sheaf/sheaf.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <vector>

namespace {

/// Points that an image sees.
std::vector<std::uint32_t> seen_by(const sheaf::Problem& problem, std::uint32_t image) {
  std::vector<std::uint32_t> points;
  for (std::size_t i = 0; i < problem.num_observations(); ++i)
    if (problem.observation_image[i] == image) points.push_back(problem.observation_point[i]);
  return points;
}

int run() {
  // Ten images; sigmas are what switches need.
  sheaf::SceneOptions scene;
  scene.images = 10, scene.points = 1500, scene.mean_track = 4;
  sheaf::Problem window = sheaf::generate(scene).value().start;
  window.observation_sigma.assign(window.num_observations(), 0.5);

  sheaf::SolveOptions options;
  options.loss = sheaf::Huber{2};
  options.fixed.intrinsics = true;
  sheaf::Solver solver(options);
  for (int time = 0; time < 3; ++time) {
    const sheaf::Summary& summary = solver.solve(window);
    std::printf("%s: cost %.3f after %zu steps\n", solver.was_kept() ? "kept" : "arranged",
                summary.final_cost, summary.iterations.size() - 1);
    // Some other observation takes no part the next time; nothing is arranged anew for it.
    window.observation_sigma[static_cast<std::size_t>(100 * time)] =
        std::numeric_limits<double>::infinity();
  }

  const sheaf::MarginaliseOptions leaving{options.fixed, options.loss};
  sheaf::slide(window, {0}, seen_by(window, 0), leaving).value();
  const sheaf::Summary& summary = solver.solve(window);
  std::printf("%zu images and a Gaussian over %zu poses: cost %.3f\n", window.num_images(),
              window.terms.gaussians.front().blocks.size(), summary.final_cost);
  return std::isfinite(summary.final_cost) ? 0 : 1;
}

}  // namespace

int main() {
  try {
    return run();
  } catch (const sheaf::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return static_cast<int>(error.code());
  }
}
