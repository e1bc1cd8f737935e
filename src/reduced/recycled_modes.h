// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "platform/buffer.h"

namespace sheaf {

/// What one run of conjugate gradients learns about the next one's system. A run spans a Lanczos
/// basis; its Ritz vectors y_j, y_j^T S y_j = theta_j and y_j^T H^-1 y_j = 1 with H the
/// preconditioner, show the directions in which H is much too small. The next run's
///   H + sum_j (1 / theta_j - 1) y_j y_j^T
/// maps these eigenvalues to one (Gratton, Sartenaer and Tshimanga 2011, for sequences of
/// Gauss-Newton systems). As systems change from step to step this is approximate, but always
/// positive definite.
class RecycledModes {
 public:
  explicit RecycledModes(std::size_t length) : length_(length) {}

  /// A run begins.
  void begin();
  /// An iteration: z = H r, rz = r.z, and the step length alpha along its direction.
  void add(const double* z, double rz, double alpha);
  /// The run has ended with this r.z: keeps what is worth keeping for the next.
  void end(double rz);
  /// Forgets all: the system was not what these modes take it for.
  void clear() { kept_ = next_ = 0; }

  /// z += sum_j (1 / theta_j - 1) y_j (y_j . r).
  void correct(const double* r, double* z) const;

  /// What it knows, to be written down; a run in progress is not part of it.
  struct History {
    std::size_t kept = 0, next = 0;
    std::vector<float> modes;     ///< of `length` numbers each
    std::vector<double> weights;  ///< of each mode
  };
  History history() const;
  /// As history() gave it. False, and nothing done, for modes of another length.
  bool restore(const History& history);

  std::size_t count() const { return kept_; }
  std::uint64_t bytes() const { return basis_.bytes() + modes_.bytes(); }
  /// What a run of many iterations makes of it.
  static std::uint64_t most_bytes(std::uint64_t columns) {
    return sizeof(float) * (kBasis + kMost) * columns;
  }

 private:
  static constexpr std::size_t kBasis = 48, kMost = 24;

  struct Iterate {
    double rz, alpha;
  };
  void keep(const std::vector<double>& of_basis, double theta);

  std::size_t length_;
  std::vector<Iterate> iterates_;
  Buffer<float> basis_, modes_;  ///< length_ each; single precision is enough to precondition
  std::vector<double> weight_;   ///< 1 / theta - 1 of each mode; the oldest are replaced
  std::size_t kept_ = 0, next_ = 0;
};

}  // namespace sheaf
