// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What outliers do to the poses under each loss: docs/robustness.md, on stdout.
//   SHEAF_DATA=data bench-outliers [SEED] > docs/robustness.md
// SEED: the first of five; 1 to 5 are those that the losses' defaults were looked at with.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "report/errors.h"
#include "sheaf/sheaf.h"
#include "solve/scenes.h"

namespace {

using namespace sheaf;

constexpr int kSeeds = 5;

struct Named {
  const char* name;
  Loss loss;
};
const std::vector<Named> kLosses = {
    {"none", {}},
    {"huber:auto", Huber()},
    {"soft-l1:auto", SoftL1()},
    {"cauchy:auto", Cauchy()},
    {"tukey:auto:gnc", Tukey{kAutomaticScale, true}},
    {"geman-mcclure:auto:gnc", GemanMcClure{kAutomaticScale, true}}};

/// Root mean squares over the seeds of each run's mean errors, and mean steps and sigma.
struct Cell {
  double rotation = 0, center = 0, steps = 0, sigma_px = 0;
};

Cell measure(const Problem& truth, const Loss& loss, double outliers, std::uint64_t first_seed) {
  Cell cell;
  for (std::uint64_t seed = first_seed; seed < first_seed + kSeeds; ++seed) {
    Problem problem = with_pixels(truth, {.outliers = outliers, .seed = seed});
    disturb(problem, {.seed = seed});
    const Summary s = solve(problem, {.loss = loss});
    const StateErrors errors = compare_states(problem, truth, true).value();
    cell.rotation += std::pow(errors.rotation_error_rad.mean, 2) / kSeeds;
    cell.center += std::pow(errors.center_error.mean, 2) / kSeeds;
    cell.steps += static_cast<double>(s.iterations.size() - 1) / kSeeds;
    cell.sigma_px += s.final_sigma_px / kSeeds;
  }
  cell.rotation = std::sqrt(cell.rotation);
  cell.center = std::sqrt(cell.center);
  return cell;
}

void print_scene(const std::string& name, std::uint64_t first_seed) {
  const std::string path = real_data(name);
  if (path.empty()) {
    std::fprintf(stderr, "%s is not in $SHEAF_DATA/bal\n", name.c_str());
    return;
  }
  Problem truth = read(path).value();
  solve(truth, {.max_iterations = 100, .tolerance = 1e-10});
  std::printf(
      "\n## %s\n\nRotation error (mrad) / error of the camera centres (1e-3 scene units)\n\n",
      name.substr(0, name.find("-pre")).c_str());
  std::printf("| outliers |");
  for (const Named& named : kLosses) std::printf(" %s |", named.name);
  std::printf("\n|--:|");
  for (std::size_t i = 0; i < kLosses.size(); ++i) std::printf("--:|");
  std::printf("\n");
  std::vector<Cell> clean, tenth;
  for (double outliers : {0.0, 0.05, 0.1, 0.2, 0.3, 0.4}) {
    std::printf("| %.0f%% |", 100 * outliers);
    for (const Named& named : kLosses) {
      const Cell cell = measure(truth, named.loss, outliers, first_seed);
      if (outliers == 0) clean.push_back(cell);
      if (outliers == 0.1) tenth.push_back(cell);
      std::printf(" %.2f / %.2f |", 1e3 * cell.rotation, 1e3 * cell.center);
      std::fprintf(stderr, "%s %.2f %s: %.1f steps, sigma %.3f px\n", name.c_str(), outliers,
                   named.name, cell.steps, cell.sigma_px);
    }
    std::printf("\n");
  }
  std::printf("| 10%% : 0%% |");
  for (std::size_t i = 0; i < kLosses.size(); ++i)
    std::printf(" %.2f / %.2f |", tenth[i].rotation / clean[i].rotation,
                tenth[i].center / clean[i].center);
  std::printf("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const std::uint64_t first_seed = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1;
  std::printf(
      "# Outliers\n\n"
      "Truth is the optimum of a real scene. The measurements are its exact projections with "
      "0.5 px of\nnormal noise in each coordinate; a part of them is off by 50 px in a random "
      "direction. The start is\nthe truth disturbed: rotations by 2e-3 rad, centres by 0.2%% and "
      "points by 0.5%% of the median depth,\nfocal lengths by 0.2%%. Errors are each run's mean "
      "over "
      "the images after alignment by the camera\ncentres; the tables have their root mean square "
      "over five seeds (%llu to %llu). At most 50 steps, tolerance 1e-8.\nMade by "
      "`bench-outliers %llu`.\n",
      static_cast<unsigned long long>(first_seed),
      static_cast<unsigned long long>(first_seed + kSeeds - 1),
      static_cast<unsigned long long>(first_seed));
  print_scene("dubrovnik-16-22106-pre.txt", first_seed);
  print_scene("trafalgar-21-11315-pre.txt", first_seed);
}
