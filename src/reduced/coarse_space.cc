// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "reduced/coarse_space.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lists/slices.h"
#include "reduced/camera_solver.h"

namespace sheaf {
namespace {

constexpr int kRows = 7;  // of an image's nine that Z moves
/// Fewer images than this are solved in a few iterations anyway.
constexpr std::size_t kFewestImages = 64;
/// Measured: 8 images to a cluster need the least time from 257 to 1778 images (6 to 12 within a
/// tenth of it). E's factor, solves and sums must stay cheap beside S's products: where clusters
/// or pairs of them are too many, clusters grow. On final-13682's 29 M observations 255 clusters
/// with 14530 pairs halve the iterations of 118 with 4188; 793 with 81855 halve them again and
/// cost more than that saves. On venice-1778's 5 M the larger ones save nothing.
constexpr std::size_t kImagesEach = 8;
constexpr std::int32_t kMostClusters = 256;
constexpr std::uint64_t kMostPairs = 6144, kObservationsPerPair = 1500;
/// E is scaled to a unit diagonal; this is added to it, so that modes which nothing but rounding
/// holds do not spoil the others.
constexpr double kRegularisation = 1e-10;

}  // namespace

Clusters coarse_clusters(const Batches& batches, const Columns& of_rows, const BlockMap* map,
                         Threads& threads) {
  Columns columns = map != nullptr ? map->coarse_columns : of_rows;
  if (map != nullptr) columns.of_image.resize(9 * std::size_t(map->first_kept));
  const std::vector<std::uint32_t> block =
      map != nullptr ? map->coarse_block() : std::vector<std::uint32_t>();
  constexpr std::size_t kSample = 16;
  const std::size_t images = columns.num_images();
  if (images < kFewestImages) return {};
  const std::uint64_t most_pairs =
      std::max(kMostPairs, batches.observations / kObservationsPerPair);
  const Covisibility graph = map != nullptr ? Covisibility(batches, block, images, threads)
                                            : Covisibility(batches, images, threads);
  for (std::size_t each = std::max(kImagesEach, images / kMostClusters); each <= images;
       each += each / 2) {
    Clusters clusters = cluster_images(graph, columns, each);
    if (clusters.count > kMostClusters) continue;
    for (const std::uint32_t b : block)
      clusters.of_row_image.push_back(b == BlockMap::kNone ? Clusters::kNone
                                                           : clusters.of_image[b]);
    // A sample of the points shows most of those that have too many pairs.
    if (count_cluster_pairs(number_cluster_pairs(batches, clusters, threads, kSample)) > most_pairs)
      continue;
    clusters.pairs = number_cluster_pairs(batches, clusters, threads);
    if (count_cluster_pairs(clusters.pairs) <= most_pairs) return clusters;
  }
  return {};  // hundreds of parts that share nothing
}

CoarseSpace::CoarseSpace(const Batches& batches, const Columns& columns, const BlockMap* map,
                         Clusters clusters, std::size_t slices, const Kernels& kernels,
                         Threads& threads)
    : batches_(batches),
      columns_(columns),
      map_(map),
      kernels_(kernels),
      threads_(threads),
      clusters_(std::move(clusters)),
      zooms_(columns.num_images()),
      slices_(slices),
      scratch_(threads.count()),
      centres_(clusters_.count),
      scale_(kCoarseModes * clusters_.count),
      basis_(kCoarseBasis * columns.num_images()),
      tile_(clusters_.pairs.empty() ? number_cluster_pairs(batches, clusters_, threads)
                                    : std::move(clusters_.pairs)),
      tiles_(count_cluster_pairs(tile_)),
      cholesky_(kCoarseModes * clusters_.count, kernels.name),
      coarse_(kCoarseModes * clusters_.count) {
  own_.allocate(kCoarseTile * clusters_.count);
  std::vector<std::uint32_t> uses(static_cast<std::size_t>(columns.count), 0);
  for (std::size_t i = 0; i < columns.num_images(); ++i)
    if (const std::int32_t f = columns.image(i)[6]; f >= 0) ++uses[f];
  for (std::size_t i = 0; i < columns.num_images(); ++i)
    zooms_[i] = columns.image(i)[6] >= 0 && uses[columns.image(i)[6]] == 1;
  sums_.allocate(slices * kCoarseTile * tiles_);
  if (map != nullptr) row_basis_.allocate(kCoarseBasis * map->row_blocks());
}

void CoarseSpace::begin(const State& state, double lambda) {
  if (schedule_.next(lambda) == CoarseSchedule::Matrix::summed) place(state);
}

void CoarseSpace::clear(std::size_t slice) {
  if (schedule_.matrix() != CoarseSchedule::Matrix::summed) return;
  std::fill_n(&sums_[slice * kCoarseTile * tiles_], kCoarseTile * tiles_, 0.0);
}

void CoarseSpace::add(std::size_t slice, const Chunk& chunk, const Records& records) {
  if (schedule_.matrix() != CoarseSchedule::Matrix::summed) return;
  Buffer<double>& scratch = scratch_[threads_.worker()];
  if (scratch.size() == 0) scratch.allocate(coarse_scratch_doubles(batches_, clusters_.count));
  const CoarseInput in{row_basis(), clusters_.of_rows().data(), tile_.data(), clusters_.count};
  kernels_.coarse(batches_, chunk, records, in, scratch.data(),
                  &sums_[slice * kCoarseTile * tiles_]);
}

void CoarseSpace::place(const State& state) {
  const double* cameras = state.cameras;
  std::vector<std::uint32_t> members(clusters_.count, 0);
  std::fill(centres_.begin(), centres_.end(), std::array<double, 3>{});
  for (std::size_t i = 0; i < columns_.num_images(); ++i) {
    const std::int32_t to = clusters_.of_image[i];
    if (to == Clusters::kNone || i >= state.first_point) continue;
    const double *c = cameras + kCameraRecord * i, *t = c + camera_record::kTranslation;
    ++members[to];
    for (int k = 0; k < 3; ++k) centres_[to][k] -= c[k] * t[0] + c[3 + k] * t[1] + c[6 + k] * t[2];
  }
  for (std::int32_t c = 0; c < clusters_.count; ++c)
    for (double& x : centres_[c]) x /= members[c];
  for (std::size_t i = 0; i < columns_.num_images(); ++i) {
    const double* record = cameras + kCameraRecord * i;
    i < state.first_point ? place_image(i, record) : place_point(i, record);
  }
  if (map_ != nullptr) place_rows(state.adjoints);
}

/// X + e, X + e x (X - m), X + (X - m): as place_image has them.
void CoarseSpace::place_point(std::size_t block, const double* X) {
  double* Z = &basis_[kCoarseBasis * block];
  std::fill_n(Z, kCoarseBasis, 0.0);
  const std::int32_t cluster = clusters_.of_image[block];
  if (cluster == Clusters::kNone) return;
  double q[3];
  for (int k = 0; k < 3; ++k) q[k] = X[k] - centres_[cluster][k];
  for (int m = 0; m < 3; ++m) {
    const int s = (m + 1) % 3, t = (m + 2) % 3;
    Z[8 * m + m] = 1;
    Z[8 * s + 3 + m] = -q[t];
    Z[8 * t + 3 + m] = q[s];
    Z[8 * m + 6] = q[m];
  }
}

/// M Z, image by image of the rows.
void CoarseSpace::place_rows(const double* adjoints) {
  row_basis_.fill(0);
  for (std::size_t i = 0; i < clusters_.of_row_image.size(); ++i) {
    if (clusters_.of_row_image[i] == Clusters::kNone) continue;
    double* to = &row_basis_[kCoarseBasis * i];
    for (const BlockPart* part = map_->begin(i); part != map_->end(i); ++part) {
      const double* Z = basis(part->block);
      const bool identity = part->sensor == BlockPart::kIdentity;
      const int rows = std::min(kRows, part->first + part->count);
      for (int r = part->first; r < rows; ++r)
        for (int k = identity ? r : 0; k < (identity ? r + 1 : 6); ++k) {
          const double m = identity ? 1 : adjoints[48 * part->sensor + 8 * r + k];
          for (int c = 0; c < 8; ++c) to[8 * r + c] += m * Z[8 * k + c];
        }
    }
  }
}

/// How an image moves so that its pixels stay when the points move about the cluster's centre m:
/// with R, t its pose and q = t + R m,
///   X + e:            rho = -R e
///   X + e x (X - m):  phi = -R e,  rho = (R e) x q
///   X + (X - m):      rho = q      (pixels do not see the scale of P)
/// and the logarithm of the focal length: f.
void CoarseSpace::place_image(std::size_t image, const double* camera) {
  double* Z = &basis_[kCoarseBasis * image];
  std::fill_n(Z, kCoarseBasis, 0.0);
  const std::int32_t cluster = clusters_.of_image[image];
  if (cluster == Clusters::kNone) return;
  double q[3];
  for (int r = 0; r < 3; ++r) {
    q[r] = camera[camera_record::kTranslation + r];
    for (int k = 0; k < 3; ++k) q[r] += camera[3 * r + k] * centres_[cluster][k];
  }
  for (int m = 0; m < 3; ++m) {
    const double a[3] = {camera[m], camera[3 + m], camera[6 + m]};  // R e
    for (int r = 0; r < 3; ++r) {
      const int s = (r + 1) % 3, t = (r + 2) % 3;
      Z[8 * r + m] = -a[r];
      Z[8 * r + 3 + m] = a[s] * q[t] - a[t] * q[s];
      Z[8 * (3 + r) + 3 + m] = -a[r];
    }
  }
  for (int r = 0; r < 3; ++r) Z[8 * r + 6] = q[r];
  if (zooms_[image]) Z[8 * 6 + 7] = camera[camera_record::kFocal];
}

void CoarseSpace::add_tiles() {
  for (std::int32_t c = 0; c < clusters_.count; ++c)
    for (std::int32_t d = 0; d <= c; ++d) {
      const std::int32_t t = tile_[cluster_pair(c, d)];
      if (t < 0) continue;
      const double* tile = &sums_[kCoarseTile * t];
      for (int a = 0; a < 8; ++a)
        for (int b = 0; b < (c > d ? 8 : a + 1); ++b)
          cholesky_.at(8 * c + a, 8 * d + b) -= tile[8 * a + b];
    }
  for (std::int32_t c = 0; c < clusters_.count; ++c)
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b <= a; ++b)
        cholesky_.at(8 * c + a, 8 * c + b) += own_[kCoarseTile * c + 8 * a + b];
}

