// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>

#include "eliminate/kernels.h"
#include "lists/chunks.h"
#include "lists/columns.h"
#include "platform/buffer.h"
#include "platform/parallel.h"
#include "reduced/recycled_modes.h"

namespace sheaf {

/// Tiles of rows that are in no record of elimination: of terms.
struct Couplings {
  const Tile* tiles = nullptr;
  const double* sums = nullptr;  ///< kTileDoubles each
  std::size_t count = 0;
};

/// The reduced camera system before damping, as the elimination leaves it.
struct ReducedSums {
  const Chunks* chunks;
  const double* tiles;              ///< kTileDoubles per tile
  const double* diagonal;           ///< kDiagonalDoubles per image
  const double* of_rows = nullptr;  ///< of the rows' own blocks, where these are others
  Couplings couplings{};            ///< by the rows' own blocks; they are among the tiles, too
};

/// Right-hand side b and diag(J^T J) of the free columns.
struct CameraVectors {
  Buffer<double> rhs, squares;
  void gather(const ReducedSums& sums, const Columns& columns);
};

class CoarseSpace;

/// (S + D) x = b, to solve exactly or, by an iterative solver, until the quadratic model's
/// decrease per step falls below `forcing` of its mean.
struct CameraSystem {
  ReducedSums sums;
  const CameraVectors* vectors;
  const double* damping;  ///< D: one for each column
  double forcing = 0.1;
  const std::function<bool()>* cancelled = nullptr;
  const CoarseSpace* coarse = nullptr;  ///< factored; null: none
  bool precise = false;                 ///< in double, even by a mixed solver
  /// An iterative solver stops where |x|_C reaches it, C = D / lambda (Steihaug 1983).
  double radius = std::numeric_limits<double>::infinity();
  double lambda = 0;
  bool dogleg = false;  ///< keep what shorten() needs
};

struct CameraSolution {
  bool solved = false;
  int iterations = 0;                ///< of an iterative solver
  const double* residual = nullptr;  ///< b - (S + D) x, until the next solve; null: none is left
  bool cut = false;                  ///< x ends at the radius
};

/// The seam inside one home of a System: how the camera system is solved.
class CameraSolver {
 public:
  virtual ~CameraSolver() = default;
  /// x has room for the columns rounded up to a multiple of 8.
  virtual CameraSolution solve(const CameraSystem& system, Buffer<double>& x) = 0;
  /// What solve() would have found with the smaller radius that alone is new, without another
  /// product; not solved: its x keeps within that radius, or the solver ends nowhere before.
  virtual CameraSolution shorten(const CameraSystem&, Buffer<double>&) { return {}; }
  /// What one solve leaves to the next; nothing, unless it iterates.
  virtual RecycledModes::History history() const { return {}; }
  /// False where it is of another system.
  virtual bool restore(const RecycledModes::History&) { return true; }
  virtual std::uint64_t bytes() const = 0;
};

/// S formed and factored as one dense matrix.
std::unique_ptr<CameraSolver> make_dense_solver(const Columns& columns, const Kernels& kernels,
                                                Threads& threads);

struct ColumnAnalysis;
/// S stored by supernodes in an order that keeps fill low, and factored there. analysis: of these
/// columns and tiles, where somebody has it already.
std::unique_ptr<CameraSolver> make_sparse_solver(
    const Columns& columns, const Chunks& chunks, const Kernels& kernels, Threads& threads,
    std::shared_ptr<const ColumnAnalysis> analysis = nullptr);

/// One small system for each image: exact where images do not couple (points held, own lenses).
std::unique_ptr<CameraSolver> make_block_solver(const Columns& columns, Threads& threads);

/// Conjugate gradients on S formed as blocks, preconditioned by its diagonal blocks; mixed: blocks
/// of floats.
std::unique_ptr<CameraSolver> make_explicit_solver(const Columns& columns, const Chunks& chunks,
                                                   bool mixed, const Kernels& kernels,
                                                   Threads& threads);

}  // namespace sheaf
