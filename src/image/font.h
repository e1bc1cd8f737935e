// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>

namespace sheaf {

inline constexpr int kGlyphColumns = 5, kGlyphRows = 9;  // the last two rows are for descenders

/// Rows from the top; the highest of five bits is the left column.
using Glyph = std::array<std::uint8_t, kGlyphRows>;

/// Of a printable ASCII character; '?' for any other.
const Glyph& glyph_of(char c);

}  // namespace sheaf