/// Z_i^T S_ii Z_i, cluster by cluster.
void CoarseSpace::sum_own(const double* diagonal) {
  own_.fill(0);
  for (std::size_t i = 0; i < clusters_.of_rows().size(); ++i) {
    const std::int32_t c = clusters_.of_rows()[i];
    if (c == Clusters::kNone) continue;
    const double* Z = row_basis() + kCoarseBasis * i;
    double SZ[kRows][8] = {};
    for (int r = 0; r < kRows; ++r)
      for (int k = 0; k < kRows; ++k) {
        const double s = diagonal_entry(diagonal + kDiagonalDoubles * i, r, k);
        for (int m = 0; m < 8; ++m) SZ[r][m] += s * Z[8 * k + m];
      }
    double* tile = &own_[kCoarseTile * c];
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b <= a; ++b)
        for (int r = 0; r < kRows; ++r) tile[8 * a + b] += Z[8 * r + a] * SZ[r][b];
  }
}

/// E_cc += Z_i^T D_i Z_i.
void CoarseSpace::add_damping(const double* damping) {
  for (std::size_t i = 0; i < columns_.num_images(); ++i) {
    const std::int32_t c = clusters_.of_image[i];
    if (c == Clusters::kNone) continue;
    const double* Z = basis(i);
    for (int r = 0; r < kRows; ++r) {
      const std::int32_t column = columns_.image(i)[r];
      if (column < 0) continue;
      for (int a = 0; a < 8; ++a)
        for (int b = 0; b <= a; ++b)
          cholesky_.at(8 * c + a, 8 * c + b) += Z[8 * r + a] * damping[column] * Z[8 * r + b];
    }
  }
}

