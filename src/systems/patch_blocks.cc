// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#include "systems/patch_blocks.h"

#include <algorithm>

namespace sheaf {
namespace {

RigidMotion<double> target_from_host(const RigidMotion<double>& target,
                                     const RigidMotion<double>& host) {
  const auto& h = host.rotation;
  const Quaternion<double> rotation =
      normalized(multiply(target.rotation, Quaternion<double>{h[0], -h[1], -h[2], -h[3]}));
  const Vector3<double> t = multiply(matrix_from_quaternion(rotation), host.translation);
  return {
      rotation,
      {target.translation[0] - t[0], target.translation[1] - t[1], target.translation[2] - t[2]}};
}

Brightness target_from_host(const Brightness& target, const Brightness& host) {
  const double alpha = target.a / host.a;
  return {alpha, target.b - alpha * host.b};
}

/// 8 x 8 of a diagonal block or a tile.
std::array<double, 64> square_of(const double* block) {
  std::array<double, 64> out;
  std::copy(block, block + 64, out.begin());
  return out;
}

/// A^T M B.
std::array<double, 64> sandwich(const std::array<double, 64>& A, const std::array<double, 64>& M,
                                const std::array<double, 64>& B) {
  std::array<double, 64> MB{}, out{};
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 8; ++k)
      for (int j = 0; j < 8; ++j) MB[8 * i + j] += M[8 * i + k] * B[8 * k + j];
  for (int k = 0; k < 8; ++k)
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) out[8 * i + j] += A[8 * k + i] * MB[8 * k + j];
  return out;
}

/// Adds sign M to an image's diagonal block, as it is and, where asked for, transposed.
void add_block(double* block, const std::array<double, 64>& M, double sign, bool transposed) {
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {
      block[8 * i + j] += sign * M[8 * i + j];
      if (transposed) block[8 * i + j] += sign * M[8 * j + i];
    }
}

/// What the squares lack where a point has several rows in one block: (T_a + T_b)^2 is more than
/// T_a^2 + T_b^2.
void add_repeated_squares(const PatchBlocks::Maps& maps, const PatchBlocks::Map& P, double* target,
                          double* host) {
  for (int k = 0; k < 8; ++k)
    for (int i = 0; i < 8; ++i) {
      target[k] += 2 * maps.target[8 * i + k] * maps.target[8 * i + k] * P[9 * i];
      host[k] += 2 * maps.host[8 * i + k] * maps.host[8 * i + k] * P[9 * i];
    }
}

}  // namespace

PatchBlocks::PatchBlocks(const PatchScene& scene, const std::vector<Sight>& sights)
    : images_(scene.num_images()) {
  if (!scene.has_rays()) {
    for (std::uint32_t i = 0; i < images_; ++i) targets_.push_back(i);
    return;
  }
  constexpr std::uint32_t kNone = ~std::uint32_t(0);
  number_.assign(images_ * images_, kNone);
  for (const Sight& sight : sights) number_[sight.image * images_ + scene.host[sight.point]] = 0;
  for (std::uint32_t target = 0; target < images_; ++target)
    for (std::uint32_t host = 0; host < images_; ++host) {
      std::uint32_t& number = number_[target * images_ + host];
      if (number == kNone) continue;
      number = count();
      targets_.push_back(target);
      hosts_.push_back(host);
    }
}

std::uint32_t PatchBlocks::of(const PatchScene& scene, const Sight& sight) const {
  return scene.has_rays() ? number_[sight.image * images_ + scene.host[sight.point]] : sight.image;
}

