// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "platform/buffer.h"

namespace sheaf {

/// The interval that a column's step must stay in; it contains 0.
struct StepBound {
  std::int32_t column;
  double lower, upper;
};

/// The active set of one camera step. A column that stands at its bound and is pushed outward is
/// held; one whose step would cross its bound goes up to it, and the others are solved for again.
/// A column is held by a damping that leaves nothing else of its row, so any solver will do.
class ActiveBounds {
 public:
  /// At the held state: rhs is that of the undamped system, squares diag(J^T J).
  void begin(std::vector<StepBound> bounds, const Buffer<double>& rhs,
             const Buffer<double>& squares);
  /// Whether the column is held, its bound being active.
  bool holds(std::int32_t column) const;
  /// Their damping leaves a float nothing of other rows.
  bool hold_any() const { return !held_.empty(); }
  /// Whether some column steps up to a bound, so that the solve must be exact beyond the rest.
  bool steps() const;

  /// Writes the rows of held columns for the solver; what stood there is put back afterwards, and
  /// the columns' steps are set. Whether others are held than before: what a solver has learnt of
  /// the system is then wrong by the size of their damping.
  bool prescribe(Buffer<double>& rhs, Buffer<double>& damping);
  void put_back(Buffer<double>& rhs, Buffer<double>& damping, Buffer<double>& step);
  /// Holds what crosses its bound; false where nothing does.
  bool add_crossing(const Buffer<double>& step);

  /// What is to be added to twice the decrease that was summed as if (S + D) x = b in every row.
  double correction() const;

 private:
  void hold(std::int32_t column, double step);

  struct Held {
    std::int32_t column;
    double step;
    double hold;                  ///< damping that holds it
    double rhs = 0, damping = 0;  ///< its own
    double pull = 0;              ///< (S x) of its row
  };
  std::vector<StepBound> bounds_;
  std::vector<Held> held_;
  std::vector<std::int32_t> before_;  ///< columns held in the last solve, ascending
  const Buffer<double>* squares_ = nullptr;
};

}  // namespace sheaf
