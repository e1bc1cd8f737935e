// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace sheaf {

/// How the reduced camera system is solved.
enum class CameraSolverKind {
  automatic,           ///< the cheapest by counted flops and bytes
  dense,               ///< formed, dense Cholesky
  sparse,              ///< formed by blocks, sparse Cholesky
  iterative,           ///< conjugate gradients, explicit or implicit by counted flops and bytes
  iterative_explicit,  ///< conjugate gradients on the formed blocks
  iterative_implicit,  ///< conjugate gradients, nothing formed: Jacobians recomputed
};

}  // namespace sheaf
