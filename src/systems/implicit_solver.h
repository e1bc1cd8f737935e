// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>

#include "reduced/camera_solver.h"
#include "reduced/conjugate_gradients.h"

namespace sheaf {

/// S x with the Jacobians computed again from the held state, whatever the rows are.
class StateOperator : public ImageOperator {
 public:
  /// Before a run at a newly eliminated state; squares: diag(J^T J) by column.
  virtual void prepare(const double* squares) = 0;
  virtual std::uint64_t bytes() const = 0;
};

/// Conjugate gradients with S never formed. rounded: in single precision, taken until the system
/// asks for double; may be null.
std::unique_ptr<CameraSolver> make_implicit_solver(const Columns& columns,
                                                   std::unique_ptr<StateOperator> exact,
                                                   std::unique_ptr<StateOperator> rounded,
                                                   Threads& threads);

}  // namespace sheaf
