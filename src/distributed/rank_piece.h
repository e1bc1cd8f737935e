// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "distributed/block_exchange.h"
#include "pieces/scene_piece.h"
#include "reduced/block_diagonal.h"
#include "sheaf/options.h"
#include "systems/build.h"
#include "systems/implicit_solver.h"
#include "systems/point_piece.h"

namespace sheaf {

/// What all pieces of a scene have to do alike.
struct PieceRules {
  SolveOptions options;
  std::function<Result<Fixed>(const Problem&)> fixed;  ///< of a piece; null: options.fixed
  PointChoice points;                                  ///< already made
  bool lens_blocks = false;                            ///< some lens is shared
};

/// A piece of the scene at the rank that works at it: its point pass, its products and its diagonal
/// blocks. Vectors over camera blocks have kWidth numbers a block, zero where a column is held.
class RankPiece {
 public:
  static constexpr int kWidth = 9;
  /// Of a block in the sums of elimination: the diagonal block, right-hand side and squares.
  static constexpr int kSums = static_cast<int>(kDiagonalDoubles);

  /// Errors: usage, memory_limit. Throws std::bad_alloc.
  static Result<std::unique_ptr<RankPiece>> make(ScenePiece piece, const PieceRules& rules,
                                                 const Kernels& kernels, Threads& threads);

  const ScenePiece& scene_piece() const { return piece_; }
  /// Whether products are in single precision where that will do.
  bool rounds() const { return products_.rounded != nullptr; }
  PointPiece& points() { return *points_; }
  const Columns& columns() const { return *columns_; }
  std::size_t num_blocks() const { return columns_->num_images(); }

  // Which blocks it owns: its images', then its lenses' own.
  std::uint32_t num_owned() const { return static_cast<std::uint32_t>(owned_.size()); }
  /// Of each lens it owns, where its own blocks begin among the owned ones, and how many there are.
  std::vector<double> lens_places() const;
  /// places: those two numbers of each ghost lens at its owner's. Throws std::runtime_error where
  /// an owner sees a lens in another way.
  void place_ghosts(const std::vector<double>& places);
  const std::vector<Ghost>& ghosts() const { return ghosts_; }

  /// Calls task(k, block) for the k-th block that it owns.
  template <class Task>
  void for_each_owned(const Task& task) const {
    for (std::size_t k = 0; k < owned_.size(); ++k) task(k, owned_[k]);
  }
  /// And to_ghost(k, block) for the k-th ghost.
  template <class ToOwned, class ToGhost>
  void for_each(const ToOwned& to_owned, const ToGhost& to_ghost) const {
    for_each_owned(to_owned);
    for (std::size_t k = 0; k < ghost_.size(); ++k) to_ghost(k, ghost_[k]);
  }

  /// Before products at a state that was eliminated: squares by column.
  void prepare(bool precise, const double* squares);
  /// S x of this piece's rows, from what is owned and ghosts to shares of both.
  void multiply(const double* owned, const double* ghosts, double* to_owned, double* to_ghosts);

  BlockDiagonal& diagonal() { return *diagonal_; }
  /// z = M^-1 r of what it owns, by the diagonal blocks.
  void precondition(const double* r, double* z);
  /// By column, padded to a multiple of eight.
  Buffer<double> column_vector() const;
  void to_columns(const double* owned, const double* ghosts, Buffer<double>& columns) const;

  /// The tried state of cameras from a step by column; the largest relative change of a block.
  double step_cameras(const Buffer<double>& columns);
  /// The piece with the held state.
  const ScenePiece& store();
  std::uint64_t bytes() const;

 private:
  explicit RankPiece(ScenePiece piece) : piece_(std::move(piece)) {}
  void take(Build::Parts parts, Threads& threads, bool mixed);
  void own_blocks();
  void to_columns(std::uint32_t block, const double* from, Buffer<double>& columns) const;

  ScenePiece piece_;
  std::optional<Build> build_;
  CameraColumns camera_columns_;
  const Columns* columns_ = nullptr;
  std::unique_ptr<PointPiece> points_;
  PointRows::Operators products_;
  StateOperator* product_ = nullptr;
  std::optional<BlockDiagonal> diagonal_;
  std::vector<std::uint32_t> owned_, ghost_;  ///< local blocks
  std::vector<Ghost> ghosts_;
  Buffer<double> x_, y_;      ///< kBlockVector per block
  Buffer<double> from_, to_;  ///< by column
};

}  // namespace sheaf