/// To a unit diagonal; modes that do not exist (a shared focal length) stand alone.
void CoarseSpace::scale() {
  const std::size_t n = cholesky_.size();
  for (std::size_t k = 0; k < n; ++k) {
    const double d = cholesky_.at(k, k);
    scale_[k] = d > 0 ? 1 / std::sqrt(d) : 0;
  }
  for (std::size_t c = 0; c < n; ++c) {
    for (std::size_t r = c; r < n; ++r) cholesky_.at(r, c) *= scale_[r] * scale_[c];
    cholesky_.at(c, c) = 1 + kRegularisation;
  }
}

/// What terms couple blocks of two clusters by, or two of one: -(Z_r^T P Z_c + its transpose).
void CoarseSpace::add_couplings(const Couplings& couplings) {
  for (std::size_t t = 0; t < couplings.count; ++t) {
    const Tile& tile = couplings.tiles[t];
    const std::int32_t a = clusters_.of_rows()[tile.row], b = clusters_.of_rows()[tile.column];
    if (a == Clusters::kNone || b == Clusters::kNone) continue;
    const double* P = couplings.sums + kTileDoubles * t;
    const double *Za = row_basis() + kCoarseBasis * tile.row,
                 *Zb = row_basis() + kCoarseBasis * tile.column;
    for (int i = 0; i < 8; ++i)
      for (int k = 0; k < 8; ++k) {
        double sum = 0;
        for (int r = 0; r < kRows; ++r)
          for (int c = 0; c < kRows; ++c)
            sum += Za[8 * r + i] * tile_entry(P, r, c) * Zb[8 * c + k];
        const std::int32_t row = 8 * a + i, column = 8 * b + k;
        if (a == b) {
          cholesky_.at(std::max(row, column), std::min(row, column)) -=
              row == column ? 2 * sum : sum;
        } else {
          cholesky_.at(std::max(row, column), std::min(row, column)) -= sum;
        }
      }
  }
}