std::vector<Tile> PatchBlocks::image_tiles(const std::vector<Tile>& block_tiles) const {
  std::vector<char> coupled(images_ * images_, 0);
  const auto couple = [&](std::uint32_t i, std::uint32_t j) {
    if (i != j) coupled[std::max(i, j) * images_ + std::min(i, j)] = 1;
  };
  for (std::size_t b = 0; b < hosts_.size(); ++b) couple(targets_[b], hosts_[b]);
  for (const Tile& tile : block_tiles) couple(targets_[tile.row], targets_[tile.column]);
  std::vector<Tile> out;
  for (std::uint32_t i = 0; i < images_; ++i)
    for (std::uint32_t j = 0; j < i; ++j)
      if (coupled[i * images_ + j]) out.push_back({i, j});
  return out;
}

void PatchBlocks::write_views(const Poses& poses, const std::vector<Brightness>& brightness,
                              double* views) const {
  for (std::size_t b = 0; b < targets_.size(); ++b) {
    RigidMotion<double> pose = poses[targets_[b]];
    Brightness look = brightness[targets_[b]];
    if (are_pairs()) {
      pose = target_from_host(pose, poses[hosts_[b]]);
      look = target_from_host(look, brightness[hosts_[b]]);
    }
    double* view = views + kViewRecord * b;
    const Matrix3<double> R = matrix_from_quaternion(pose.rotation);
    std::copy(R.begin(), R.end(), view);
    std::copy(pose.translation.begin(), pose.translation.end(), view + pose_record::kTranslation);
    view[view_record::kAlpha] = look.a;
    view[view_record::kBeta] = look.b;
    std::fill(view + view_record::kBeta + 1, view + kViewRecord, 0.0);
  }
}

PatchBlocks::Maps PatchBlocks::maps_of(std::size_t block, const Poses& poses,
                                       const std::vector<Brightness>& brightness) const {
  const RigidMotion<double> T = target_from_host(poses[targets_[block]], poses[hosts_[block]]);
  const Brightness &t = brightness[targets_[block]], &h = brightness[hosts_[block]];
  const double alpha = t.a / h.a;
  const Matrix3<double> R = matrix_from_quaternion(T.rotation);
  Maps maps{};
  Map &Y = maps.target, &Z = maps.host;
  for (int i = 0; i < 6; ++i) Y[8 * i + i] = 1;
  Y[8 * 6 + 6] = 1 / h.a, Y[8 * 7 + 6] = -h.b / h.a, Y[8 * 7 + 7] = 1;
  // Ad(T) = [R, [t]_x R; 0, R]: column by column of R.
  for (int j = 0; j < 3; ++j) {
    const Vector3<double> column{R[j], R[3 + j], R[6 + j]};
    const Vector3<double> moved = cross(T.translation, column);
    for (int i = 0; i < 3; ++i) {
      Z[8 * i + j] = Z[8 * (3 + i) + 3 + j] = -column[i];
      Z[8 * i + 3 + j] = -moved[i];
    }
  }
  Z[8 * 6 + 6] = -alpha / h.a, Z[8 * 7 + 6] = alpha * h.b / h.a, Z[8 * 7 + 7] = -alpha;
  return maps;
}

