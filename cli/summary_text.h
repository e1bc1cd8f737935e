// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "sheaf/problem.h"
#include "sheaf/solve.h"

namespace sheaf {

/// "16 images, 22106 points, 83718 observations"
std::string counts_text(const Problem& problem);

/// Lines on a checkpoint that was gone on from, and on one that could not be written; or none.
std::string checkpoints_text(const Summary& summary);

/// A few lines for people: costs, iterations, the reason for stopping.
std::string summary_text(const Summary& summary, double read_s);

}  // namespace sheaf