bool CoarseSpace::factor(const double* diagonal, const double* damping,
                         const Couplings& couplings) {
  if (schedule_.matrix() == CoarseSchedule::Matrix::unneeded) return false;
  if (schedule_.matrix() == CoarseSchedule::Matrix::summed) {
    add_slices(sums_, slices_, threads_);
    sum_own(diagonal);
  }
  cholesky_.clear(threads_);
  add_tiles();
  add_couplings(couplings);
  add_damping(damping);
  scale();
  return cholesky_.factor(threads_);
}

void CoarseSpace::add_correction(const double* r, double* z) const {
  coarse_.fill(0);
  for (std::size_t i = 0; i < columns_.num_images(); ++i) {
    const std::int32_t c = clusters_.of_image[i];
    if (c == Clusters::kNone) continue;
    double* to = &coarse_[8 * c];
    for (int k = 0; k < kRows; ++k)
      if (const std::int32_t column = columns_.image(i)[k]; column >= 0)
        for (int m = 0; m < 8; ++m) to[m] += basis(i)[8 * k + m] * r[column];
  }
  for (std::size_t k = 0; k < scale_.size(); ++k) coarse_[k] *= scale_[k];
  cholesky_.solve(coarse_.data());
  for (std::size_t k = 0; k < scale_.size(); ++k) coarse_[k] *= scale_[k];
  for (std::size_t i = 0; i < columns_.num_images(); ++i) {
    const std::int32_t c = clusters_.of_image[i];
    if (c == Clusters::kNone) continue;
    for (int k = 0; k < kRows; ++k) {
      const std::int32_t column = columns_.image(i)[k];
      if (column < 0) continue;
      double sum = 0;
      for (int m = 0; m < 8; ++m) sum += basis(i)[8 * k + m] * coarse_[8 * c + m];
      z[column] += sum;
    }
  }
}

CoarseSpace::History CoarseSpace::history() const {
  const auto summed = static_cast<std::ptrdiff_t>(kCoarseTile * tiles_);
  return {schedule_,
          {basis_.begin(), basis_.end()},
          {row_basis_.begin(), row_basis_.end()},
          {sums_.begin(), sums_.begin() + summed},
          {own_.begin(), own_.end()}};
}

bool CoarseSpace::restore(const History& history) {
  if (history.basis.size() != basis_.size() || history.row_basis.size() != row_basis_.size() ||
      history.sums.size() != kCoarseTile * tiles_ || history.own.size() != own_.size())
    return false;
  schedule_ = history.schedule;
  std::copy(history.basis.begin(), history.basis.end(), basis_.begin());
  std::copy(history.row_basis.begin(), history.row_basis.end(), row_basis_.begin());
  std::copy(history.sums.begin(), history.sums.end(), sums_.begin());
  std::copy(history.own.begin(), history.own.end(), own_.begin());
  return true;
}

std::uint64_t CoarseSpace::bytes() const {
  return bytes(columns_.num_images(), clusters_.count, tiles_, slices_);
}

std::uint64_t CoarseSpace::bytes(std::uint64_t images, std::uint64_t clusters, std::uint64_t tiles,
                                 std::uint64_t slices) {
  const std::uint64_t modes = kCoarseModes * clusters;
  return 8 * kCoarseTile * (tiles * slices + clusters) + DenseCholesky::bytes(modes) + 16 * modes +
         2 * clusters * (clusters + 1) + images * (8 * kCoarseBasis + 5);
}

}  // namespace sheaf
