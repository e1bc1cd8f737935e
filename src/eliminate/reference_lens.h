// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

#include "eliminate/lens_kernels.h"
#include "eliminate/reference_point.h"
#include "geometry/camera_model.h"

namespace sheaf {

// What the reference kernels of lenses share: one observation through a lens of any model.

/// The rows of one observation; `lens` has those of the blocks of its lens.
struct LensRow : PointRow {
  using Block = std::array<std::array<double, 9>, 2>;
  LensJacobian<double> J;
  std::array<Block, 2> lens{};

  template <class Visit>
  void visit_columns(const Visit& visit) {
    PointRow::visit_columns(visit);
    for (Block& block : lens)
      for (std::size_t k = 0; k < 9; ++k) visit(block[0][k], block[1][k]);
  }
};

inline const double* image_record_of(const LensInput& in, std::uint64_t batch, std::uint32_t lane) {
  return in.at.images + kImageRecord * in.batches->image[8 * batch + lane];
}
inline const double* lens_record_of(const LensInput& in, std::uint64_t batch, std::uint32_t lane) {
  return in.at.lenses + kLensRecord * in.tracks->lens[8 * batch + lane];
}
inline const LensPlaces& lens_of(const LensInput& in, std::uint64_t batch, std::uint32_t lane) {
  return in.tracks->lenses[in.tracks->lens[8 * batch + lane]];
}

/// With P = R X + t and A = du / dP:  du = A (rho + phi x P) + (du / dk) dk + A R dX.
inline LensRow lens_row(const LensInput& in, const Vector3<double>& X, std::uint64_t batch,
                        std::uint32_t lane) {
  const double* pose = image_record_of(in, batch, lane);
  const LensPlaces& places = lens_of(in, batch, lane);
  Matrix3<double> R;
  std::copy(pose, pose + 9, R.begin());
  Vector3<double> P = multiply(R, X);
  for (std::size_t i = 0; i < 3; ++i) P[i] += pose[pose_record::kTranslation + i];
  LensRow row{};
  with_lens(places.model,
            [&](auto lens) { lens.project(lens_record_of(in, batch, lane), P.data(), row.J); });
  const double* z = &in.batches->xy[16 * batch + lane];
  const double observed[] = {z[0], z[8]};
  row.r = residual(places.model, lens_record_of(in, batch, lane), row.J.pixel, observed);
  for (std::size_t e = 0; e < 2; ++e) {
    const Vector3<double>& A = row.J.point[e];
    const Vector3<double> turned = cross(P, A);
    for (std::size_t i = 0; i < 3; ++i) {
      row.camera[e][i] = A[i];
      row.camera[e][3 + i] = turned[i];
      row.point[e][i] = A[0] * R[i] + A[1] * R[3 + i] + A[2] * R[6 + i];
    }
    for (std::size_t p = 0; p < parameter_count(places.model); ++p) {
      const int place = places.place[p], own = place - LensPlaces::kRiders;
      if (place == LensPlaces::kHeld) continue;
      if (own < 0)
        row.camera[e][std::size_t(6 + place)] = row.J.parameters[e][p];
      else
        row.lens[std::size_t(own / 9)][e][std::size_t(own % 9)] = row.J.parameters[e][p];
    }
  }
  return row;
}

/// Numbers of an observation's blocks, the image's first.
struct BlocksOfRow {
  std::array<std::size_t, 3> block;
  std::size_t count;

  BlocksOfRow(const LensInput& in, std::uint64_t batch, std::uint32_t lane) {
    const LensPlaces& lens = lens_of(in, batch, lane);
    block = {in.batches->image[8 * batch + lane], lens.first_block, lens.first_block + 1};
    count = std::size_t{1} + lens.blocks;
  }
  static const std::array<double, 9>& row(const LensRow& of, std::size_t k, std::size_t e) {
    return k == 0 ? of.camera[e] : of.lens[k - 1][e];
  }
};

/// The kernels of the other files (eliminate/lens_kernels.h).
void lens_products_by_reference(const LensTracks& tracks, const LensTiles& tiles_of,
                                const Chunks& chunks, const Chunk& chunk,
                                const LensRecords& records, double* diagonal, double* tiles);
void lens_trial_by_reference(const LensTrialInput& in, const Chunk& chunk, TrialOutput& out);
void lens_product_by_reference(const LensProductInput& in, const Chunk& chunk, double* saved,
                               double* y);
void lens_gradient_by_reference(const LensProductInput& in, const Chunk& chunk, double* sums);
void lens_curvature_by_reference(const LensProductInput& in, double damping, bool points_held,
                                 const Chunk& chunk, CurvatureOutput& out);
double lens_point_damping_by_reference(const LensProductInput& in, const Chunk& chunk);
void keep_lens_rows_by_reference(const LensProductInput& in, double unit, const Chunk& chunk,
                                 float* rows);

}  // namespace sheaf
