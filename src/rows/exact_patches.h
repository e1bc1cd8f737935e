// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include "rows/photometric.h"

namespace sheaf {

/// Pairs of rows that a warped patch leaves when each of its pixels keeps its own derivatives.
constexpr int kExactPairs = 3;

/// PhotometricKernels::collapse for warped patches, without taking the middle's derivatives for
/// those of all pixels, by plain code. With A = (gx, gy) du/dP at a pixel's own P = R d + s t, all
/// of its columns are combinations of eight:
///   A (3), P x A (3), -g, -1:   by rho s A, by phi P x A, by the inverse depth A t.
/// The pixels' rows of these eight and of r are triangularised by Householder reflections; the
/// first six rows are the patch's, three pairs, and the other two touch brightness alone. out.rows
/// has kExactPairs batches of rows for each of the patches: pair k of batch b is batch kExactPairs
/// b + k. lanes: as of RowKernels.
void collapse_exactly(const PhotometricInput& in, int lanes, std::uint32_t first, std::uint32_t end,
                      PhotometricOutput& out);

}  // namespace sheaf
