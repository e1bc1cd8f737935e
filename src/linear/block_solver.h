// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "linear/camera_solver.h"

namespace sheaf {

/// The camera system where images do not couple (points held, no shared lens): one Cholesky
/// factorisation of at most 9 x 9 for each image. Linear in images.
bool solve_blocks(const ReducedSums& sums, const Columns& columns, const CameraVectors& vectors,
                  const double* damping, Threads& threads, Buffer<double>& x);

}  // namespace sheaf
