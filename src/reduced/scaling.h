// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

namespace sheaf {

/// The power of two that brings x next to 1; 1 where there is none. Powers of two round nothing.
inline double towards_one(double x) {
  return x > 0 && std::isfinite(x) ? std::ldexp(1.0, -std::ilogb(x)) : 1;
}

}  // namespace sheaf
