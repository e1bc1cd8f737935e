// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "inspect/finding_list.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Looks for what makes a problem ill-posed, slow to solve or wrong: parts that nothing joins,
/// images, frames, sensors and points with too few measurements, measurements that occur twice or
/// lie where no image can hold them, points behind cameras, in their planes and at their centres,
/// rays that hardly meet, absurd focal lengths and distortion, lenses that fold back, residuals far
/// off. Grave ones first. threads: 0 takes all; findings do not depend on it.
std::vector<Finding> check(const Problem& problem, int threads = 1);

}  // namespace sheaf
