// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// No solver: the cost of a state on the observations of the original file, for files that are too
// large for evaluate.py in plain Python. Shares nothing with the engine.
//   peer-evaluate ORIGINAL.txt FINAL.txt
//   peer-evaluate --test                      checks how the peers' rotations are written
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>

#include "bal_camera.h"
#include "bal_file.h"

namespace {

/// 1/2 sum |r|^2, with the rounding of each addition kept and added in the end (Neumaier).
double cost(const peer::BalFile& original, const peer::BalFile& state) {
  std::vector<peer::Pose> poses(state.camera_count());
  for (int i = 0; i < state.camera_count(); ++i) {
    peer::rotation(&state.cameras[9 * i], poses[i].R, nullptr);
    for (int j = 0; j < 3; ++j) poses[i].t[j] = state.cameras[9 * i + 3 + j];
  }
  double sum = 0, lost = 0;
  for (const auto& o : original.observations) {
    const double measured[2] = {o.u, o.v};
    double P[3], r[2];
    peer::project(poses[o.camera], &state.cameras[9 * o.camera + 6], &state.points[3 * o.point],
                  measured, P, r, nullptr);
    const double square = r[0] * r[0] + r[1] * r[1];
    const double total = sum + square;
    lost += sum >= square ? (sum - total) + square : (square - total) + sum;
    sum = total;
  }
  return 0.5 * (sum + lost);
}

/// Angle-axis vectors from nothing to half a turn, through a matrix that lost digits as floats do.
int test_rotations() {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  const double angles[] = {0, 1e-13, 1e-6, 0.1, 1, 3, 3.14159, 3.141592653589};
  double worst = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    double axis[3] = {normal(random), normal(random), normal(random)}, w[3], R[9], nearest[9];
    const double length = std::hypot(axis[0], axis[1], axis[2]);
    for (int i = 0; i < 3; ++i) w[i] = angles[trial % 8] * axis[i] / length;
    peer::rotation(w, R, nullptr);
    double rounded[9];
    for (int i = 0; i < 9; ++i) rounded[i] = trial / 8 % 2 ? static_cast<float>(R[i]) : R[i];
    peer::angle_axis(rounded, w);
    peer::rotation(w, nearest, nullptr);
    for (int i = 0; i < 9; ++i)
      worst = std::max(worst, std::abs(nearest[i] - R[i]) / (trial / 8 % 2 ? 1e-7 : 1e-15));
  }
  std::printf("rotations come back to %.1f roundings\n", worst);
  return worst < 5 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 2 && !std::strcmp(argv[1], "--test")) return test_rotations();
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s ORIGINAL.txt FINAL.txt\n       %s --test\n", argv[0], argv[0]);
    return 2;
  }
  peer::BalFile original, state;
  if (!peer::read_bal(argv[1], original) || !peer::read_bal(argv[2], state)) return 3;
  if (original.cameras.size() != state.cameras.size() ||
      original.points.size() != state.points.size()) {
    std::fprintf(stderr, "%s and %s are not of one size\n", argv[1], argv[2]);
    return 3;
  }
  std::printf("%.17g\n", cost(original, state));
  return 0;
}
