// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>

namespace sheaf {

/// Resident size of this process now, and its peak so far; 0 where the system does not say.
std::uint64_t resident_bytes();
std::uint64_t peak_resident_bytes();

/// "12 MB", rounded up: for people.
std::string megabytes(std::uint64_t bytes);

/// A limit as a user gives it: "500M", "2G", "5000000 bytes".
std::string as_given(std::uint64_t bytes);

}  // namespace sheaf
