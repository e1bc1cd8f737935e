// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "io/output_file.h"
#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Binary little-endian PLY: vertices (float x, y, z, uchar red, green, blue) and edges (int
/// vertex1, vertex2, uchar red, green, blue). The vertices are the points, then five for each
/// camera frustum: the centre and the four corners of its image plane; eight edges join them. The
/// frusta's size follows from how close the cameras stand to each other. Expects valid problems.
Result<void> write_ply(const Problem& problem, OutputFile& out);

/// The scene before in grey and after in colour, in one file: points before, points after, frusta
/// before, frusta after.
Result<void> write_ply(const Problem& before, const Problem& after, OutputFile& out);

}  // namespace sheaf
