// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The trial of BAL cameras as reference_trial.h has it.
#include "eliminate/reference_trial.h"

namespace sheaf {
namespace {

PointRow point_row(const Row& of) {
  PointRow row;
  row.r = of.r;
  for (std::size_t e = 0; e < 2; ++e) {
    std::copy_n(of.j.camera.begin() + 9 * static_cast<std::ptrdiff_t>(e), 9, row.camera[e].begin());
    std::copy_n(of.j.point.begin() + 3 * static_cast<std::ptrdiff_t>(e), 3, row.point[e].begin());
  }
  return row;
}

struct BalTwin {
  const Batches& batches;
  const double *cameras, *at;

  PointRow row(std::uint64_t batch, std::uint32_t lane, const Vector3<double>& X) const {
    return point_row(row_of(batches, cameras, X, batch, lane));
  }
  std::array<double, 2> step(const PointRow& row, std::uint64_t batch, std::uint32_t lane) const {
    const auto dc = step_of(cameras + kCameraRecord * batches.image[8 * batch + lane]);
    std::array<double, 2> e{};
    for (std::size_t r = 0; r < 2; ++r)
      for (std::size_t k = 0; k < 9; ++k) e[r] += row.camera[r][k] * dc[k];
    return e;
  }
  const double* images() const { return cameras; }
  const double* points() const { return at; }
};

struct BalTrial {
  const TrialInput& in;

  BalTwin held() const { return {*in.batches, in.cameras, in.points}; }
  BalTwin tried() const { return {*in.batches, in.trial_cameras, nullptr}; }
  std::uint64_t count_crossed(const Batches::Group& group, std::uint32_t lane,
                              const Vector3<double>& X, const Vector3<double>& Y) const {
    std::uint64_t count = 0;
    for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
      const std::uint32_t image = in.batches->image[8 * b + lane];
      count += in.count_newly_behind && depth(in.trial_cameras, image, Y) > 0 &&
               depth(in.cameras, image, X) <= 0;
    }
    return count;
  }
};

}  // namespace

void trial_by_reference(const TrialInput& in, const Chunk& chunk, TrialOutput& out) {
  try_points(BalTrial{in}, chunk, out);
}

}  // namespace sheaf