void PatchBlocks::fold(const Poses& poses, const std::vector<Brightness>& brightness,
                       std::size_t images, const Fold& fold) const {
  std::vector<Maps> maps;
  for (std::size_t b = 0; b < targets_.size(); ++b) maps.push_back(maps_of(b, poses, brightness));
  const auto block = [&](std::uint32_t image) {
    return fold.image_diagonal + kDiagonalDoubles * image;
  };
  // Subtracts M at (i, j) and its transpose at (j, i), as a tile is: S -= P + P^T.
  const auto take = [&](std::uint32_t i, std::uint32_t j, const Map& M, double sign) {
    if (i == j) return add_block(block(i), M, -sign, true);
    double* tile = fold.image_tiles +
                   kTileDoubles * static_cast<std::size_t>(
                                      (*fold.tile_of)[std::max(i, j) * images + std::min(i, j)]);
    for (int r = 0; r < 8; ++r)
      for (int k = 0; k < 8; ++k) tile[8 * r + k] += sign * (i > j ? M[8 * r + k] : M[8 * k + r]);
  };
  for (std::size_t b = 0; b < targets_.size(); ++b) {
    const double* from = fold.diagonal + kDiagonalDoubles * b;
    const Map D = square_of(from);
    const auto& [Y, Z] = maps[b];
    add_block(block(targets_[b]), sandwich(Y, D, Y), 1, false);
    add_block(block(hosts_[b]), sandwich(Z, D, Z), 1, false);
    take(targets_[b], hosts_[b], sandwich(Y, D, Z), -1);
    for (int k = 0; k < 8; ++k)
      for (int i = 0; i < 8; ++i) {
        using namespace diagonal_layout;
        block(targets_[b])[right_side(k)] += Y[8 * i + k] * from[right_side(i)];
        block(hosts_[b])[right_side(k)] += Z[8 * i + k] * from[right_side(i)];
        block(targets_[b])[squares(k)] += Y[8 * i + k] * Y[8 * i + k] * from[squares(i)];
        block(hosts_[b])[squares(k)] += Z[8 * i + k] * Z[8 * i + k] * from[squares(i)];
      }
  }
  for (std::size_t t = 0; t < fold.block_tiles->size(); ++t) {
    const auto [p, q] = (*fold.block_tiles)[t];
    const Map P = square_of(fold.tiles + kTileDoubles * t);
    take(targets_[p], targets_[q], sandwich(maps[p].target, P, maps[q].target), 1);
    take(targets_[p], hosts_[q], sandwich(maps[p].target, P, maps[q].host), 1);
    take(hosts_[p], targets_[q], sandwich(maps[p].host, P, maps[q].target), 1);
    take(hosts_[p], hosts_[q], sandwich(maps[p].host, P, maps[q].host), 1);
    if (p == q)
      add_repeated_squares(maps[p], P, block(targets_[p]) + diagonal_layout::kSquares,
                           block(hosts_[p]) + diagonal_layout::kSquares);
  }
}

std::vector<PatchBlocks::Maps> PatchBlocks::all_maps(
    const Poses& poses, const std::vector<Brightness>& brightness) const {
  std::vector<Maps> out;
  for (std::size_t b = 0; b < hosts_.size(); ++b) out.push_back(maps_of(b, poses, brightness));
  return out;
}

void PatchBlocks::to_blocks(const std::vector<Maps>& maps, const double* images,
                            double* blocks) const {
  for (std::size_t b = 0; b < targets_.size(); ++b) {
    double* to = blocks + kBlockVector * b;
    std::fill_n(to, kBlockVector, 0.0);
    const double* target = images + kBlockVector * targets_[b];
    if (!are_pairs()) {
      std::copy_n(target, kBlockVector, to);
      continue;
    }
    const double* host = images + kBlockVector * hosts_[b];
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t k = 0; k < 8; ++k)
        to[i] += maps[b].target[8 * i + k] * target[k] + maps[b].host[8 * i + k] * host[k];
  }
}

void PatchBlocks::add_to_images(const std::vector<Maps>& maps, const double* blocks,
                                double* images) const {
  for (std::size_t b = 0; b < targets_.size(); ++b) {
    const double* from = blocks + kBlockVector * b;
    double* target = images + kBlockVector * targets_[b];
    if (!are_pairs()) {
      for (std::size_t k = 0; k < kBlockVector; ++k) target[k] += from[k];
      continue;
    }
    double* host = images + kBlockVector * hosts_[b];
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t k = 0; k < 8; ++k) {
        target[k] += maps[b].target[8 * i + k] * from[i];
        host[k] += maps[b].host[8 * i + k] * from[i];
      }
  }
}

void PatchBlocks::step(const Poses& poses, const std::vector<Brightness>& brightness,
                       const double* image_steps, double* block_steps) const {
  to_blocks(all_maps(poses, brightness), image_steps, block_steps);
}

}  // namespace sheaf
