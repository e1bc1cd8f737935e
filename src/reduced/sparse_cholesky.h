// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "platform/buffer.h"
#include "platform/parallel.h"
#include "reduced/dense_cholesky.h"
#include "reduced/symbolic_factor.h"

namespace sheaf {

/// Cholesky factorisation of a sparse symmetric positive definite matrix. Each supernode's panel
/// takes its entries, then what its descendants' panels owe it, in their order, and is factored
/// with the dense kernels. Subtrees of about equal work are factored beside one another, each by
/// one thread; the panels above them by all threads. No sum depends on which.
class SparseCholesky {
 public:
  /// simd_name: as for DenseCholesky.
  SparseCholesky(std::shared_ptr<const SymbolicFactor> symbolic, const char* simd_name);

  static std::uint64_t bytes(const SymbolicFactor& symbolic);
  const SymbolicFactor& symbolic() const { return symbolic_; }

  /// A zeroed panel's entries are to be filled by its supernode's number; called once for each, by
  /// any thread.
  using Fill = std::function<void(std::size_t supernode)>;
  /// Where an entry stands, in doubles from panels(): rows and columns as they were before the
  /// reordering. The two must be coupled. Swapped where that order puts the column below the row.
  std::uint64_t offset(std::int32_t row, std::int32_t column) const;
  double* panels() { return panels_.data(); }
  const double* panels() const { return panels_.data(); }

  /// False where the matrix is not positive definite to rounding; or where it was cancelled, which
  /// the calling thread asks first and then once for each supernode it works at.
  bool factor(Threads& threads, const Fill& fill, const std::function<bool()>* cancelled = nullptr);
  /// x <- A^-1 x, after factor().
  void solve(double* x);
  /// Puts the entries of A^-1 in the place of those of the factor, after factor(); the factor is
  /// gone (selected_inverse.cc). Throws std::bad_alloc.
  void invert(Threads& threads);
  /// What it takes besides.
  static std::uint64_t invert_bytes(const SymbolicFactor& symbolic);

 private:
  /// Rows source .. source + count of one panel stand at rows target .. of another.
  struct Run {
    std::int32_t source, target, count;
  };
  /// What a panel owes an ancestor: rows [begin, end) of the source are columns of the ancestor,
  /// and its rows from `begin` on are rows of the ancestor.
  struct Update {
    std::int32_t source, begin, end;
    std::uint64_t first_run, end_run;
  };
  struct Job;

  void list_updates();
  void cut_into_subtrees();
  bool factor_supernode(std::size_t supernode, Job& job, bool shared);
  void apply_updates(std::size_t supernode, std::size_t first, std::size_t end, double* scratch);
  void apply_update(const Update& update, const Supernode& to, const Run* run, std::int32_t first,
                    std::int32_t end, double* scratch);
  void forward(const Supernode& s);
  void backward(const Supernode& s);
  void invert_triangle(const Supernode& s, std::vector<double>& inverse) const;
  void gather(const Supernode& s, double* A, std::size_t lda,
              std::vector<std::size_t>& panel_row) const;

  const std::shared_ptr<const SymbolicFactor> shared_;
  const SymbolicFactor& symbolic_;  ///< what is shared
  const DenseKernels& kernels_;
  Buffer<double> panels_;
  std::vector<double> inverse_;
  std::vector<Update> updates_;
  std::vector<std::uint64_t> first_update_;  ///< of each supernode
  std::vector<Run> runs_;
  std::vector<std::int32_t> subtrees_;  ///< roots of those that one thread factors
  std::vector<std::int32_t> above_;     ///< the other supernodes
  std::vector<Buffer<double>> scratch_;
  Buffer<double> permuted_, gathered_;
};

}  // namespace sheaf
