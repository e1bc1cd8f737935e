// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

namespace sheaf {

/// Doubles of the stored rows of one batch: 26 fields (residual 2, camera Jacobian 2 x 9, point
/// Jacobian 2 x 3) of eight lanes, part by part of the instruction set that wrote them.
constexpr std::size_t kRowBatch = 26 * 8;

}  // namespace sheaf
