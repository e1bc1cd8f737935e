// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace sheaf {

/// RFC 4648, without line ends.
std::string base64(const std::string& bytes);

}  // namespace sheaf
