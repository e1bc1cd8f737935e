// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Back-substitution, the trial cost and the implicit product of lenses once more as plain scalar
// code (reference_lens.cc).
#include <algorithm>
#include <cmath>

#include "eliminate/reference_lens.h"
#include "eliminate/reference_trial.h"

namespace sheaf {
namespace {

/// Jc dc of the step that the records hold.
std::array<double, 2> step_of_camera(const LensInput& in, const LensRow& row, std::uint64_t batch,
                                     std::uint32_t lane) {
  const double* pose = image_record_of(in, batch, lane) + image_record::kStep;
  const double* dk = lens_record_of(in, batch, lane) + lens_record::kStep;
  const std::size_t parameters = parameter_count(lens_of(in, batch, lane).model);
  std::array<double, 2> e{};
  for (std::size_t r = 0; r < 2; ++r) {
    for (std::size_t i = 0; i < 6; ++i) e[r] += row.camera[r][i] * pose[i];
    for (std::size_t p = 0; p < parameters; ++p) e[r] += row.J.parameters[r][p] * dk[p];
  }
  return e;
}

struct LensTwin {
  LensInput in;

  LensRow row(std::uint64_t batch, std::uint32_t lane, const Vector3<double>& X) const {
    return lens_row(in, X, batch, lane);
  }
  std::array<double, 2> step(const LensRow& row, std::uint64_t batch, std::uint32_t lane) const {
    return step_of_camera(in, row, batch, lane);
  }
  const double* images() const { return in.at.images; }
  const double* points() const { return in.at.points; }
};

struct LensTrial {
  const LensTrialInput& in;

  LensTwin held() const { return {{in.batches, in.tracks, in.held}}; }
  LensTwin tried() const { return {{in.batches, in.tracks, in.tried}}; }
  static std::uint64_t count_crossed(const Batches::Group&, std::uint32_t, const Vector3<double>&,
                                     const Vector3<double>&) {
    return 0;
  }
};

/// Of one point: e = Jc x, u = (V + D)^-1 sum Jp^T M e, y += Jc^T M (e - Jp u).
void multiply_point(const LensProductInput& in, std::size_t g, std::uint32_t lane, double* y) {
  const Batches::Group& group = in.of.batches->groups[g];
  const Vector3<double> X = point_of(in.of.at.points, g, lane);
  const auto along = [&](const LensRow& row, const BlocksOfRow& of) {
    std::array<double, 2> e{};
    for (std::size_t r = 0; r < 2; ++r)
      for (std::size_t k = 0; k < of.count; ++k)
        for (std::size_t i = 0; i < 9; ++i)
          e[r] += BlocksOfRow::row(row, k, r)[i] * in.x[kProductRecord * of.block[k] + i];
    return e;
  };
  Vector3<double> s{};
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const LensRow row = lens_row(in.of, X, b, lane);
    add_to_point(row, metric_at(in.metric, b, lane).times(along(row, {in.of, b, lane})), s);
  }
  // back_substitute gives L^-T (w - L^-1 s): taken from that of s = 0, (V + D)^-1 s is left.
  const double* factor = in.factors + kFactorGroup * g + lane;
  const Vector3<double> with = back_substitute(factor, s), without = back_substitute(factor, {});
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const LensRow row = lens_row(in.of, X, b, lane);
    const BlocksOfRow of(in.of, b, lane);
    std::array<double, 2> e = along(row, of);
    for (std::size_t r = 0; r < 2; ++r)
      for (std::size_t i = 0; i < 3; ++i) e[r] -= row.point[r][i] * (without[i] - with[i]);
    e = metric_at(in.metric, b, lane).times(e);
    for (std::size_t r = 0; r < 2; ++r)
      for (std::size_t k = 0; k < of.count; ++k)
        for (std::size_t i = 0; i < 9; ++i)
          y[kProductRecord * of.block[k] + i] += BlocksOfRow::row(row, k, r)[i] * e[r];
  }
}

}  // namespace

void lens_trial_by_reference(const LensTrialInput& in, const Chunk& chunk, TrialOutput& out) {
  try_points(LensTrial{in}, chunk, out);
}

void lens_product_by_reference(const LensProductInput& in, const Chunk& chunk, double*, double* y) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < in.of.batches->groups[g].lanes; ++l) multiply_point(in, g, l, y);
}

}  // namespace sheaf
