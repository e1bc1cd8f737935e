// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>

#include "io/byte_source.h"
#include "io/output_file.h"
#include "io/token_reader.h"
#include "sheaf/error.h"
#include "sheaf/problem.h"

namespace sheaf {

/// Bundle Adjustment in the Large, numbers separated by white space:
///   <cameras> <points> <observations>
///   <camera> <point> <x> <y>                           for each observation
///   <3 angle-axis> <3 translation> <f> <k1> <k2>       for each camera
///   <X> <Y> <Z>                                        for each point
/// and nothing behind. Each camera becomes an image with a lens of its own. The counts are held
/// against the size of the file before anything is allocated. Errors: unreadable_input, as
/// FILE:LINE: found this, expected that.
Result<Problem> read_bal(ByteSource& source, std::size_t window_bytes = TokenReader::kWindowBytes);

/// The same from memory; the bytes may be compressed. `name` stands in the messages.
Result<Problem> parse_bal(std::string_view bytes, const std::string& name,
                          std::size_t window_bytes = TokenReader::kWindowBytes);

/// Every double in the shortest form that reads back to the same bits; a rotation as the file
/// stated it when the pose still is the one that it converts to. Expects a valid problem of BAL
/// cameras.
Result<void> write_bal(const Problem& problem, OutputFile& out);

}  // namespace sheaf
