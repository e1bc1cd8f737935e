// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// Reads a problem (text or compressed), refines it with the focal lengths held, and writes it:
//   02_file problem.txt refined.txt.gz

#include <sheaf/sheaf.h>

#include <cstdio>

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s IN OUT\n", argv[0]);
    return 2;
  }
  sheaf::check_writable(argv[2]).value();  // better to know before the work than after it
  sheaf::Problem problem = sheaf::read(argv[1]).value();
  std::printf("%zu images, %zu points, %zu observations\n", problem.num_images(),
              problem.num_points(), problem.num_observations());

  sheaf::SolveOptions options;
  options.tolerance = 1e-10;
  options.fixed.f = true;
  const sheaf::Summary summary = sheaf::solve(problem, options);
  std::printf("cost %.6e -> %.6e in %.3f s: %s\n", summary.initial_cost, summary.final_cost,
              summary.setup_s + summary.solve_s, summary.words.c_str());

  sheaf::write(problem, argv[2]).value();
  return summary.usable() ? 0 : 4;
} catch (const sheaf::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return static_cast<int>(error.code());
}
