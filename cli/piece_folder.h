// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

#include "sheaf/problem.h"

namespace sheaf {

// A folder of pieces. All throw sheaf::Error.

/// The folder is there and holds nothing but pieces, which may be replaced. Errors: usage where it
/// holds anything else; unwritable_output.
void make_piece_folder(const std::string& folder);
/// Takes away what an earlier split into more pieces left behind.
void remove_other_pieces(const std::string& folder, std::uint32_t pieces);
/// Writes the states of all pieces into the scene; returns how many there are. Errors:
/// unreadable_input; usage where they are of another scene, as its digest says.
std::uint32_t join_pieces(const std::string& folder, Problem& scene);

}  // namespace sheaf
