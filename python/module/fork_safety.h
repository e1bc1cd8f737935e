// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace sheaf {

/// How many threads a call may have that was asked for `asked` (0: all). In a child of fork(2)
/// whose parent had started threads it is 1: those of the pool are not in the child. Results do not
/// depend on it.
int threads_here(int asked);

}  // namespace sheaf
