// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include "reduced/camera_solver.h"

namespace sheaf {

/// What the implicit product reads: the held state, whose camera records carry x as their step.
struct HeldState {
  const Batches* batches;
  const Chunks* chunks;
  Buffer<double>* cameras;
  const Buffer<double>* points;
  const Buffer<double>* factors;
  const Buffer<double>* weights;  ///< of the loss; empty: none
};

/// Conjugate gradients with S never formed: products recompute the Jacobians from the state; mixed:
/// in single precision.
std::unique_ptr<CameraSolver> make_implicit_solver(const Columns& columns, const HeldState& state,
                                                   bool mixed, const Kernels& kernels,
                                                   Threads& threads);

}  // namespace sheaf
