// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The product with kept rows once more as plain scalar code, in double.
#include <array>

#include "eliminate/kept_product.h"
#include "eliminate/reference_rows.h"

namespace sheaf {
namespace {

/// One observation's rows, found among those of its batch.
struct KeptRow {
  const float* row;
  std::array<std::size_t, 3> block;
  int count;

  KeptRow(const KeptProductInput& in, std::uint64_t batch, std::uint32_t lane)
      : row(in.rows + 8 * kept_row::fields(in.tracks->most_blocks) * batch + lane) {
    const LensPlaces& lens = in.tracks->lenses[in.tracks->lens[8 * batch + lane]];
    block = {in.batches->image[8 * batch + lane], lens.first_block, lens.first_block + 1};
    count = 1 + lens.blocks;
  }
  double field(int f) const { return static_cast<double>(row[8 * f]); }
  double camera(int k, int r, int i) const {
    return field(k == 0 ? kept_row::camera(r, i) : kept_row::lens(k - 1, r, i));
  }
  double motion(const KeptProductInput& in, int r) const {
    double e = 0;
    for (int k = 0; k < count; ++k)
      for (int i = 0; i < kCameraColumns; ++i)
        e += camera(k, r, i) *
             static_cast<double>(in.x[kBlockVector * block[std::size_t(k)] + std::size_t(i)]);
    return e;
  }
};

void multiply_point(const KeptProductInput& in, std::size_t g, std::uint32_t lane, double* y) {
  const Batches::Group& group = in.batches->groups[g];
  Vector3<double> s{};
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const KeptRow of(in, b, lane);
    for (int r = 0; r < 2; ++r)
      for (int i = 0; i < 3; ++i)
        s[std::size_t(i)] += of.field(kept_row::point(r, i)) * in.unit * of.motion(in, r);
  }
  // back_substitute gives L^-T (w - L^-1 s): taken from that of s = 0, (V + D)^-1 s is left.
  const double* factor = in.factors + kFactorGroup * g + lane;
  const Vector3<double> with = back_substitute(factor, s), without = back_substitute(factor, {});
  for (std::uint64_t b = group.first_batch; b < group.first_batch + group.track; ++b) {
    const KeptRow of(in, b, lane);
    for (int r = 0; r < 2; ++r) {
      double e = of.motion(in, r);
      for (int i = 0; i < 3; ++i)
        e -= of.field(kept_row::point(r, i)) * in.unit *
             (without[std::size_t(i)] - with[std::size_t(i)]);
      for (int k = 0; k < of.count; ++k)
        for (int i = 0; i < kCameraColumns; ++i)
          y[kProductRecord * of.block[std::size_t(k)] + std::size_t(i)] += of.camera(k, r, i) * e;
    }
  }
}

void multiply(const KeptProductInput& in, const Chunk& chunk, double* y) {
  for (std::size_t g = chunk.first_group; g < chunk.end_group; ++g)
    for (std::uint32_t l = 0; l < in.batches->groups[g].lanes; ++l) multiply_point(in, g, l, y);
}

}  // namespace

const KeptProduct& reference_kept_product() {
  static const KeptProduct kernels{"scalar", &multiply};
  return kernels;
}

}  // namespace sheaf
