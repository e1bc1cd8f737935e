// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
//
// No solver: the cost of a state on the observations of the original file, for files that are too
// large for evaluate.py in plain Python. Shares nothing with the engine.
//   peer-evaluate ORIGINAL.txt FINAL.txt
#include <cmath>
#include <cstdio>

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

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: %s ORIGINAL.txt FINAL.txt\n", argv[0]);
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
