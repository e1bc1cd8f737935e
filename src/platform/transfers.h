// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>

namespace sheaf {

/// Bytes of files that this process has read and written so far, as they lie there, for who shows
/// how far it is.
struct Transfers {
  std::atomic<std::uint64_t> read{0}, written{0};
};
inline Transfers transfers;

}  // namespace sheaf
