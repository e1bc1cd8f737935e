// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>

#include "platform/buffer.h"
#include "platform/parallel.h"

namespace sheaf {

/// `sums` holds `slices` sets of equal size, one behind the other: adds them into the first, in
/// order.
void add_slices(Buffer<double>& sums, std::size_t slices, Threads& threads);

}  // namespace sheaf
