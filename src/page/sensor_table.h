// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "sheaf/covariance.h"

namespace sheaf {

/// How well each sensor's place and turn in its rig are known (scene units, degrees); nothing
/// without rigs, or where nothing of them moves.
std::string sensor_table(const Problem& problem, const Covariance* known);

}  // namespace sheaf
