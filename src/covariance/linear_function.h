// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace sheaf {

/// What the columns of one block add to a linear function of the parameters.
struct LinearPart {
  std::uint32_t block;
  std::vector<double> by;  ///< rows x width of the block, row-major
};
struct LinearFunction {
  std::vector<LinearPart> parts;
  std::size_t rows = 0;
};

}  // namespace sheaf
